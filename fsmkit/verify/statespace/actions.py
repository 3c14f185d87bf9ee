"""The vocabulary of steps: actions, outcomes, messages, choices (see `closed_system`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Macrostep, Occurrence, Snapshot

FULL, FAULT, UNHANDLED = 0, 1, 2
"""Notes of a step of a machine; from the last on, one for each event that was not answered."""


def transition_note(chart: Chart, transition: int) -> int:
    """Return the note of a taken transition, for a suite of tests."""
    return UNHANDLED + 2 * len(chart.events) + transition


def state_note(chart: Chart, state: int) -> int:
    """Return the note of an entered state, for a suite of tests."""
    return UNHANDLED + 2 * len(chart.events) + len(chart.transitions) + state


MOST_RUNS = 1 << 16
"""Sequences of choices tried for one step; with more, the exploration is given up."""


def took(done: Macrostep | None) -> bool:
    """Whether a macrostep took a transition of the machine itself."""
    return done is not None and any(small.transitions for small in done.microsteps)


class TooManyChoices(Exception):  # noqa: N818  (a limit, not an error)
    """One step makes more choices than can be tried."""


class Action(Enum):
    """The kind of a step; the names are those of ``core/main.c``."""

    START = "start"
    TAKE = "take"
    FIRE = "fire"
    EVENTLESS = "eventless"
    OCCUR = "occur"
    ELAPSE = "elapse"


class Mover(Enum):
    """The mover of a step: the machines, time, or the environment."""

    INTERNAL = "internal"
    TIME = "time"
    ENVIRONMENT = "environment"


@dataclass(frozen=True, slots=True)
class Step:
    """A step, with all data for taking it again.

    ``argument``: for OCCUR the number of the external event, for FIRE that of the timer (untimed;
    in zones: in the order in which they were armed). ``ticks``: the duration of ELAPSE, 0 for a
    unit.
    """

    action: Action
    machine: int = 0
    argument: int = 0
    choices: tuple[int, ...] = ()
    ticks: Fraction = Fraction(0)


@dataclass(frozen=True, slots=True)
class Message:
    """An event for a queue, or a value for an input (``event`` None)."""

    target: int
    event: Occurrence | None = None
    input: int = 0
    value: Value = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a local step."""

    step: Step
    mover: Mover
    after: Snapshot
    messages: tuple[Message, ...]
    notes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class View:
    """The facts about a local state that the search uses (``fsm_view`` in core/system/system.h)."""

    waiting: int
    awaited: int
    due: bool
    running: bool
    faulted: bool
    at_rest: bool


class Chooser:
    """Enumerates choices, each sequence in turn, like an odometer; and returns results of calls."""

    def __init__(
        self, results: Mapping[str, tuple[Value, ...]] | None = None, choices: Sequence[int] = ()
    ) -> None:
        """Take the ``results`` of operations; start with the given choices."""
        self.results = results or {}
        self.chosen = list(choices)
        self.limits = [0] * len(self.chosen)
        self.at = 0

    def start_step(self) -> None:
        """Start a step; the choices remain."""
        self.at = 0

    def choose(self, n: int) -> int:
        """Return a number below ``n``."""
        if n < 2:
            return 0
        if self.at == len(self.chosen):
            self.chosen.append(0)
            self.limits.append(n)
        self.limits[self.at] = n
        self.at += 1
        return self.chosen[self.at - 1]

    def advance(self) -> bool:
        """Advance to the next sequence of choices; False after the last."""
        while self.chosen:
            self.chosen[-1] += 1
            if self.chosen[-1] < self.limits[-1]:
                return True
            self.chosen.pop()
            self.limits.pop()
        return False

    @property
    def sequence(self) -> tuple[int, ...]:
        """The choices of this run, so that it can be taken again."""
        return tuple(self.chosen[: self.at])

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the result of an operation (the `Host` of a step)."""
        del arguments
        values = self.results.get(operation)
        return None if values is None else values[self.choose(len(values))]


class ReadChooser(Chooser):
    """Chooses inputs, too, each when it is read first.

    ``counts``: the number of values of each free input; ``waiting``: the indices of those that are
    chosen when they are read.
    """

    def __init__(
        self,
        results: Mapping[str, tuple[Value, ...]],
        counts: Sequence[int],
        waiting: AbstractSet[int],
    ) -> None:
        """Start with no input read."""
        super().__init__(results)
        self.counts = counts
        self.waiting = waiting
        self._read: dict[int, int] = {}
        self._others: list[int] = []

    def start_step(self) -> None:
        """Start a step; the choices remain."""
        super().start_step()
        self._read, self._others = {}, []

    def choose(self, n: int) -> int:
        """Return a number below ``n``, which is not for an input."""
        found = super().choose(n)
        if n > 1:
            self._others.append(found)
        return found

    def choose_input(self, place: int) -> int:
        """Return the choice for a free input: the same until the step ends."""
        if place not in self._read:
            self._read[place] = super().choose(self.counts[place])
        return self._read[place]

    @property
    def inputs_read(self) -> dict[int, int]:
        """The choices for the free inputs that the step has read so far."""
        return dict(self._read)

    @property
    def sequence(self) -> tuple[int, ...]:
        """The choices of this run, in the form of a run that chooses all inputs before the step.

        An input that was not read has its first value.
        """
        inputs = (self._read.get(place, 0) for place in range(len(self.counts)))
        return (*inputs, *self._others)
