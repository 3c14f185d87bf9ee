"""From one notation to the other and back: the Chart is the same, or it is said why not.

Documents may differ in what has no meaning (a script that is empty, the layout of an XML value), so
that Charts are compared; places do not take part.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.loading import base_documents, real, with_invoked
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.document.document import Document
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin

pytestmark = pytest.mark.slow

Found = list[tuple[str, str]]

PROJECT = Path(__file__).parents[3]
FRONT_ENDS = {
    ".scxml": "scxml",
    ".xml": "scxml",
    ".txml": "scxml",
    ".yaml": "yaml",
}
"""Suffixes of charts; ``.txml`` are the tests of the W3C before they are given a data model."""


def read(front_end: FrontEnd, path: Path, content: bytes) -> Document | None:
    findings = Findings()
    source = front_end.decode(content, str(path), findings)
    return None if source is None else front_end.read(source, findings)


def meaning(document: Document, path: Path) -> tuple[Chart | None, Found]:
    """Return the Chart, or else what was found instead."""
    findings = Findings()
    try:
        whole = with_invoked(document, findings, (real(path),), {})
        chart = elaborate((whole, *base_documents(document, findings)), findings)
    except FsmkitError as error:
        findings.extend(error.diagnostics)
        chart = None
    return chart, [] if chart is not None else sorted((f.rule.name, f.message) for f in findings)


def there_and_back(document: Document, front_end: FrontEnd, other: FrontEnd) -> Document:
    """Return what is read of what is written of what is read in the other notation."""
    for notation in (other, front_end):
        findings = Findings()
        written = notation.write(document)
        read = notation.read(Source(document.source.name, written), findings)
        assert read is not None, (document.source.name, [f.message for f in findings], written)
        document = read
    return document


def differences(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the charts below a folder that were read, and those that came back changed."""
    compared, changed = [], []
    for path in sorted(folder.rglob("*")):
        if path.suffix not in FRONT_ENDS or not path.is_file():
            continue
        name = FRONT_ENDS[path.suffix]
        front_end = plugin(FrontEnd, name)
        document = read(front_end, path, path.read_bytes())
        if document is None:
            continue
        compared.append(path)
        other = plugin(FrontEnd, "scxml" if name == "yaml" else "yaml")
        back = there_and_back(document, front_end, other)
        if meaning(back, path) != meaning(document, path):
            changed.append(path)
    return compared, changed


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [("yaml", "scxml"), ("scxml", "yaml")])
def test_random_charts(first: str, second: str) -> None:
    """Charts in both dialects, with their bases and what they invoke."""
    for number in range(80):
        case = random_case(11, number)
        back = tuple(
            with_invoked(
                there_and_back(document, plugin(FrontEnd, second), plugin(FrontEnd, first)),
                Findings(),
                (),
                {},
            )
            for document in case.documents
        )
        assert elaborate(back, Findings()) == case.chart, number


@pytest.mark.parametrize(("folder", "at_least"), [("machines", 6), ("tests/golden", 3)])
def test_own_charts(folder: str, at_least: int) -> None:
    compared, changed = differences(PROJECT / folder)
    assert not changed
    assert len(compared) >= at_least


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suite", "at_least"), [("w3c/ecma", 120), ("w3c/txml", 140), ("scripted", 75), ("corpus", 50)]
)
def test_shared_charts(suite: str, at_least: int, shared: Callable[[str], Path]) -> None:
    compared, changed = differences(shared(suite))
    assert not changed
    assert len(compared) >= at_least
