"""The tree of a document by ids, and changes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.walk import states
from fsmkit.emit.identifiers import Namer


@dataclass(frozen=True)
class Tree:
    """The states of a document by id. States without an id are never targets, and are omitted."""

    document: Document

    @cached_property
    def states(self) -> dict[str, DocState]:
        """Return the states by id, in document order."""
        return {
            state.id.value: state
            for state in states(*self.document.root.children)
            if state.id is not None
        }

    @cached_property
    def parent(self) -> dict[str, str]:
        """Return the id of each state's parent; top-level states are missing."""
        return {
            child.id.value: name
            for name, state in self.states.items()
            for child in state.children
            if child.id is not None
        }

    def ancestors(self, name: str) -> Iterator[str]:
        """Yield the proper ancestors of a state, the nearest first."""
        at = self.parent.get(name)
        while at is not None:
            yield at
            at = self.parent.get(at)

    def is_below(self, name: str, outer: str) -> bool:
        """Return whether a state is a proper descendant of another one."""
        return outer in self.ancestors(name)

    def targets(self) -> frozenset[str]:
        """Return the ids that any transition targets, initial ones included."""
        return frozenset(
            target.value
            for state in (self.document.root, *self.states.values())
            for transition in transitions_of(state)
            for target in transition.targets
        )

    def namer(self) -> Namer:
        """Return a namer of new states."""
        return Namer(self.states)


def name_of(state: DocState) -> str:
    """Return the id of a state; an empty string for one without."""
    return "" if state.id is None else state.id.value


def transitions_of(state: DocState) -> tuple[DocTransition, ...]:
    """Return the transitions of a state, its initial one first."""
    return state.transitions if state.initial is None else (state.initial, *state.transitions)


def map_states(document: Document, change: Callable[[DocState], DocState]) -> Document:
    """Return a document in which each state, the root included, is changed, inner ones first."""

    def changed(state: DocState) -> DocState:
        children = tuple(map(changed, state.children))
        return change(replace(state, children=children) if children else state)

    return replace(document, root=changed(document.root))


def initial_to(target: Text, **more: object) -> DocTransition:
    """Return the initial transition to a state."""
    return DocTransition(Trigger.INITIAL, target.span, targets=(target,), **more)  # type: ignore[arg-type]


def is_composite(state: DocState) -> bool:
    """Return whether a state has children of which one is active."""
    return state.kind in (Kind.COMPOUND, Kind.ATOMIC) and bool(state.children)
