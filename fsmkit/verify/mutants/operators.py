"""Mutation operators: each yields the documents of a chart with one change.

The operators are those of statechart mutation (Fabbri et al., *Mutation Testing Applied to Validate
Specifications Based on Statecharts*, ISSRE 1999), and those that inheritance and time add: an
omitted ``super``, a delay that is halved or doubled. A change may produce a chart that cannot be
elaborated, or one that is equivalent: the caller omits both.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Span, Text
from fsmkit.document import document as doc
from fsmkit.document.walk import states
from fsmkit.emit import guard, telling
from fsmkit.language.statements.tree import Block, ForEach, If, Super, WrittenStatement

Documents = tuple[doc.Document, ...]
"""A document and those it extends, nearest first."""

DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([a-z]+)\s*")
BLOCKS = ("entry", "exit")
"""The handlers of a state, by the words of the notation."""
UNHEARD = "event ignored"
NEEDED: dict[str, str] = {
    "target moved": "transition",
    "action dropped": "handler",
    "actions swapped": "handler",
    "super dropped": "handler",
    "transition dropped": "transition",
    "guard dropped": "source",
    "guard negated": "source",
    "delay halved": "source",
    "delay doubled": "source",
    UNHEARD: "source",
}
"""Operators whose change has no effect before a transition is taken, or a handler executed; those
of guards and delays, by which a transition may be taken that never was, before its source is
entered."""


@dataclass(frozen=True, slots=True)
class Mutation:
    """One change of a chart.

    ``place`` is the location of the original. ``owner`` is the location of the transition or state
    that must be taken or entered before the change has an effect, if that is known (see `NEEDED`).
    """

    operator: str
    what: str
    place: Span
    documents: Documents = field(compare=False, repr=False)
    owner: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "what")


@dataclass(frozen=True, slots=True)
class _Change:
    operator: str
    what: str
    place: Span
    owner: Span | None = None


Variant = tuple[_Change, Any]
"""A change, and what the changed part is instead."""


def mutations(documents: Documents, chart: Chart) -> Iterator[Mutation]:
    """Yield every change of a chart, in the order of its documents.

    Args:
        documents: The chart as written, then its bases.
        chart: The elaborated chart, for the events of a state that an ancestor handles.

    """
    siblings = _siblings(documents)
    for place, document in enumerate(documents):
        for change, changed in _of_document(document, siblings):
            whole = (*documents[:place], changed, *documents[place + 1 :])
            yield Mutation(change.operator, change.what, change.place, whole, change.owner)
    yield from _unhandled_event(documents, chart)


def _of_document(document: doc.Document, siblings: dict[str, list[str]]) -> Iterator[Variant]:
    for name, of in (("constants", _of_constant), ("capacities", _of_capacity)):
        for change, changed in _one_of(getattr(document, name), of):
            yield change, replace(document, **{name: changed})

    def of_state(state: doc.DocState) -> Iterator[Variant]:
        return _of_state(state, siblings)

    for change, changed in of_state(document.root):
        yield change, replace(document, root=changed)
    for change, changed in _one_of(document.refine, of_state):
        yield change, replace(document, refine=changed)


def _one_of(parts: Sequence[Any], of: Callable[[Any], Iterator[Variant]]) -> Iterator[Variant]:
    """Yield a tuple of parts with a change in one of them."""
    for place, part in enumerate(parts):
        for change, changed in of(part):
            yield change, (*parts[:place], changed, *parts[place + 1 :])


# --- declarations ---------------------------------------------------------------------------------


def _of_constant(constant: doc.DocConstant) -> Iterator[Variant]:
    text = constant.value
    scaled = _scaled(text) or ((text.with_value(f"({text}) / 2"), text.with_value(f"({text}) * 2")))
    for word, value in zip(("halved", "doubled"), scaled, strict=True):
        what = f"`{constant.name}` is {value} instead of {text}"
        yield _Change(f"constant {word}", what, text.span), replace(constant, value=value)


def _of_capacity(capacity: doc.DocCapacity) -> Iterator[Variant]:
    if capacity.name.value == "queue" and capacity.value.value.strip().isdigit():
        size = int(capacity.value.value)
        for less in sorted({size // 2, size - 1} - {0}, reverse=True):
            what = f"the queue holds {less} instead of {size}"
            change = _Change("queue shortened", what, capacity.value.span)
            yield change, replace(capacity, value=capacity.value.with_value(str(less)))


def _scaled(text: Text) -> tuple[Text, Text] | None:
    """Return half and twice a duration literal; empty for another expression."""
    match = DURATION.fullmatch(text.value)
    if match is None:
        return None
    half, twice = (f"{float(match[1]) * factor:.6f}".rstrip("0").rstrip(".") for factor in (0.5, 2))
    return text.with_value(half + match[2]), text.with_value(twice + match[2])


# --- states and transitions -----------------------------------------------------------------------


def _of_state(state: doc.DocState, siblings: dict[str, list[str]]) -> Iterator[Variant]:
    for name in BLOCKS:
        for change, blocks in _one_of(getattr(state, name), _of_block):
            overrides = state.overrides
            if change.operator == "super dropped":
                overrides = overrides | {name}
            own = replace(change, what=f"{name}: {change.what}", owner=state.span)
            yield own, replace(state, **{name: blocks}, overrides=overrides)
    for place, transition in enumerate(state.transitions):
        if _is_dropped(state, place):
            change = _Change(
                "transition dropped", _shown(transition), transition.span, transition.span
            )
            rest = (*state.transitions[:place], *state.transitions[place + 1 :])
            yield change, replace(state, transitions=rest)
    for change, changed in _one_of(state.transitions, lambda each: _of_transition(each, siblings)):
        yield change, replace(state, transitions=changed)
    for change, changed in _one_of(state.children, lambda each: _of_state(each, siblings)):
        yield change, replace(state, children=changed)


def _is_dropped(state: doc.DocState, place: int) -> bool:
    """Whether a transition may be omitted: a choice needs the last of its own."""
    transition = state.transitions[place]
    is_last = place == len(state.transitions) - 1
    return transition.trigger is not doc.Trigger.INITIAL and not (
        state.kind is doc.Kind.CHOICE and is_last and transition.guard is None
    )


def _of_transition(
    transition: doc.DocTransition, siblings: dict[str, list[str]]
) -> Iterator[Variant]:
    if transition.trigger is doc.Trigger.INITIAL:
        return
    span = transition.span
    yield from _of_guard(transition)
    for place, target in enumerate(transition.targets):
        for other in siblings.get(target.value, []):
            targets = list(transition.targets)
            targets[place] = target.with_value(other)
            change = _Change("target moved", _retargeted(target.value, other), target.span, span)
            yield change, replace(transition, targets=tuple(targets))
    for change, content in _of_block(transition.content or ()):
        yield replace(change, owner=span), replace(transition, content=content)
    scaled = None if transition.delay is None else _scaled(transition.delay)
    for word, delay in zip(("halved", "doubled"), scaled or (), strict=False):
        what = f"{delay} instead of {transition.delay}"
        yield _Change(f"delay {word}", what, span, span), replace(transition, delay=delay)


def _of_guard(transition: doc.DocTransition) -> Iterator[Variant]:
    text = transition.guard
    if text is None:
        return
    owner = transition.span
    always = _Change("guard dropped", f"always instead of `{text}`", text.span, owner)
    yield always, replace(transition, guard=text.with_value("true"))
    negated = _Change("guard negated", f"`not ({text})` instead of `{text}`", text.span, owner)
    yield negated, replace(transition, guard=text.with_value(f"not ({text})"))


@telling
def _retargeted(target: str, other: str) -> str:
    return f"to `{other}` instead of `{target}`"


@telling
def _shown(transition: doc.DocTransition) -> str:
    """Return a transition in a few words."""
    names = " ".join(str(event) for event in transition.events)
    trigger = names or (f"{transition.trigger.value} {transition.delay or ''}".strip())
    condition = "" if transition.guard is None else f" [{transition.guard}]"
    targets = " ".join(str(target) for target in transition.targets)
    return f"`{trigger}{condition} -> {targets or '(stays)'}`"


def _siblings(documents: Documents) -> dict[str, list[str]]:
    """Return for each state its siblings, as far as one document has them together."""
    found: dict[str, list[str]] = {}
    for document in documents:
        for parent in states(document.root, *document.refine):
            if parent.kind is doc.Kind.PARALLEL:
                continue
            names = [
                child.id.value
                for child in parent.children
                if child.id is not None and child.kind not in doc.HISTORIES and not child.abstract
            ]
            for name in names:
                known = found.setdefault(name, [])
                known += [other for other in names if other != name and other not in known]
    return found


# --- content --------------------------------------------------------------------------------------


def _of_block(block: Block) -> Iterator[Variant]:
    """Yield a handler with one statement omitted, or two neighbours exchanged."""
    for place, statement in enumerate(block):
        is_super = isinstance(statement, Super)
        operator = "super dropped" if is_super else "action dropped"
        change = _Change(operator, "`super`" if is_super else _line(statement), statement.span)
        yield change, (*block[:place], *block[place + 1 :])
        for inner, changed in _of_statement(statement):
            yield inner, (*block[:place], changed, *block[place + 1 :])
    for place, (first, second) in enumerate(pairwise(block)):
        if first != second:
            change = _Change("actions swapped", _line(second), first.span)
            yield change, (*block[:place], second, first, *block[place + 2 :])


def _of_statement(statement: WrittenStatement) -> Iterator[Variant]:
    match statement:
        case If():
            for place, branch in enumerate(statement.branches):
                for change, body in _of_block(branch.body):
                    branches = list(statement.branches)
                    branches[place] = replace(branch, body=body)
                    yield change, replace(statement, branches=tuple(branches))
        case ForEach():
            for change, body in _of_block(statement.body):
                yield change, replace(statement, body=body)
        case _:
            pass


@telling
def _line(statement: WrittenStatement) -> str:
    """Return the first line of the source of a statement."""
    source = statement.span.source.text[statement.span.start : statement.span.end]
    lines = source.strip().splitlines() or [""]
    return f"`{lines[0]}`"


# --- unhandled events -----------------------------------------------------------------------------


def _unhandled_event(documents: Documents, chart: Chart) -> Iterator[Mutation]:
    """Yield the chart in which one leaf ignores an event that an ancestor handles."""
    own = {each.id.value for each in states(documents[0].root) if each.id is not None}
    for leaf in chart.states:
        if not leaf.is_leaf or leaf.kind is not doc.Kind.ATOMIC:
            continue
        answered = {e for t in leaf.transitions for e in chart.transitions[t].events}
        for ancestor in chart.ancestors(leaf.index):
            for number in chart.states[ancestor].transitions:
                transition = chart.transitions[number]
                for event in transition.events:
                    name = chart.events[event].name
                    if event in answered or name.startswith(("error.", "done.")):
                        continue
                    answered.add(event)
                    deaf = doc.DocTransition(
                        doc.Trigger.EVENT,
                        transition.span,
                        events=(Text(name, transition.span),),
                        content=(),
                        ordered=True,
                    )
                    whole = (_with(documents[0], leaf.id, deaf, is_own=leaf.id in own),)
                    what = f"`{leaf.id}` does not answer `{name}`"
                    all_ = (*whole, *documents[1:])
                    yield Mutation(UNHEARD, what, leaf.span, all_, leaf.span)


def _with(
    document: doc.Document, leaf: str, deaf: doc.DocTransition, *, is_own: bool
) -> doc.Document:
    """Return a document in which a state has one more transition, before its own ones."""

    def changed(state: doc.DocState) -> doc.DocState:
        if state.id is not None and state.id.value == leaf:
            return replace(state, transitions=(deaf, *state.transitions))
        return replace(state, children=tuple(changed(child) for child in state.children))

    if is_own:
        return replace(document, root=changed(document.root))
    deaf = replace(deaf, first=True)
    refine = tuple(changed(state) for state in document.refine)
    if refine != document.refine:
        return replace(document, refine=refine)
    added = doc.DocState(Text(leaf, deaf.span), doc.Kind.ATOMIC, deaf.span, transitions=(deaf,))
    return replace(document, refine=(*document.refine, added))
