"""Properties as events that happen where they are violated, and what is asserted of these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from fsmkit.diagnostics import FsmkitError
from fsmkit.verify.export.cspm.spelling import Names
from fsmkit.verify.export.formula import (
    Formula,
    In,
    QueueEmpty,
    cases,
    condition_of,
    deadlock,
    positive,
    simplified,
)
from fsmkit.verify.export.network import Network
from fsmkit.verify.system import JUDGED_AT_STATES, Property, PropertyKind

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
        return self.of.kind is PropertyKind.LIVELOCK_FREE

    @property
    def is_carried(self) -> bool:
        """Whether events of it are in the model."""
        return not self.missing and not self.is_livelock


def asserted(network: Network, names: Names) -> tuple[Asserted, ...]:
    """Return what the properties of a system assert."""
    return tuple(
        _asserted(network, names.new(property_.name), property_)
        for property_ in network.closed.system.properties
    )


def _asserted(network: Network, name: str, property_: Property) -> Asserted:
    kind = property_.kind
    if property_.unexplored:
        return Asserted(name, property_, missing=property_.unexplored)
    if kind is PropertyKind.LIVELOCK_FREE:
        return Asserted(name, property_)
    if kind is PropertyKind.LEADS_TO:
        why = "it asks of fair runs what comes some time, which no refusal tells"
        return Asserted(name, property_, missing=why)
    if kind is not PropertyKind.DEADLOCK_FREE and kind not in JUDGED_AT_STATES:
        return Asserted(name, property_, missing=f"`{kind.value}` is not a set of traces")
    try:
        condition = (
            deadlock(network)
            if kind is PropertyKind.DEADLOCK_FREE
            else condition_of(network, property_)
        )
    except FsmkitError as error:
        return Asserted(name, property_, missing=error.diagnostics[0].message)
    bad = simplified(positive(network, condition, negated=kind is PropertyKind.INVARIANT))
    found = list(islice(_cases(network, bad), MOST_CASES + 1))
    if len(found) > MOST_CASES:
        return Asserted(name, property_, missing=f"it has more than {MOST_CASES:,} cases")
    distinct = tuple(dict.fromkeys(found))
    return Asserted(name, property_, distinct, wanted=kind is PropertyKind.REACHABLE)


def _cases(network: Network, bad: Formula) -> Iterator[Case]:
    for tests in cases(bad):
        locals_: dict[int, frozenset[int]] = {}
        empty = set()
        for test in tests:
            match test:
                case In(machine, numbers):
                    locals_[machine] = locals_.get(machine, numbers) & numbers
                case QueueEmpty(machine):
                    empty.add(machine)
                case _:
                    raise AssertionError("a case holds tests only")
        if not locals_ and not empty:
            locals_[0] = frozenset(range(len(network.automata[0].locals)))
        if all(locals_.values()):
            yield Case(tuple(sorted(locals_.items())), frozenset(empty))
