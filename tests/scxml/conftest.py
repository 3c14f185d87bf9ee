"""Documents from SCXML text: what the tests of this folder start from."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

import pytest

from fsmkit.diagnostics import Diagnostic, Findings, Severity, Source, Span, Text
from fsmkit.document.document import Document
from fsmkit.scxml.reader import read_document

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
    ' name="chart" datamodel="{datamodel}"{more}>'
)


@dataclass(frozen=True)
class Read:
    """A document (None where there were errors) and what was found."""

    maybe: Document | None
    found: tuple[Diagnostic, ...]

    @property
    def document(self) -> Document:
        """The document, which must be there."""
        assert self.maybe is not None, [d.message for d in self.found]
        return self.maybe

    @property
    def rules(self) -> list[str]:
        """Names of the rules found, in order."""
        return [d.rule.name for d in self.found]

    @property
    def errors(self) -> list[str]:
        """Names of the rules found that are errors."""
        return [d.rule.name for d in self.found if d.severity is Severity.ERROR]

    @property
    def marked(self) -> list[str]:
        """What each finding underlines."""
        return [underlined(d.primary.span) for d in self.found if d.primary]


def underlined(at: Span | Text) -> str:
    """Return the source text at a place."""
    span = at.span if isinstance(at, Text) else at
    return span.source.text[span.start : span.end]


def read_text(text: str, name: str = "chart.scxml") -> Read:
    """Read a whole SCXML text."""
    findings = Findings()
    return Read(read_document(Source(name, text), findings), tuple(findings))


ReadChart = Callable[..., Read]


@pytest.fixture
def read() -> ReadChart:
    """Read what stands in an ``scxml`` element."""

    def read_inside(
        text: str, datamodel: str = "fsmkit", more: str = "", name: str = "chart.scxml"
    ) -> Read:
        head = HEAD.format(datamodel=datamodel, more=more)
        return read_text(f"{head}\n{dedent(text).strip()}\n</scxml>", name)

    return read_inside


@pytest.fixture(scope="session")
def public_files() -> Path:
    """The folder of public test data."""
    beside = Path(__file__).parents[3] / "shared/conformance"
    folder = Path(os.environ.get("FSMKIT_CONFORMANCE", beside))
    if not folder.is_dir():
        pytest.fail(f"there is no public test data in {folder}; set FSMKIT_CONFORMANCE")
    return folder
