"""The properties of a system, judged on a record of its machines: what is proved must hold of it.

Judged are those that speak of single states, and `within`. What a run cannot show, as that a state
can be reached from everywhere, is left open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from fsmkit.language import ContentError, Expr, Value, evaluate
from fsmkit.system.properties.property import Atom, AtStates, Property
from fsmkit.system.system import System

TICK_NS = 1_000_000


@dataclass(frozen=True)
class Row:
    """A machine after a change: the time in ns, its active states, its data and its inputs."""

    at: int
    machine: str
    states: frozenset[int]
    data: Sequence[Value]
    inputs: Sequence[Value]


@dataclass(frozen=True)
class Judged:
    """The verdict of a record. ``holds``: None where it shows nothing; ``at``: seconds into it."""

    name: str
    holds: bool | None
    at: float | None = None


class _Values:
    """The values of the atoms of a condition, as its environment."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._values = values

    def variable(self, name: str) -> Value:
        return self._values[name]

    def _no_event(self, *_: object) -> str:
        raise ContentError("a property of states has no event at hand")

    event_field = event_name = event_type = _no_event

    def is_in(self, state: int) -> bool:
        raise ContentError(f"state {state} of no machine")

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        raise ContentError(f"a property cannot call `{operation}` with {len(arguments)} values")

    def range_error(self) -> None:
        """Pass over saturation."""


def judge(system: System, rows: Sequence[Row]) -> tuple[Judged, ...]:
    """Return the verdicts on the properties of a system; the rows stand by their times."""
    return tuple(_judged(system, property_, rows) for property_ in system.properties)


def _judged(system: System, property_: Property, rows: Sequence[Row]) -> Judged:
    atoms = (*property_.atoms, *(property_.goal.atoms if property_.goal is not None else ()))
    recorded = {row.machine for row in rows}
    is_of_states = isinstance(property_.kind.decided, AtStates)
    machines = {system.machines[atom.machine].name for _, atom in atoms}
    if not (is_of_states or property_.kind.key == "within") or not machines <= recorded:
        return Judged(property_.name, None)
    latest: dict[str, Row] = {}
    since: int | None = None
    begin = rows[0].at
    for at, changed in groupby(rows, key=lambda row: row.at):  # what changed in one cycle
        latest |= {row.machine: row for row in changed}
        if not machines <= set(latest):
            continue
        holds = _holds(system, property_.condition, property_.atoms, latest)
        if is_of_states:
            if holds is not property_.is_negated:
                return Judged(property_.name, property_.is_wanted, (at - begin) / 1e9)
            continue
        if since is not None and at - since > property_.ticks * TICK_NS:
            return Judged(property_.name, holds=False, at=(since - begin) / 1e9)
        if property_.goal and _holds(
            system, property_.goal.expression, property_.goal.atoms, latest
        ):
            since = None
        elif holds and since is None:
            since = at
    return Judged(property_.name, holds=not property_.is_wanted)


def _holds(
    system: System,
    condition: Expr | None,
    atoms: Sequence[tuple[str, Atom]],
    latest: Mapping[str, Row],
) -> bool:
    values = {name: _value(system, atom, latest) for name, atom in atoms}
    return condition is None or bool(evaluate(condition, _Values(values)))


def _value(system: System, atom: Atom, latest: Mapping[str, Row]) -> Value:
    machine = system.machines[atom.machine]
    row = latest[machine.name]
    if atom.state is not None:
        return atom.state in row.states
    inputs = [each.name for each in machine.chart.inputs]
    if atom.variable in inputs:
        return row.inputs[inputs.index(atom.variable)]
    names = [each.name for each in (*machine.chart.data, *machine.chart.outputs)]
    return row.data[names.index(atom.variable)]
