"""Documents from SCXML text: what the tests of this folder start from."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

import pytest

from fsmkit.diagnostics import Findings, Source
from fsmkit.document.document import Document
from fsmkit.scxml.reader import read_document
from tests.reading import Found

HEAD = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"'
    ' name="chart" datamodel="{datamodel}"{more}>'
)


@dataclass(frozen=True)
class Read(Found):
    """A document (None where there were errors) and what was found."""

    maybe: Document | None

    @property
    def document(self) -> Document:
        """The document, which must be there."""
        assert self.maybe is not None, self.messages
        return self.maybe


def read_text(text: str, name: str = "chart.scxml") -> Read:
    """Read a whole SCXML text."""
    findings = Findings()
    document = read_document(Source(name, text), findings)
    return Read(tuple(findings), document)


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
