"""A file of tests, read: cases that are steps and expectations of one chart or system."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.diagnostics import Span, Text
from fsmkit.language import Value
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.system.system import System
from fsmkit.verify.questions import Expression


@dataclass(frozen=True, slots=True)
class Start:
    """The machines start; before it inputs may be set."""

    at: Text


@dataclass(frozen=True, slots=True)
class Post:
    """An event is put into the queue of a machine, which then runs until it is quiet."""

    at: Text
    machine: int
    event: Occurrence


@dataclass(frozen=True, slots=True)
class SetInput:
    """An input changes, and the machine runs."""

    at: Text
    machine: int
    input: int
    value: Value


@dataclass(frozen=True, slots=True)
class Wait:
    """So many ticks pass."""

    at: Text
    ticks: int


@dataclass(frozen=True, slots=True)
class Pattern:
    """A call of an operation or a sent event, as far as it is specified.

    ``values``: required values by position. ``name`` is that of the operation or event.
    """

    at: Text
    machine: int
    name: str
    values: tuple[tuple[int, Value], ...]

    def fits(self, machine: int, name: str, values: tuple[Value, ...]) -> bool:
        """Whether a call or an event is one of these."""
        return (machine, name) == (self.machine, self.name) and all(
            values[place] == value for place, value in self.values
        )


@dataclass(frozen=True, slots=True)
class Returns:
    """From here on an operation returns these values, one a call; the last one stays."""

    at: Text
    call: Pattern
    values: tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class InState:
    """A state of a machine."""

    at: Text
    machine: int
    state: int


@dataclass(frozen=True, slots=True)
class That:
    """A condition over the machines as they are."""

    at: Text
    condition: Expression


@dataclass(frozen=True, slots=True)
class Expect:
    """Expectations about the machines now, and their actions since the last `Expect`.

    ``called`` and ``sent`` happened in this order, with others between them; with ``only``,
    without others. ``fault`` is the reason for which a machine stopped, empty for none; None: not
    checked.
    """

    at: Span
    states: tuple[InState, ...] = ()
    left: tuple[InState, ...] = ()
    called: tuple[Pattern, ...] | None = None
    not_called: tuple[Pattern, ...] = ()
    sent: tuple[Pattern, ...] | None = None
    not_sent: tuple[Pattern, ...] = ()
    fault: Text | None = None
    that: tuple[That, ...] = ()
    only: bool = False


Step = Start | Post | SetInput | Wait | Returns | Expect


@dataclass(frozen=True, slots=True)
class Case:
    """A case: its name, its steps (those of ``before`` first) and the requirements it tests."""

    name: Text
    steps: tuple[Step, ...]
    req: tuple[Text, ...] = ()


@dataclass(frozen=True, slots=True)
class Suite:
    """The cases of a file. ``path``: of the chart or the system that they test."""

    name: str
    file: Path
    path: Path
    system: System
    cases: tuple[Case, ...] = field(repr=False)
