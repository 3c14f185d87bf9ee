"""R10: the guards along a path of choices are evaluated before any action of the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocState, DocTransition, Document, Kind, Trigger
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import Tree, map_states

RULE = "R10"
MOST = 1000
"""Transitions of one path tree; more paths are omitted, as in a circle of choices."""


def static_choices(document: Document, recorder: Recorder) -> Document:
    """Replace each transition into choice states by one for each path, with joined guards.

    The choices that no initial transition targets disappear.
    """
    tree = Tree(document)
    choices = {name: one for name, one in tree.states.items() if one.kind is Kind.CHOICE}
    if not choices:
        return document

    def change(state: DocState) -> DocState:
        if state.kind is Kind.CHOICE:
            return state
        found: list[DocTransition] = []
        for transition in state.transitions:
            paths = list(_paths(transition, choices))
            if paths != [transition]:
                recorder.rewrite(RULE, transition.span)
            found += paths[:MOST]
        return replace(state, transitions=tuple(found))

    changed = map_states(document, change)
    kept = _targeted(changed, choices)

    def prune(state: DocState) -> DocState:
        children = tuple(
            child
            for child in state.children
            if child.kind is not Kind.CHOICE or (child.id and child.id.value in kept)
        )
        return replace(state, children=children)

    return map_states(changed, prune)


def _paths(
    transition: DocTransition, choices: dict[str, DocState], visited: frozenset[str] = frozenset()
) -> Iterator[DocTransition]:
    """Yield the transitions for all paths, in the order of the choices; circles have none."""
    name = transition.targets[0].value if len(transition.targets) == 1 else ""
    if name not in choices:
        yield transition
    elif name not in visited:
        for leg in choices[name].transitions:
            joined = replace(
                transition,
                guard=_both(transition.guard, leg.guard),
                content=(*(transition.content or ()), *(leg.content or ())) or None,
                targets=leg.targets,
            )
            yield from _paths(joined, choices, visited | {name})


def _both(first: Text | None, second: Text | None) -> Text | None:
    if first is None or second is None:
        return second if first is None else first
    return second.with_value(f"({first}) && ({second})")


def _targeted(document: Document, choices: dict[str, DocState]) -> set[str]:
    """Return the choices that initial transitions reach."""
    tree = Tree(document)
    starts = [document.root, *tree.states.values()]
    left = [
        target.value
        for state in starts
        for transition in (state.initial, *state.transitions)
        if transition is not None
        and (transition.trigger is Trigger.INITIAL or state.kind is not Kind.CHOICE)
        for target in transition.targets
        if target.value in choices
    ]
    found: set[str] = set()
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += [t.value for leg in choices[name].transitions for t in leg.targets
                     if t.value in choices]  # fmt: skip
    return found
