"""YAML texts, what they read as, and what is found in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from textwrap import dedent

import pytest

from fsmkit.diagnostics import Diagnostic, Findings, Source
from fsmkit.document.document import DocState, Document
from fsmkit.yaml.nodes import Node, read_nodes
from fsmkit.yaml.reader import read_document
from tests.reading import Found, underlined


@dataclass(frozen=True)
class Read(Found):
    """What a text reads as, and what was found."""

    text: str
    node: Node | None
    maybe: Document | None

    @property
    def document(self) -> Document:
        assert self.maybe is not None, self.messages
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

    def at(self, diagnostic: Diagnostic) -> str:
        """The text that a finding underlines."""
        assert diagnostic.primary is not None
        return underlined(diagnostic.primary.span)


Reader = Callable[[str], Read]


@pytest.fixture
def nodes() -> Reader:
    """Read a text as nodes."""

    def read(text: str) -> Read:
        findings = Findings()
        node = read_nodes(Source("a.yaml", text), findings)
        return Read(tuple(findings), text, node, None)

    return read


@pytest.fixture
def chart() -> Reader:
    """Read a text as a chart."""

    def read(text: str) -> Read:
        findings = Findings()
        text = dedent(text)
        document = read_document(Source("a.yaml", text), findings)
        return Read(tuple(findings), text, None, document)

    return read
