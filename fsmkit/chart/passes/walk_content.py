"""Visit every handler of a document, with what it belongs to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.chart.passes.number_states import Tree
from fsmkit.document.document import DocInvoke, DocTransition, Document
from fsmkit.language.statements.tree import Block


@dataclass(frozen=True, slots=True)
class Place:
    """A handler and whose it is: a transition's content, a finalize, or entry, exit, script."""

    block: Block
    transition: DocTransition | None = None
    invoke: DocInvoke | None = None


def places(document: Document, tree: Tree) -> Iterator[Place]:
    """Return every handler, in document order."""
    yield Place(document.script)
    for node in tree.nodes:
        state = node.state
        for block in (*state.entry, *state.exit):
            yield Place(block)
        for transition in (*([state.initial] if state.initial else []), *state.transitions):
            yield Place(transition.content or (), transition)
        for invoke in state.invokes:
            yield Place(invoke.finalize or (), invoke=invoke)
