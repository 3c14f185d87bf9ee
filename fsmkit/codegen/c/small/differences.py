"""What several copies of a chart do, compared as typed trees: equal but for what belongs to a copy.

`unified` goes through the trees of all copies together. Where they differ in the name or the number
of something that each copy has of its own, that is noted; the tree of the first copy then stands
for all, once it is printed with names that know the notes (`small.together`). Any other
difference ends the comparison: such trees are not alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum, auto
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Cancel, Destination, Invoke, Log, Raise, Send
from fsmkit.document.document import Kind as StateKind
from fsmkit.language import (
    Call,
    CallFunction,
    Decided,
    EventField,
    EventName,
    InState,
    IntType,
    Literal,
    Storage,
    Variable,
    Watched,
)


class Unlike(Exception):  # noqa: N818  (an outcome, which no host sees)
    """Copies cannot have one body."""


class Leaf(Enum):
    """What a leaf of a tree names."""

    STATE = auto()
    EVENT = auto()
    SENT = auto()
    """An event that leaves the machine: the host has a function for each."""
    TIMER = auto()
    VARIABLE = auto()
    LOCAL = auto()
    OPERATION = auto()
    FUNCTION = auto()
    TEXT = auto()
    """A label, which only a trace shows."""
    MARK = auto()
    """The id of a delayed send."""
    TAKEN = auto()
    """A transition that is taken by its number."""


@dataclass(frozen=True, slots=True)
class Timer:
    """The timer of a transition, which is armed with a delay or disarmed."""

    transition: int
    delay: int | None


@dataclass(frozen=True, slots=True)
class Ended:
    """What a final state raises: the event of its parent, and of that of a parallel state."""

    event: int | None
    data: tuple[Any, ...]
    above: int | None
    finals: tuple[Any, ...]
    """What is asked before the second is raised: `Within`, nested as the states are."""


@dataclass(frozen=True, slots=True)
class Within:
    """A state of which is asked whether it is active."""

    state: int


@dataclass(frozen=True, slots=True)
class At:
    """Content, or a guard, with the events that can be at hand; ``what`` and ``of`` it is."""

    events: tuple[int, ...]
    content: Any
    what: str = field(compare=False)
    of: int = field(default=0, compare=False)
    """The transition."""


@dataclass(frozen=True, slots=True)
class Handlers:
    """What is done when a state is entered or left."""

    timers: tuple[Timer, ...]
    blocks: tuple[At, ...]
    ended: Ended | None
    is_entry: bool
    state: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Fired:
    """What is done when the time of a transition has come."""

    transition: int
    armed: Timer | None
    """It is armed again."""
    guard: At | None


Noted = tuple[Leaf, object]
Values = tuple[Any, ...]


@dataclass
class Differences:
    """By what something is in the first copy: what it is in each."""

    chart: Chart
    notes: dict[Noted, Values] = field(default_factory=dict)
    numbers: dict[str, Values] = field(default_factory=dict)
    """Integers that differ, by the name of the variable that stands for them in the tree."""
    is_open: bool = False
    """Whether any event may be at hand where the comparison is."""

    @property
    def varying(self) -> Mapping[Noted, Values]:
        """Those that are not the same in all copies."""
        return {key: values for key, values in self.notes.items() if len(set(values)) > 1}

    def note(self, leaf: Leaf, values: Values) -> None:
        """Note what a leaf is in each copy; the same thing cannot be two things in another."""
        if None in values:
            if any(value is not None for value in values):
                raise Unlike
            return
        if self.notes.setdefault((leaf, values[0]), values) != values:
            raise Unlike


def unified(chart: Chart, trees: Sequence[object]) -> tuple[Any, Differences]:
    """Return the tree that stands for those of all copies, and what differs in it.

    Raises:
        Unlike: They differ in anything else.

    """
    found = Differences(chart)
    return _unified(tuple(trees), found), found


def _unified(trees: Values, found: Differences) -> Any:
    first = trees[0]
    if any(type(tree) is not type(first) for tree in trees):
        raise Unlike
    if isinstance(first, tuple):
        if any(len(tree) != len(first) for tree in trees):
            raise Unlike
        return tuple(_unified(parts, found) for parts in zip(*trees, strict=True))
    if isinstance(first, Literal):
        return _literal(trees, found)
    if not is_dataclass(first):
        if any(tree != first for tree in trees):
            raise Unlike
        return first
    leaves = _LEAVES.get(type(first), {})
    _require(trees, found)
    changed = {}
    for part in fields(first):
        if not part.compare:
            continue
        values = tuple(getattr(tree, part.name) for tree in trees)
        if part.name in leaves:
            leaves[part.name](values, first, found)
            continue
        whole = _unified(values, found)
        if whole != values[0]:
            changed[part.name] = whole
    whole_type: Any = first
    return replace(whole_type, **changed) if changed else first


def _literal(trees: Values, found: Differences) -> Any:
    """Return a constant: the same in all, or an integer for which a variable stands."""
    first: Literal = trees[0]
    if all(tree.value == first.value and tree.type == first.type for tree in trees):
        return first
    types = [tree.type for tree in trees]
    if not all(isinstance(type_, IntType) for type_ in types):
        raise Unlike
    values = tuple(tree.value for tree in trees)
    if any(value < 0 for value in values):
        raise Unlike
    name = f"number {len(found.numbers)}"
    found.numbers[name] = values
    type_ = IntType(min(values), max(values), first.type.overflow)  # type: ignore[union-attr]
    return Variable(name, type_, Storage.LOCAL, first.span)


def _require(trees: Values, found: Differences) -> None:
    """End the comparison at what is printed by other means than names."""
    first = trees[0]
    if isinstance(first, Invoke | Decided | Watched):
        raise Unlike
    if isinstance(first, EventName):  # the texts of all events that can be at hand
        raise Unlike
    if isinstance(first, EventField) and found.is_open:
        raise Unlike
    if isinstance(first, At):
        found.is_open = not first.events


Noting = Callable[[Values, object, Differences], None]
"""Notes the values of a field; it also gets the first of the trees that have it."""


def _noting(*leaves: Leaf) -> Noting:
    def note(values: Values, _: object, found: Differences) -> None:
        for leaf in leaves:
            found.note(leaf, values)

    return note


def _event(values: Values, _: object, found: Differences) -> None:
    """Note an event; where it carries anything, its payloads lie alike."""
    known = [None if event is None else found.chart.events[event].fields for event in values]
    if any(each != known[0] for each in known):
        raise Unlike
    found.note(Leaf.EVENT, values)


def _sent(values: Values, first: object, found: Differences) -> None:
    _event(values, first, found)
    if isinstance(first, Send) and first.destination is Destination.PORT:
        found.note(Leaf.SENT, values)


def _events(values: Values, first: object, found: Differences) -> None:
    if len({len(events) for events in values}) > 1:
        raise Unlike
    for each in zip(*values, strict=True):
        _event(each, first, found)


def _variable(values: Values, first: object, found: Differences) -> None:
    is_local = isinstance(first, Variable) and first.storage is Storage.LOCAL
    found.note(Leaf.LOCAL if is_local else Leaf.VARIABLE, values)


def _function(values: Values, _: object, found: Differences) -> None:
    """Note a function of the chart: what calls have to know of it is the same in all copies."""
    shapes = [([p.type for p in f.parameters], f.result) for f in values]
    if any(shape != shapes[0] for shape in shapes):
        raise Unlike
    found.note(Leaf.FUNCTION, tuple(function.name for function in values))


def _ignored(_: Values, __: object, ___: Differences) -> None:
    """Let differ what is not printed: it says again what another field says."""


_LEAVES: Mapping[type, Mapping[str, Noting]] = {
    InState: {"state": _noting(Leaf.STATE), "id": _ignored},
    Variable: {"name": _variable},
    Call: {"operation": _noting(Leaf.OPERATION)},
    CallFunction: {"function": _function, "reads": _ignored},
    Raise: {"event": _event},
    Send: {"event": _sent, "id": _noting(Leaf.MARK)},
    Cancel: {"id": _noting(Leaf.MARK, Leaf.TEXT)},
    Log: {"label": _noting(Leaf.TEXT)},
    Timer: {"transition": _noting(Leaf.TIMER)},
    Fired: {"transition": _noting(Leaf.TAKEN)},
    Within: {"state": _noting(Leaf.STATE)},
    Ended: {"event": _event, "above": _event},
    At: {"events": _events},
}
"""By type and field: how the leaf is noted. All other fields are compared."""


def handlers(chart: Chart, is_entry: bool, state: int) -> Handlers | None:
    """Return what is done when a state is entered or left; None if it invokes anything."""
    own = chart.states[state]
    if own.invokes or any(invocation.state == state for invocation in chart.invocations):
        return None
    timed = (chart.transitions[t] for t in own.transitions)
    timers = tuple(Timer(t.index, t.delay if is_entry else None) for t in timed if t.has_timer)
    what = f"{'entry' if is_entry else 'exit'} of {own.id}, and of the same in each copy"
    blocks = own.on_entry if is_entry else own.on_exit
    ended = _ended(chart, state) if is_entry and own.kind is StateKind.FINAL else None
    return Handlers(timers, tuple(At((), block, what) for block in blocks), ended, is_entry, state)


def _ended(chart: Chart, state: int) -> Ended:
    """Return what a final state within another raises (SCXML 3.7)."""
    parent = chart.states[state].parent or 0
    above = chart.states[parent].parent
    event, second = chart.event_index.get(f"done.state.{chart.states[parent].id}"), None
    if above is not None and chart.states[above].kind is StateKind.PARALLEL:
        second = chart.event_index.get(f"done.state.{chart.states[above].id}")
    finals = () if second is None else _finals(chart, above or 0)
    return Ended(event, chart.states[state].done_data, second, finals)


def _finals(chart: Chart, state: int) -> tuple[Any, ...]:
    own = [chart.states[c] for c in chart.states[state].children]
    if chart.states[state].kind is StateKind.PARALLEL:
        return tuple(_finals(chart, child.index) for child in own if not child.is_history)
    return tuple(Within(child.index) for child in own if child.kind is StateKind.FINAL)
