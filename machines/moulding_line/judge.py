"""The properties of a system, judged on a record of its machines: what is proved must hold of it.

Judged are those that speak of single states, and `within`. What a run cannot show, as that a state
can be reached from everywhere, is left open. Conditions are evaluated by the reference engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from fsmkit.language import Value
from fsmkit.runtime.interpreter.macrostep import initial
from fsmkit.system.properties.property import AtStates, Property
from fsmkit.system.system import System
from fsmkit.verify.engines.python.evaluate import evaluate_property
from fsmkit.verify.statespace.closed_system import ClosedSystem, close

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


def judge(system: System, rows: Sequence[Row]) -> tuple[Judged, ...]:
    """Return the verdicts on the properties of a system; the rows stand by their times."""
    closed = close(system)
    return tuple(_judged(closed, property_, rows) for property_ in system.properties)


def _judged(closed: ClosedSystem, property_: Property, rows: Sequence[Row]) -> Judged:
    goal = property_.goal
    atoms = (*property_.atoms, *(() if goal is None else goal.atoms))
    names = [machine.name for machine in closed.system.machines]
    needed = {names[atom.machine] for _, atom in atoms}
    is_of_states = isinstance(property_.kind.decided, AtStates)
    recorded = {row.machine for row in rows}
    if not (is_of_states or property_.kind.key == "within") or not needed <= recorded:
        return Judged(property_.name, None)
    ended = None
    if goal is not None:
        ended = replace(property_, condition=goal.expression, atoms=goal.atoms)
    snapshots = [initial(chart) for chart in closed.charts]
    heard: set[str] = set()
    since: int | None = None
    begin = rows[0].at
    for at, changed in groupby(rows, key=lambda row: row.at):  # what changed in one cycle
        for row in (row for row in changed if row.machine in names):
            heard.add(row.machine)
            place = names.index(row.machine)
            snapshots[place] = replace(
                snapshots[place],
                configuration=row.states,
                data=tuple(row.data),
                inputs=tuple(row.inputs),
            )
        if not needed <= heard:
            continue
        now = tuple(snapshots)
        is_marked = evaluate_property(closed.charts, property_, now)
        if is_of_states and is_marked:
            return Judged(property_.name, property_.is_existential, (at - begin) / 1e9)
        if ended is None:
            continue
        if since is not None and at - since > property_.ticks * TICK_NS:
            return Judged(property_.name, holds=False, at=(since - begin) / 1e9)
        if evaluate_property(closed.charts, ended, now):
            since = None
        elif is_marked and since is None:
            since = at
    return Judged(property_.name, holds=not property_.is_existential)
