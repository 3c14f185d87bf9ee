"""Reduce a failing example: remove parts of Documents and a script while it still fails.

Hypothesis shrinks only its own examples. This module reduces those of a seed in the long runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any, TypeVar

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.document.document import DocState, DocTransition, Document, Kind, Trigger
from fsmkit.language.statements.tree import If

Script = tuple[str, ...]
Documents = tuple[Document, ...]
"""A chart as written, and after it those it extends, nearest first."""
Item = TypeVar("Item")
Fails = Callable[[Documents, Script], bool]
"""Returns whether an example still fails; False for an invalid one."""

DROPPED = frozenset({"guard", "content", "id", "target", "index", "reply", "result", "delay_expr"})
"""Optional parts that can go."""
SIMPLER = {"guard": "true", "condition": "true", "value": "0"}
"""Expressions and their simplest replacements."""


def reduce_example(
    documents: Documents, script: Script, fails: Fails, budget: int = 3000
) -> tuple[Documents, Script]:
    """Return a smaller example that still fails, after at most ``budget`` tries."""
    tries = _Tries(budget)
    size = -1
    while size != tries.successes and tries.left > 0:
        size = tries.successes
        script = _improve(script, _shorter, partial(fails, documents), tries)
        documents = _improve(documents, _documents, partial(_swapped, fails, script), tries)
    return documents, script


def _swapped(fails: Fails, script: Script, documents: Documents) -> bool:
    return fails(documents, script)


@dataclass
class _Tries:
    left: int
    successes: int = 0


def _improve(
    whole: Item,
    variants: Callable[[Item], Iterator[Item]],
    fails: Callable[[Item], bool],
    t: _Tries,
) -> Item:
    """Go through the variants once, always of the smallest that still fails."""
    place = 0
    while t.left > 0:
        for number, variant in enumerate(variants(whole)):
            if number < place or variant == whole:  # removing dangling references may undo a change
                continue
            t.left -= 1
            if t.left <= 0:
                return whole
            if fails(variant):
                whole, place = variant, number
                t.successes += 1
                break
        else:
            return whole
    return whole


def _documents(documents: Documents) -> Iterator[Documents]:
    return (drop_dangling(variant) for variant in _variants(documents) if variant)


def _shorter(script: Script) -> Iterator[Script]:
    size = len(script) // 2
    while size:
        for start in range(0, len(script), size):
            yield script[:start] + script[start + size :]
        size //= 2


def _variants(node: Any) -> Iterator[Any]:
    """Yield the trees that result from one change, the largest changes first."""
    if isinstance(node, tuple):
        size = len(node)
        while size:
            for start in range(0, len(node), size):
                yield node[:start] + node[start + size :]
            size //= 2
        for place, part in enumerate(node):
            if isinstance(part, If):
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


def drop_dangling(documents: Documents) -> Documents:
    """Return documents without dangling references after the removal of states.

    Without its base, a chart is complete itself or invalid.
    """
    found: list[Document] = []
    ids: set[str] = set()
    for document in reversed(documents):
        states = [s for root in (document.root, *document.refine) for s in _states(root)]
        ids |= {state.id.value for state in states if state.id is not None}
        ids |= {f"{state.id}.main" for state in document.refine}
        refine = tuple(_refined(state, ids) for state in document.refine)
        extends = document.extends if found else None
        root = _without_dangling(document.root, ids)
        found.append(replace(document, root=root, refine=refine, extends=extends))
    return tuple(reversed(found))


def _states(state: DocState) -> Iterator[DocState]:
    yield state
    for child in state.children:
        yield from _states(child)


def _without_dangling(state: DocState, ids: set[str]) -> DocState:
    children = tuple(_without_dangling(child, ids) for child in state.children)
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


def _refined(state: DocState, ids: set[str]) -> DocState:
    """Return a modification of an inherited state with its own content only."""
    mended = _without_dangling(state, ids)
    stands = state.initial is not None and _stands(state.initial, ids)
    return replace(mended, kind=state.kind, initial=state.initial if stands else None)


def _stands(transition: DocTransition, ids: set[str]) -> bool:
    is_aimed = bool(transition.targets) or transition.trigger is not Trigger.INITIAL
    return is_aimed and all(target.value in ids for target in transition.targets)
