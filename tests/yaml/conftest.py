"""YAML texts, what they read as, and what is found in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from textwrap import dedent

import pytest

from fsmkit.diagnostics import Diagnostic, Findings, Severity, Source
from fsmkit.document.document import DocState, Document
from fsmkit.yaml.nodes import Node, read_nodes
from fsmkit.yaml.reader import read_document


@dataclass(frozen=True)
class Read:
    """What a text reads as, and what was found."""

    text: str
    node: Node | None
    maybe: Document | None
    found: tuple[Diagnostic, ...]

    @property
    def document(self) -> Document:
        assert self.maybe is not None, [d.message for d in self.found]
        return self.maybe

    def state(self, name: str) -> DocState:
        """The state of that id, at any depth, also one that is refined."""
        pending = [self.document.root, *self.document.refine]
        while pending:
            state = pending.pop()
            if state.id is not None and state.id.value == name:
                return state
            pending += state.children
        raise LookupError(name)

    @property
    def errors(self) -> list[str]:
        return [d.rule.name for d in self.found if d.severity is Severity.ERROR]

    def at(self, diagnostic: Diagnostic) -> str:
        """The text that a finding underlines."""
        assert diagnostic.primary is not None
        span = diagnostic.primary.span
        return span.source.text[span.start : span.end]

    def one(self, rule: str) -> Diagnostic:
        (diagnostic,) = (d for d in self.found if d.rule.name == rule)
        return diagnostic


Reader = Callable[[str], Read]


@pytest.fixture
def nodes() -> Reader:
    """Read a text as nodes."""

    def read(text: str) -> Read:
        findings = Findings()
        return Read(text, read_nodes(Source("a.yaml", text), findings), None, tuple(findings))

    return read


@pytest.fixture
def chart() -> Reader:
    """Read a text as a chart."""

    def read(text: str) -> Read:
        findings = Findings()
        text = dedent(text)
        document = read_document(Source("a.yaml", text), findings)
        return Read(text, None, document, tuple(findings))

    return read
