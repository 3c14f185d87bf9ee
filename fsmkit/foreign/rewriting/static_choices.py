"""R10: the guards along a path of choices are evaluated before any action of the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocState, DocTransition, Document, Kind, Trigger
from fsmkit.foreign.imports import Recorder, reject
from fsmkit.foreign.rewriting.tree import Tree, map_states

RULE = "R10"
MOST = 1000
"""Paths of one transition."""
LONGEST = 100
"""Choices of one path."""


def static_choices(document: Document, recorder: Recorder, findings: Findings) -> Document:
    """Replace each transition into choice states by one for each path, with joined guards.

    The choices that no initial transition targets disappear. A transition with too many paths, or
    with one that does not end at a state, is rejected.
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
            paths = list(islice(_paths(transition, choices), MOST + 1))
            whole = [path for path in paths if path is not None]
            if len(whole) < len(paths) or len(paths) > MOST:
                reject(
                    findings,
                    f"this transition has more than {MOST} paths through choices"
                    if len(paths) > MOST
                    else "a path of this transition through choices does not end at a state",
                    transition.span,
                    "connect fewer choices in a row, none of them in a circle or without an exit",
                )
            elif whole != [transition]:
                recorder.rewrite(RULE, transition.span)
            found += whole[:MOST]
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
) -> Iterator[DocTransition | None]:
    """Yield the transitions for all paths, in the order of the choices.

    None represents a path in a circle, one that ends at a choice, and one that is too long.
    """
    name = transition.targets[0].value if len(transition.targets) == 1 else ""
    if name not in choices:
        yield transition
    elif name in visited or len(visited) == LONGEST or not choices[name].transitions:
        yield None
    else:
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
