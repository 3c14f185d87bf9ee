"""Making a failing example small: a Document and a script, piece by piece, while it still fails.

Hypothesis shrinks what it drew itself. This is for what a seed gave, in the long runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.model.document import DocIf, DocState, DocTransition, Document, Kind, Trigger

Script = tuple[str, ...]
Fails = Callable[[Document, Script], bool]
"""Whether an example still fails; False for one that is not valid."""

DROPPED = frozenset({"guard", "content", "id", "target", "index", "reply", "result", "delay_expr"})
"""Optional parts that can go."""
SIMPLER = {"guard": "true", "condition": "true", "value": "0"}
"""Expressions and the simplest that may stand in their place."""


def reduce_example(
    document: Document, script: Script, fails: Fails, budget: int = 3000
) -> tuple[Document, Script]:
    """Return a smaller example that still fails, after at most ``budget`` tries."""
    left = budget
    is_smaller = True
    while is_smaller and left > 0:
        is_smaller = False
        for shorter in _shorter(script):
            left -= 1
            if left > 0 and fails(document, shorter):
                script, is_smaller = shorter, True
                break
        for variant in _variants(document):
            left -= 1
            if left <= 0:
                break
            mended = mend(variant)
            if fails(mended, script):
                document, is_smaller = mended, True
                break
    return document, script


def _shorter(script: Script) -> Iterator[Script]:
    size = len(script) // 2
    while size:
        for start in range(0, len(script), size):
            yield script[:start] + script[start + size :]
        size //= 2


def _variants(node: Any) -> Iterator[Any]:
    """Yield what one change makes of a tree, the greatest changes first."""
    if isinstance(node, tuple):
        for place in range(len(node)):
            yield node[:place] + node[place + 1 :]
        for place, part in enumerate(node):
            if isinstance(part, DocIf):
                for branch in part.branches:
                    yield node[:place] + branch.body + node[place + 1 :]
            for variant in _variants(part):
                yield (*node[:place], variant, *node[place + 1 :])
    elif is_dataclass(node) and not isinstance(node, Text | Span | Source | type):
        for part in fields(node):
            value = getattr(node, part.name)
            simpler = SIMPLER.get(part.name)
            if value is not None and part.name in DROPPED:
                yield replace(node, **{part.name: None})
            if isinstance(value, Text) and simpler is not None and value.value != simpler:
                yield replace(node, **{part.name: replace(value, value=simpler)})
            if value is True:
                yield replace(node, **{part.name: False})
            for variant in _variants(value):
                yield replace(node, **{part.name: variant})


def mend(document: Document) -> Document:
    """Return a document without what dangles after states were taken out of it."""
    ids = {state.id.value for state in _states(document.root) if state.id is not None}
    return replace(document, root=_mended(document.root, ids))


def _states(state: DocState) -> Iterator[DocState]:
    yield state
    for child in state.children:
        yield from _states(child)


def _mended(state: DocState, ids: set[str]) -> DocState:
    children = tuple(_mended(child, ids) for child in state.children)
    kind = state.kind
    if kind in (Kind.COMPOUND, Kind.PARALLEL) and not children and state.id is not None:
        kind = Kind.ATOMIC
    initial = state.initial
    if initial is not None and not _stands(initial, ids):
        real = [c.id for c in children if c.id is not None and c.initial is None] or [
            c.id for c in children if c.id is not None
        ]
        initial = replace(initial, targets=tuple(real[:1])) if real else None
    if kind is Kind.ATOMIC:
        initial = None
    transitions = tuple(t for t in state.transitions if _stands(t, ids))
    return replace(state, kind=kind, children=children, initial=initial, transitions=transitions)


def _stands(transition: DocTransition, ids: set[str]) -> bool:
    is_aimed = bool(transition.targets) or transition.trigger is not Trigger.INITIAL
    return is_aimed and all(target.value in ids for target in transition.targets)
