"""Comparison of copies of a used chart as typed trees: equal but for the names of each copy.

`unified` walks the trees of all copies together. Where each copy has a name or a number of its own,
it notes them. The tree of the first copy is then printed for all, with names that know the notes
(`small.copy_names`). Any other difference ends the comparison. The Plan's instances alone are not
enough: arguments of a use (`with`, `bind`) are folded into constants, which only the trees have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum, auto
from itertools import chain
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.chart.statements import Cancel, Destination, Invoke, Log, Raise, Send
from fsmkit.language import (
    Call,
    CallFunction,
    CoveredCondition,
    CoveredGuard,
    EventField,
    EventName,
    InState,
    IntType,
    Literal,
    Storage,
    Variable,
)
from fsmkit.plan import Plan
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    DropInvoke,
    EndInvoked,
    Forget,
    IfFinal,
    RaiseDone,
    Run,
    WantInvoke,
)


class NotMergeable(Exception):  # noqa: N818  (an outcome, which no host sees)
    """Copies that cannot share one body."""


class Leaf(Enum):
    """The kind of thing that a leaf of a tree names."""

    STATE = auto()
    EVENT = auto()
    SENT = auto()
    """An event that is sent to the host, which has a function for each."""
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
class ContentInContext:
    """Content or a guard with the events that can be current; ``what`` is a comment."""

    events: tuple[int, ...]
    content: Any
    what: str = field(compare=False)
    transition: int = field(default=0, compare=False)
    """The index of the transition."""


@dataclass(frozen=True, slots=True)
class StateActions:
    """The actions of entering or exiting a state; ``what`` is a comment."""

    actions: tuple[Action, ...]
    what: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class TimeoutBody:
    """The body of a timeout."""

    transition: int
    armed: Arm | None
    """The timer is armed again."""
    guard: ContentInContext | None


HostNote = tuple[Leaf, object]
Values = tuple[Any, ...]


@dataclass
class Differences:
    """The names and numbers of all copies, by those of the first."""

    chart: Chart
    notes: dict[HostNote, Values] = field(default_factory=dict)
    numbers: dict[str, Values] = field(default_factory=dict)
    """Integers that differ, by the name of the variable that represents them in the tree."""
    is_open: bool = False
    """Whether any event may be current in the compared subtree."""

    @property
    def varying(self) -> Mapping[HostNote, Values]:
        """The leaves that differ between copies."""
        return {key: values for key, values in self.notes.items() if len(set(values)) > 1}

    def note(self, leaf: Leaf, values: Values) -> None:
        """Record a leaf in each copy; equal leaves must map to equal leaves."""
        if None in values:
            if any(value is not None for value in values):
                raise NotMergeable
            return
        if self.notes.setdefault((leaf, values[0]), values) != values:
            raise NotMergeable


def unified(chart: Chart, trees: Sequence[object]) -> tuple[Any, Differences]:
    """Return the tree that represents those of all copies, and what differs in it.

    Raises:
        NotMergeable: They differ in anything else.

    """
    found = Differences(chart)
    return _unified(tuple(trees), found), found


def _unified(trees: Values, found: Differences) -> Any:
    first = trees[0]
    if any(type(tree) is not type(first) for tree in trees):
        raise NotMergeable
    if isinstance(first, tuple):
        if any(len(tree) != len(first) for tree in trees):
            raise NotMergeable
        return tuple(_unified(parts, found) for parts in zip(*trees, strict=True))
    if isinstance(first, Literal):
        return _literal(trees, found)
    if not is_dataclass(first):
        if any(tree != first for tree in trees):
            raise NotMergeable
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
    """Return a constant that is equal in all copies, or a variable for integers that differ."""
    first: Literal = trees[0]
    if all(tree.value == first.value and tree.type == first.type for tree in trees):
        return first
    types = [tree.type for tree in trees]
    if not all(isinstance(type_, IntType) for type_ in types):
        raise NotMergeable
    values = tuple(tree.value for tree in trees)
    if any(value < 0 for value in values):
        raise NotMergeable
    name = f"number {len(found.numbers)}"
    found.numbers[name] = values
    type_ = IntType(min(values), max(values), first.type.overflow)  # type: ignore[union-attr]
    return Variable(name, type_, Storage.LOCAL, first.span)


def _require(trees: Values, found: Differences) -> None:
    """End the comparison at items that are not printed through names."""
    first = trees[0]
    if isinstance(
        first, Invoke | CoveredGuard | CoveredCondition | WantInvoke | DropInvoke | EndInvoked
    ):
        raise NotMergeable
    if isinstance(first, EventName):  # the names of all events that can be current
        raise NotMergeable
    if isinstance(first, EventField) and found.is_open:
        raise NotMergeable
    if isinstance(first, ContentInContext | Run):
        found.is_open = isinstance(first, Run) or not first.events


Noting = Callable[[Values, object, Differences], None]
"""Notes the values of a field; it also gets the first of the trees that have it."""


def _noting(*leaves: Leaf) -> Noting:
    def note(values: Values, _: object, found: Differences) -> None:
        for leaf in leaves:
            found.note(leaf, values)

    return note


def _event(values: Values, _: object, found: Differences) -> None:
    """Record an event; events with a payload must have the same layout."""
    known = [None if event is None else found.chart.events[event].fields for event in values]
    if any(each != known[0] for each in known):
        raise NotMergeable
    found.note(Leaf.EVENT, values)


def _sent(values: Values, first: object, found: Differences) -> None:
    _event(values, first, found)
    if isinstance(first, Send) and first.destination is Destination.PORT:
        found.note(Leaf.SENT, values)


def _events(values: Values, first: object, found: Differences) -> None:
    if len({len(events) for events in values}) > 1:
        raise NotMergeable
    for each in zip(*values, strict=True):
        _event(each, first, found)


def _variable(values: Values, first: object, found: Differences) -> None:
    is_local = isinstance(first, Variable) and first.storage is Storage.LOCAL
    found.note(Leaf.LOCAL if is_local else Leaf.VARIABLE, values)


def _function(values: Values, _: object, found: Differences) -> None:
    """Note a function of the chart, whose signature is equal in all copies."""
    shapes = [([p.type for p in f.parameters], f.result) for f in values]
    if any(shape != shapes[0] for shape in shapes):
        raise NotMergeable
    found.note(Leaf.FUNCTION, tuple(function.name for function in values))


def _finals(values: Values, _: object, found: Differences) -> None:
    """Note the final states of a parallel state's regions."""
    if any([*map(len, finals)] != [*map(len, values[0])] for finals in values):
        raise NotMergeable
    for each in zip(*(chain(*finals) for finals in values), strict=True):
        found.note(Leaf.STATE, each)


def _ignored(_: Values, __: object, ___: Differences) -> None:
    """Accept a difference in a field that repeats another one."""


_LEAVES: Mapping[type, Mapping[str, Noting]] = {
    InState: {"state": _noting(Leaf.STATE), "id": _ignored},
    Variable: {"name": _variable},
    Call: {"operation": _noting(Leaf.OPERATION)},
    CallFunction: {"function": _function, "reads": _ignored},
    Raise: {"event": _event},
    Send: {"event": _sent, "id": _noting(Leaf.MARK)},
    Cancel: {"id": _noting(Leaf.MARK, Leaf.TEXT)},
    Log: {"label": _noting(Leaf.TEXT)},
    Arm: {"transition": _noting(Leaf.TIMER)},
    Disarm: {"transition": _noting(Leaf.TIMER)},
    TimeoutBody: {"transition": _noting(Leaf.TAKEN)},
    IfFinal: {"state": _ignored, "finals": _finals},
    RaiseDone: {"event": _event},
    ContentInContext: {"events": _events},
}
"""By type and field: how the leaf is noted. All other fields are compared."""


def state_actions(plan: Plan, state: int, *, is_entry: bool) -> StateActions:
    """Return the actions of entering or exiting a state."""
    verb, actions = ("entry", plan.entering) if is_entry else ("exit", plan.leaving)
    what = f"{verb} of {plan.chart.states[state].id}, and of the same in each copy"
    return StateActions(tuple(a for a in actions[state] if not isinstance(a, Forget)), what)
