"""The typed tree of expressions: the only form in which a Chart holds them.

Every node has a type and a location; equality ignores locations. This module defines the meaning. A
target without an operator of that meaning prints a function call instead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from fsmkit.diagnostics import Span
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.emit import guard
from fsmkit.language.types import BOOL, SYMBOL, BoolType, SymbolType, Type, Value


class UnaryOp(Enum):
    """Operators of one operand; ``+x`` is ``x``."""

    NOT = "!"
    NEGATE = "-"
    INVERT = "~"


class BinaryOp(Enum):
    """Operators of two operands.

    ``AND`` and ``OR`` evaluate their right side only if needed. ``DIV`` of integers truncates
    toward zero, and ``REM`` has the sign of the dividend (C99 6.5.5). A shift count is reduced
    modulo 32 or 64, the width of the result type. ``SHIFT_RIGHT`` keeps the sign.
    """

    OR = "||"
    AND = "&&"
    EQ = "=="
    NE = "!="
    LT = "<"
    LE = "<="
    GT = ">"
    GE = ">="
    BIT_OR = "|"
    BIT_XOR = "^"
    BIT_AND = "&"
    SHIFT_LEFT = "<<"
    SHIFT_RIGHT = ">>"
    ADD = "+"
    SUB = "-"
    MUL = "*"
    DIV = "/"
    REM = "%"


class Storage(Enum):
    """The kind of a variable."""

    DATA = "data"
    INPUT = "input"
    OUTPUT = "output"
    LOCAL = "local"
    """Local to its block: ``let``, ``var``, a loop variable, a parameter of a function."""


class Function(Enum):
    """The functions of the language itself."""

    MIN = "min"
    MAX = "max"
    ABS = "abs"


@fast_init
@dataclass(frozen=True, slots=True)
class Literal:
    """A constant: also a named constant, an enumeration member, ``len(a)`` or a duration.

    ``name``: the name of the chart's constant, if the source uses it.
    """

    value: Value
    type: Type
    span: Span = field(compare=False, repr=False)
    name: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "value", "name")


@fast_init
@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of the chart: data, input or output. Names are unique across the three."""

    name: str
    type: Type
    storage: Storage
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class EventField:
    """``event.field``, in SCXML ``_event.data.field``: a field of the current event's payload."""

    name: str
    type: Type
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class EventName:
    """``_event.name``: the name of the current event, a symbol."""

    span: Span = field(compare=False, repr=False)
    type: SymbolType = SYMBOL


@fast_init
@dataclass(frozen=True, slots=True)
class EventType(EventName):
    """``_event.type``: ``platform``, ``internal`` or ``external`` (SCXML 5.10.1), a symbol.

    Empty if no event is being handled, like the name.
    """


@fast_init
@dataclass(frozen=True, slots=True)
class InState:
    """``In(state)``: true if the state with that index is active."""

    state: int
    id: str
    span: Span = field(compare=False, repr=False)
    type: BoolType = BOOL

    def __post_init__(self) -> None:
        guard(self, "id")


@fast_init
@dataclass(frozen=True, slots=True)
class Unary:
    """An operator of one operand."""

    op: UnaryOp
    operand: Expr
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Binary:
    """An operator of two operands."""

    op: BinaryOp
    left: Expr
    right: Expr
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Conditional:
    """``test ? then : otherwise``; only the chosen side is evaluated."""

    test: Expr
    then: Expr
    otherwise: Expr
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Element:
    """``array[index]``. An index out of range is a content error (``error.execution``)."""

    array: Variable
    index: Expr
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Member:
    """``record.field``."""

    record: Expr
    name: str
    type: Type
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class Apply:
    """``min``, ``max`` (two or more operands) or ``abs`` (one)."""

    function: Function
    arguments: tuple[Expr, ...]
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Call:
    """A call of an operation of the host. ``type`` is None if it returns nothing.

    Arguments already fit the declared parameters; each is wrapped in `Convert` where it might not.
    """

    operation: str
    arguments: tuple[Expr, ...]
    type: Type | None
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "operation")


@fast_init
@dataclass(frozen=True, slots=True)
class FunctionBody:
    """A function of the chart: pure, with a body of typed statements that returns on every path.

    ``reads``: each variable of the chart and each state test that it reads, also through other
    functions.
    """

    name: str
    parameters: tuple[Variable, ...]
    result: Type
    body: tuple[Any, ...]
    reads: tuple[Expr, ...]
    cost: int
    """The greatest number of statements that a call executes, including called functions."""
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class CallFunction:
    """A call of a function of the chart; the variables that it reads count as read here.

    Arguments already fit the parameters. A failure inside is a failure of this expression.
    """

    function: FunctionBody
    arguments: tuple[Expr, ...]
    reads: tuple[Expr, ...]
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Checked:
    """A number as a value of a type: the whole part for int64, the member for an enumeration.

    If the type has no such value, the result is ``otherwise``, or without it a content error.
    """

    operand: Expr
    type: Type
    span: Span = field(compare=False, repr=False)
    otherwise: Literal | None = None


@fast_init
@dataclass(frozen=True, slots=True)
class Convert:
    """A value converted to a type, as storing it in a variable of that type does.

    It wraps arguments, payload fields and stored values whose type differs. It converts integer to
    float and float to integer (truncating; NaN gives 0). Integers outside the bounds follow the
    `Overflow` of the type. For a member or a duration, written ``int(e)``, it is the number.
    """

    operand: Expr
    type: Type
    span: Span = field(compare=False, repr=False)
    name: str | None = field(default=None, compare=False, repr=False)
    """The name of the conversion, if it is explicit."""

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class Invalid:
    """An expression that cannot be evaluated: doing so is a content error (``error.execution``).

    Only charts of lenient dialects contain it: SCXML requires such a guard to fail at run time.
    """

    reason: str
    type: Type
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "reason")


@fast_init
@dataclass(frozen=True, slots=True)
class CoveredCondition:
    """A condition of a guard in code that counts coverage; its value is the operand's.

    Only `plan.counting` creates it. ``added`` is added to the number of the path through the guard
    if the condition is false. ``bit`` is recorded if it is false, the next bit if it is true; for
    guards whose paths are counted it is -1. ``is_first``: no other condition of the guard is
    evaluated before.
    """

    operand: Expr
    added: int
    bit: int
    is_first: bool
    span: Span = field(compare=False, repr=False)
    type: BoolType = BOOL


@fast_init
@dataclass(frozen=True, slots=True)
class CoveredGuard:
    """A whole guard in code that counts coverage; its value is the operand's.

    ``counter`` is the counter of its first path. Without counted paths it counts how often the
    guard was false, the previous one how often it was true, and ``noted`` bytes record its
    conditions.
    """

    operand: Expr
    counter: int
    noted: int
    span: Span = field(compare=False, repr=False)
    type: BoolType = BOOL


Expr = (
    Literal
    | Variable
    | EventField
    | EventName
    | InState
    | Unary
    | Binary
    | Conditional
    | Element
    | Member
    | Apply
    | Call
    | CallFunction
    | Checked
    | Convert
    | Invalid
    | CoveredCondition
    | CoveredGuard
)


@fast_init
@dataclass(frozen=True, slots=True)
class Numbers:
    """The range of ``for i in 0..7`` and ``for f in Fault``: integers, or numbers of members."""

    numbers: tuple[int, ...] | range
    type: Type
    span: Span = field(compare=False, repr=False)
    name: str = ""
    """The range as written."""

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def is_counted(self) -> bool:
        """Return whether the numbers are consecutive."""
        return len(self.numbers) == self.numbers[-1] - self.numbers[0] + 1


Iterated = Variable | Numbers
"""The iterated expression of a loop."""
Location = Variable | Element | Member
"""The left side of an assignment."""
