"""The properties of ring.yaml, judged on a recorded run: what is proved must hold of it too.

Judged are those that speak of single states, from when the cell first stands by: the explored
plant begins with its axes at home, the simulated one anywhere. That there is no deadlock, no run
can show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import fsmkit
from fsmkit.language import ContentError, Value, evaluate
from fsmkit.system.properties.property import AtStates, Property
from fsmkit.system.system import System

from .observed import Observed
from .recording import Recording

CELL = Path(__file__).resolve().parents[1]
RING, BY_POSITION = CELL / "ring.yaml", CELL / "ring_by_position.yaml"
OF_FAULTS = {"P9", "P9_count", "P9_faults"}
"""Those that a fault may break; that none occurs is assumed where they are proved."""


@dataclass(frozen=True)
class Judged:
    """What a run shows of a property. ``holds`` is None where it shows nothing; times in s."""

    name: str
    text: str
    holds: bool | None
    time: float | None = None
    """Of the first violation, or of the first time that what shall be reached is."""


class _Row:
    """The values of one state, for conditions."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._values = values

    def variable(self, name: str) -> Value:
        """Return the value of an atom."""
        return self._values[name]

    def event_field(self, name: str) -> Value:
        """Tell that there is no event at hand."""
        raise ContentError(f"there is no event whose `{name}` could be read")

    def event_name(self) -> str:
        """Return the empty name: no event is at hand."""
        return ""

    def event_type(self) -> str:
        """Return the empty type: no event is at hand."""
        return ""

    def is_in(self, state: int) -> bool:
        """Tell that all states are atoms."""
        raise ContentError(f"state {state} of no machine")

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Tell that a property calls nothing."""
        raise ContentError(f"a property cannot call `{operation}` with {len(arguments)} values")

    def range_error(self) -> None:
        """Pass over saturation."""


def judge(
    recording: Recording,
    events: Sequence[Mapping[str, object]],
    path: Path = RING,
    homed: int | None = None,
) -> tuple[Judged, ...]:
    """Return what a recording shows of each property of a system file.

    ``events``: what the plant told. ``homed``: the first row that is judged, if another than that
    in which the cell first stands by. Raises `FsmkitError` if the file cannot be read.
    """
    system = read_system(path)
    observed = Observed(system, recording, events)
    first = _first_homed(recording) if homed is None else homed
    return tuple(_judged(p, observed, first) for p in system.properties)


def _first_homed(recording: Recording) -> int:
    """Return the first row in which the cell stands by."""
    standing_by = recording.about["states"]["supervisor"].index("standing_by")
    found = np.flatnonzero(recording["supervisor.state"] == standing_by)
    return int(found[0]) if len(found) else len(recording)


@cache
def read_system(path: Path) -> System:
    """Return the system of a file, read once."""
    return fsmkit.read_system(path)


def _judged(property_: Property, observed: Observed, homed: int) -> Judged:
    """Return what the rows from one on show of a property."""
    condition = property_.condition
    columns = [observed.column(a.machine, a.state, a.variable) for _, a in property_.atoms]
    known = [column[homed:] for column in columns if column is not None]
    by_states = isinstance(property_.kind.decided, AtStates)
    if not by_states or condition is None or len(known) < len(columns):
        return Judged(property_.name, property_.text, None)
    table = np.stack(known, axis=1)
    if not len(table):
        return Judged(property_.name, property_.text, None)
    # only where something differs from the step before is there anything to judge
    fresh = np.concatenate(([0], np.flatnonzero((table[1:] != table[:-1]).any(axis=1)) + 1))
    distinct, places = np.unique(table[fresh], axis=0, return_index=True)
    names = [name for name, _ in property_.atoms]
    marks = []
    for values, place in zip(distinct.tolist(), places.tolist(), strict=True):
        holds = bool(evaluate(condition, _Row(dict(zip(names, values, strict=True)))))
        if holds is not property_.is_negated:
            marks.append(int(fresh[place]))
    first = (homed + min(marks) + 1) / 1000 if marks else None
    is_wanted = property_.is_wanted
    return Judged(property_.name, property_.text, bool(marks) is is_wanted, first)
