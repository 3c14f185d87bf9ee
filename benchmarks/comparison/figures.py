"""The measured values, and their ratios to limits and goals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeVar

LIMIT = "by hand"
FSMKIT = "fsmkit"


@dataclass(frozen=True, slots=True)
class Aim:
    """The most that generated C may take on a chart."""

    instructions: float
    """An event, gcc -O2 on x86-64."""
    code: int
    """Bytes, Cortex-M0 -Os, machine only."""
    ram: int
    """Bytes beside the user's variables."""
    python: float = 0.7
    """At least this part of the events a second of match/case by hand."""


AIMS = {"A": Aim(17, 400, 4), "B": Aim(25, 650, 4), "C": Aim(38, 2200, 8)}


@dataclass(frozen=True, slots=True)
class Machine:
    """The figures of one machine in C; None for missing measurements."""

    chart: str
    name: str
    kind: str
    """`LIMIT` or `FSMKIT`."""
    is_correct: bool
    """The digests of variables, counters and path are the model's."""
    is_ordered: bool | None
    """Entries and exits come in the order of SCXML; None if the machine did not show it."""
    instructions: float | None = None
    """An event, with the return and without the loop."""
    code_m0: int | None = None
    code_x64: int | None = None
    ram_m0: int | None = None
    ram_x64: int | None = None


@dataclass(frozen=True, slots=True)
class Price:
    """The cost of a part: a machine with it compared to one without it."""

    chart: str
    name: str
    part: str
    code_m0: int | None = None
    code_x64: int | None = None
    ram_m0: int | None = None
    instructions: float | None = None
    """An event."""


@dataclass(frozen=True, slots=True)
class Speed:
    """Events a second in Python."""

    chart: str
    name: str
    kind: str
    """`LIMIT`, `FSMKIT`, or the name of a package."""
    events: int
    """In one run."""
    events_per_second: float
    """The median of all runs; the machine's load is in it."""
    ratio: float | None
    """To the machine by hand, the median over rounds in which both ran."""
    is_correct: bool
    note: str = ""


@dataclass(slots=True)
class Results:
    """All of one run."""

    date: str
    machine: str
    tools: dict[str, str]
    machines: list[Machine] = field(default_factory=list)
    prices: list[Price] = field(default_factory=list)
    speeds: list[Speed] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """Skipped measurements, with the reason."""

    @property
    def is_correct(self) -> bool:
        """Whether every machine did the work of the model."""
        verdicts = [machine.is_correct for machine in self.machines]
        return all(verdicts + [speed.is_correct for speed in self.speeds])


def limit(machines: Iterable[Machine], chart: str, figure: str) -> float | None:
    """Return the least that a correct hand-written machine takes, in the order of SCXML."""
    found = [
        getattr(machine, figure) for machine in machines
        if machine.chart == chart and machine.kind == LIMIT
        and machine.is_correct and machine.is_ordered
    ]  # fmt: skip
    known = [float(value) for value in found if value is not None]
    return min(known) if known else None


def ratio(value: float | None, base: float | None) -> float | None:
    """Return how many times the base a value is; None where either is missing or the base is 0."""
    return None if value is None or not base else value / base


Number = TypeVar("Number", int, float)


def less(value: Number | None, other: Number | None) -> Number | None:
    """Return a difference; None where either is missing."""
    return None if value is None or other is None else value - other


def per_event(once: int, twice: int, loop: int, count: int) -> float:
    """Return the instructions per event, from runs of ``count`` and twice as many events.

    ``loop`` is the same difference for a machine that only returns; its return is not subtracted.
    """
    return (twice - once - loop) / count + 1
