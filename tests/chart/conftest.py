"""Charts from texts: what the tests of this folder start from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from textwrap import dedent

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.elaborate import elaborate
from fsmkit.diagnostics import Findings, Source
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin
from tests.reading import Found


@dataclass(frozen=True)
class Elaborated(Found):
    """A chart (None where there were errors) and what was found."""

    maybe: Chart | None

    @property
    def chart(self) -> Chart:
        """The chart, which must be sound."""
        assert self.maybe is not None, self.messages
        return self.maybe


def _elaborate(name: str, texts: tuple[str, ...], *, strict: bool) -> Elaborated:
    findings = Findings()
    front_end = plugin(FrontEnd, name)
    documents = []
    for number, text in enumerate(texts):
        source = Source(f"{'base' * number or 'chart'}.{name}", dedent(text).lstrip())
        document = front_end.read(source, findings)
        assert document is not None, [d.message for d in findings]
        documents.append(document)
    assert not findings.has_errors, [d.message for d in findings]
    chart = elaborate(tuple(documents), findings, strict=strict)
    return Elaborated(tuple(findings), chart)


Reader = Callable[..., Elaborated]


@pytest.fixture
def yaml() -> Reader:
    """Elaborate YAML: the chart, then its bases, nearest first."""

    def read(*texts: str, strict: bool = False) -> Elaborated:
        return _elaborate("yaml", texts, strict=strict)

    return read


@pytest.fixture
def scxml() -> Reader:
    """Elaborate SCXML: the chart, then its bases, nearest first."""

    def read(*texts: str, strict: bool = False) -> Elaborated:
        return _elaborate("scxml", texts, strict=strict)

    return read
