"""A board: wires and flags, devices, and their bindings to the machines.

Numbers of machines are those of the whole system of the deployment, numbers of signals those of
`Board.signals`. All times are in cycles of the board.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from fsmkit.diagnostics import Span
from fsmkit.emit import guard
from fsmkit.language import BoolType, Expr, IntType, Type
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.properties.condition import Atom

WIRES = "wires"
"""The name of the plug-in."""


class Kind(Enum):
    """The kinds of signals, as written in files."""

    DIGITAL_IN = "digital_in"
    COUNTER = "counter"
    ANALOG_IN = "analog_in"
    NUMBER_IN = "number_in"
    DIGITAL_OUT = "digital_out"
    PWM = "pwm"
    NUMBER_OUT = "number_out"
    FLAG = "flag"


INPUTS = (Kind.DIGITAL_IN, Kind.COUNTER, Kind.ANALOG_IN, Kind.NUMBER_IN)
OUTPUTS = (Kind.DIGITAL_OUT, Kind.PWM, Kind.NUMBER_OUT)


@dataclass(frozen=True, slots=True)
class Register:
    """The location of a wire in a window of registers: ``bits`` of ``access`` from ``shift`` on.

    ``offset``: in bytes, a multiple of the access. ``is_signed``: in two's complement there.
    """

    offset: int
    access: int
    shift: int
    bits: int
    is_signed: bool


@dataclass(frozen=True, slots=True)
class Signal:
    """A wire, or a flag: a bit that exists only between bindings."""

    name: str
    kind: Kind
    type: BoolType | IntType
    """The type of its meaning: bits and flags are `bool`."""
    number: int = 0
    """The number of the wire among those of its kind."""
    is_low: bool = False
    """A bit: low voltage means true."""
    debounce: int = 1
    """A bit: so many readings in a row change it."""
    bits: int = 32
    """The bits of a counter, after which it is 0 again, or of a converter."""
    is_signed: bool = False
    points: tuple[tuple[int, int], ...] = ()
    """For a converter: ascending raw values, and their meaning; straight lines between them."""
    lowpass: int = 0
    """The time constant of the filter of a converter; 0: none."""
    valid: tuple[int, int] = (0, 0)
    """The raw values of a sound converter, or of a number; others are not taken in."""
    safe: int = 0
    """The value of an output while the board is off, or of a flag at the start."""
    is_kept: bool = False
    """An output keeps its value while the board is off."""
    is_of_host: bool = False
    """The program of the board reads the input, or sets the flag."""
    register: Register | None = None
    span: Span | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def is_input(self) -> bool:
        """Whether a wire leads into the board."""
        return self.kind in INPUTS

    @property
    def is_output(self) -> bool:
        """Whether a wire leads out of the board."""
        return self.kind in OUTPUTS


@dataclass(frozen=True, slots=True)
class Device:
    """A type in C and its functions: `type_sense`, `type_act`, and those that bindings call."""

    name: str
    type: str
    header: str
    reads: tuple[int, ...]
    writes: tuple[int, ...]
    notices: tuple[str, ...]
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name", "type", "header", "notices")


# --- sources of values ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Wire:
    """A name in an expression: a signal."""

    signal: int


@dataclass(frozen=True, slots=True)
class Notice:
    """A name in an expression: an event that a device reported in this cycle; ``bit``: its bit."""

    device: int
    bit: int


@dataclass(frozen=True, slots=True)
class Parameter:
    """A name in an expression: a field of an outgoing event; ``place``: its index."""

    place: int


Meaning = Atom | Wire | Notice | Parameter


@dataclass(frozen=True)
class Formula:
    """An expression, and the meaning of its variables."""

    expression: Expr
    meanings: Mapping[str, Meaning]


@dataclass(frozen=True, slots=True)
class Hysteresis:
    """True once a signal is above ``above``, false once it is below ``below``."""

    signal: int
    above: int
    below: int


@dataclass(frozen=True, slots=True)
class Invalid:
    """Whether a converter gave no valid value for so many readings."""

    signal: int
    readings: int


@dataclass(frozen=True, slots=True)
class Query:
    """The result of a function of a device."""

    device: int
    function: str
    arguments: tuple[Formula, ...]

    def __post_init__(self) -> None:
        guard(self, "function")


@dataclass(frozen=True, slots=True)
class Cases:
    """The value of the first condition that holds."""

    cases: tuple[tuple[int, Bit], ...]
    otherwise: int


Bit = Formula | Hysteresis | Invalid | Query
Origin = Bit | Cases


# --- bindings -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoundInput:
    """An input of a machine and the source of its value."""

    machine: int
    input: int
    origin: Origin


class Edge(Enum):
    """The condition on a watched value under which an event is posted."""

    RISING = "becomes true"
    FALLING = "becomes false"
    CHANGED = "changes"
    ALWAYS = "is true, in each cycle"


@dataclass(frozen=True, slots=True)
class BoundEvent:
    """An event of a machine, posted on an edge of ``watched``, if ``condition`` holds."""

    machine: int
    event: int
    edge: Edge
    watched: Bit
    condition: Formula | None
    values: tuple[Formula, ...]
    """The values of the fields."""


@dataclass(frozen=True, slots=True)
class BoundPort:
    """The effect of an operation, or of an outgoing event, on the board; it may be empty."""

    machine: int
    port: int
    sets: tuple[tuple[int, Formula], ...] = ()
    call: Query | None = None
    result: Formula | None = None
    """The result of the operation; by default that of ``call``."""


@dataclass(frozen=True, slots=True)
class BoundSignal:
    """A derived flag or output; flags first in a cycle, outputs last."""

    signal: int
    origin: Bit


@dataclass(frozen=True)
class Board:
    """A board: a node of a deployment behind its wires. ``period``: in microseconds."""

    name: str
    deployment: Deployment
    node: int
    period: int
    signals: tuple[Signal, ...]
    devices: tuple[Device, ...]
    inputs: tuple[BoundInput, ...]
    events: tuple[BoundEvent, ...]
    ports: tuple[BoundPort, ...]
    following: tuple[BoundSignal, ...]
    off: Formula | None

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def board_kind(self) -> str:
        """The name of the plug-in that reads such boards."""
        return WIRES


def type_name(type_: Type) -> str:
    """Return a type for findings: a range, not the machine integer of that range."""
    return f"{type_.lo}..{type_.hi}" if isinstance(type_, IntType) else str(type_)
