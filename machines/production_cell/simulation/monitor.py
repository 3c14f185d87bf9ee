"""The properties of ring.yaml, judged on a recorded run: what is proved must hold of it too.

Judged are the properties of single states and `leads_to`, from when the cell first stands by: the
explored plant starts with its axes at home, the simulated one anywhere. A run cannot show that
there is no deadlock, and what it did not record stays open; the reason is reported.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import fsmkit
from fsmkit.language import ContentError, Expr, Value, evaluate
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.kinds import leads_to
from fsmkit.system.properties.property import AtStates, Property
from fsmkit.system.system import System

from .observed import Observed, Truth
from .recording import Recording

CELL = Path(__file__).resolve().parents[1]
RING, BY_POSITION = CELL / "ring.yaml", CELL / "ring_by_position.yaml"
OF_FAULTS = {"P9", "P9_count", "P9_faults", "P9_lost", "B1", "Q2"}
"""Those that a fault may break; that none occurs is assumed where they are proved."""


@dataclass(frozen=True)
class Judged:
    """The verdict of a run on a property. ``holds`` is None if it shows nothing; times in s."""

    name: str
    text: str
    holds: bool | None
    time: float | None = None
    """The time of the first violation, or of first reaching the goal."""
    reason: str = ""
    """Why the run shows nothing."""


class _Row:
    """The values of one state, for conditions."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self._values = values

    def variable(self, name: str) -> Value:
        """Return the value of an atom."""
        return self._values[name]

    def event_field(self, name: str) -> Value:
        """Reject a field, since there is no current event."""
        raise ContentError(f"there is no event whose `{name}` could be read")

    def event_name(self) -> str:
        """Return the empty name: there is no current event."""
        return ""

    def event_type(self) -> str:
        """Return the empty type: there is no current event."""
        return ""

    def is_in(self, state: int) -> bool:
        """Reject the query: all states are atoms."""
        raise ContentError(f"state {state} of no machine")

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Reject the call: a property calls nothing."""
        raise ContentError(f"a property cannot call `{operation}` with {len(arguments)} values")

    def range_error(self) -> None:
        """Pass over saturation."""


def judge(
    recording: Recording,
    events: Sequence[Mapping[str, object]],
    path: Path = RING,
    homed: int | None = None,
) -> tuple[Judged, ...]:
    """Return the verdicts of a recording on the properties of a system file.

    ``events``: the plant's reports. ``homed``: the first judged row, if it is not the first in
    which the cell stands by. Raises `FsmkitError` if the file cannot be read.
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
    """Return what the rows from `homed` on show of a property."""
    name, text = property_.name, property_.text
    is_answered = property_.kind is leads_to.KIND
    condition, goal = property_.condition, property_.goal
    if condition is None or not (is_answered or isinstance(property_.kind.decided, AtStates)):
        return Judged(name, text, None, reason="a run cannot show it")
    try:
        marks = _truth(condition, property_.atoms, observed, homed)
        met = None if goal is None else _truth(goal.expression, goal.atoms, observed, homed)
    except LookupError as error:
        return Judged(name, text, None, reason=f"{error.args[0]} is not recorded")
    if not len(marks):
        return Judged(name, text, None, reason="the cell never stood by")
    if met is not None:
        is_open = bool((marks & ~met)[_rows_to_last(met) :].any())
        reason = "it is open when the run ends" if is_open else ""
        return Judged(name, text, None if is_open else True, reason=reason)
    found = np.flatnonzero(marks != property_.is_negated)
    first = (homed + int(found[0]) + 1) / 1000 if len(found) else None
    return Judged(name, text, bool(len(found)) is property_.is_existential, first)


def _rows_to_last(met: Truth) -> int:
    """Return the number of rows up to the last one that is true."""
    found = np.flatnonzero(met)
    return int(found[-1]) + 1 if len(found) else 0


def _truth(
    condition: Expr, atoms: Sequence[tuple[str, Atom]], observed: Observed, first: int
) -> Truth:
    """Return where a condition holds, from a row on. Raises `LookupError` for what is missing."""
    table = np.stack([observed.recorded(atom)[first:] for _, atom in atoms], axis=1)
    if not len(table):
        return np.zeros(0, np.bool_)
    # a row that equals the one before need not be evaluated
    fresh = np.concatenate(([0], np.flatnonzero((table[1:] != table[:-1]).any(axis=1)) + 1))
    distinct, numbers = np.unique(table[fresh], axis=0, return_inverse=True)
    names = [name for name, _ in atoms]
    verdicts = [
        bool(evaluate(condition, _Row(dict(zip(names, values, strict=True)))))
        for values in distinct.tolist()
    ]
    lengths = np.diff(np.append(fresh, len(table)))
    return np.repeat(np.array(verdicts, np.bool_)[numbers.reshape(-1)], lengths)
