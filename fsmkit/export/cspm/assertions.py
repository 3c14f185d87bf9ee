"""Properties as events that happen where they are violated, and what is asserted of these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import assert_never

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.export.cspm.identifiers import Names
from fsmkit.export.exporter import leave_out
from fsmkit.export.formula import (
    All,
    Any,
    Constant,
    Formula,
    In,
    Not,
    QueueEmpty,
    condition_of,
    deadlock,
    positive,
    simplified,
)
from fsmkit.export.network import Network
from fsmkit.system.properties.property import AtStates, Builtin, OverGraph, Property

MOST_CASES = 2048
"""Combinations in which one property can be violated; with more, it is not carried over."""


@dataclass(frozen=True, slots=True)
class Case:
    """A combination of local states, by machine, and the machines whose queues must be empty."""

    locals: tuple[tuple[int, frozenset[int]], ...]
    empty: frozenset[int]


@dataclass(frozen=True, slots=True)
class Asserted:
    """A property. ``name`` is that of its event; ``cases`` tells where that can happen.

    ``wanted``: it shall happen. ``missing``: why it is not carried over.
    """

    name: str
    of: Property
    cases: tuple[Case, ...] = ()
    wanted: bool = False
    missing: str = ""

    @property
    def is_livelock(self) -> bool:
        """Whether this is asserted by itself, without events."""
        return self.of.kind.decided is Builtin.LIVELOCK

    @property
    def is_carried(self) -> bool:
        """Whether events of it are in the model."""
        return not self.missing and not self.is_livelock


def asserted(
    network: Network, names: Names, findings: Findings | None = None
) -> tuple[Asserted, ...]:
    """Return what the properties of a system assert."""
    properties = network.closed.system.properties
    found = tuple(_asserted(network, names.new(one.name), one) for one in properties)
    for one in found:
        if one.missing:
            leave_out(one.of, one.missing, findings)
    return found


def _asserted(network: Network, name: str, property_: Property) -> Asserted:
    decided = property_.kind.decided
    if decided is Builtin.LIVELOCK:
        return Asserted(name, property_)
    if isinstance(decided, OverGraph) and decided.is_fair:
        why = "it asks of fair runs what comes some time, which no refusal tells"
        return Asserted(name, property_, missing=why)
    if decided is not Builtin.DEADLOCK and not isinstance(decided, AtStates):
        why = f"`{property_.kind.key}` is not a set of traces"
        return Asserted(name, property_, missing=why)
    try:
        condition = (
            deadlock(network) if decided is Builtin.DEADLOCK else condition_of(network, property_)
        )
    except FsmkitError as error:
        return Asserted(name, property_, missing=error.diagnostics[0].message)
    bad = simplified(positive(network, condition, negated=property_.is_negated))
    distinct = _cases(bad)
    if distinct is None:
        return Asserted(name, property_, missing=f"it has more than {MOST_CASES:,} cases")
    if Case((), frozenset()) in distinct:
        always = frozenset(range(len(network.automata[0].locals)))
        distinct = (Case(((0, always),), frozenset()),)
    return Asserted(name, property_, distinct, wanted=property_.is_wanted)


def _cases(formula: Formula) -> tuple[Case, ...] | None:
    """Return the cases of a formula, each possible (its DNF); None if there are too many."""
    match formula:
        case Constant(value):
            return (Case((), frozenset()),) if value else ()
        case In(machine, numbers):
            return (Case(((machine, numbers),), frozenset()),) if numbers else ()
        case QueueEmpty(machine):
            return (Case((), frozenset({machine})),)
        case Any(parts):
            return _joined(parts, lambda found, other: (*found, *other), ())
        case All(parts):
            return _joined(parts, _both, (Case((), frozenset()),))
        case Not():
            raise AssertionError("negations are within tests")
        case _:
            assert_never(formula)


def _joined(
    parts: tuple[Formula, ...],
    join: Callable[[tuple[Case, ...], tuple[Case, ...]], Iterable[Case]],
    found: tuple[Case, ...],
) -> tuple[Case, ...] | None:
    for part in parts:
        other = _cases(part)
        if other is None:
            return None
        found = tuple(dict.fromkeys(join(found, other)))
        if len(found) > MOST_CASES:
            return None
    return found


def _both(one: tuple[Case, ...], other: tuple[Case, ...]) -> Iterator[Case]:
    """Yield the cases in which one of each holds, if that is possible."""
    for left, right in product(one, other):
        locals_ = dict(left.locals)
        for machine, numbers in right.locals:
            locals_[machine] = locals_.get(machine, numbers) & numbers
        if all(locals_.values()):
            yield Case(tuple(sorted(locals_.items())), left.empty | right.empty)
