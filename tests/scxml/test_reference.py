"""The reference page shows charts that are right, and leaves no word of the extension out."""

from __future__ import annotations

import re
from pathlib import Path

from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.scxml.names import EXTENSION_ATTRIBUTES, EXTENSION_ELEMENTS
from fsmkit.scxml.reader import read_document

PAGE = (Path(__file__).parents[2] / "docs/reference/scxml.md").read_text(encoding="utf-8")


def test_the_charts_of_the_page() -> None:
    findings = Findings()
    texts = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    lamp, door, night = (read_document(Source("lamp.scxml", text), findings) for text in texts)
    assert [d.message for d in findings] == []
    assert lamp is not None
    assert night is not None
    assert door is not None
    assert elaborate((door,), findings) is not None, [d.message for d in findings]
    assert elaborate((lamp,), findings) is not None, [d.message for d in findings]
    chart = elaborate((night, lamp), findings)
    assert chart is not None, [d.message for d in findings]
    assert {"bright", "dimmed"} <= set(chart.state_index)


def test_every_word_is_explained() -> None:
    for element, attributes in EXTENSION_ELEMENTS.items():
        assert f"fk:{element}" in PAGE
        for attribute in attributes:
            assert re.search(rf"\b{attribute}\b", PAGE), f"{element}@{attribute}"
    for element, attributes in EXTENSION_ATTRIBUTES.items():
        for attribute in attributes:
            assert f"fk:{attribute}" in PAGE, f"{element}@fk:{attribute}"
