"""The typed tree of expressions: the only form in which a Chart holds them.

Every node has a type and a place; places take no part in equality. Meaning is fixed here: a
target that cannot spell an operator with this meaning prints a call of its own instead.
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

    ``AND`` and ``OR`` do not evaluate their right side needlessly. ``DIV`` of integers truncates
    toward zero and ``REM`` has the sign of the dividend, as in C99 6.5.5. A shift count is reduced
    modulo 32 or 64, the width of the result type; ``SHIFT_RIGHT`` keeps the sign.
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
    """Where a variable lives."""

    DATA = "data"
    INPUT = "input"
    OUTPUT = "output"
    LOCAL = "local"
    """In its block only: ``let``, ``var``, a loop variable, a parameter of a function."""


class Function(Enum):
    """The functions of the language itself."""

    MIN = "min"
    MAX = "max"
    ABS = "abs"


@fast_init
@dataclass(frozen=True, slots=True)
class Literal:
    """A constant. Named constants, enumeration members, ``len(a)`` and durations end here too.

    ``name``: of the constant of the chart that was written, if this is it.
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
    """``event.field``, in SCXML ``_event.data.field``: a part of the payload being handled."""

    name: str
    type: Type
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class EventName:
    """``_event.name``: the name of the event being handled, a symbol."""

    span: Span = field(compare=False, repr=False)
    type: SymbolType = SYMBOL


@fast_init
@dataclass(frozen=True, slots=True)
class EventType(EventName):
    """``_event.type``: ``platform``, ``internal`` or ``external`` (SCXML 5.10.1), a symbol.

    Empty where no event is at hand, as its name is.
    """


@fast_init
@dataclass(frozen=True, slots=True)
class InState:
    """``In(state)``: whether the state of that index is active."""

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
    """A call of an operation of the host. ``type`` is None where it returns nothing.

    Arguments already fit the declared parameters: each is wrapped in `Convert` where it might not.
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
    """A function of the chart: pure, with a body of typed statements, each way of which returns.

    ``reads``: a variable of the chart, or a state test, for each that it reads itself or by others.
    """

    name: str
    parameters: tuple[Variable, ...]
    result: Type
    body: tuple[Any, ...]
    reads: tuple[Expr, ...]
    cost: int
    """At most so many statements are executed, those of functions that it calls included."""
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class CallFunction:
    """A call of a function of the chart; what it reads counts as read here.

    Arguments already fit the parameters. A failure inside is one of this expression.
    """

    function: FunctionBody
    arguments: tuple[Expr, ...]
    reads: tuple[Expr, ...]
    type: Type
    span: Span = field(compare=False, repr=False)


@fast_init
@dataclass(frozen=True, slots=True)
class Checked:
    """A number as a value of a type: of int64 its whole part, of an enumeration the member.

    Where there is none it is ``otherwise``, or without that a content error.
    """

    operand: Expr
    type: Type
    span: Span = field(compare=False, repr=False)
    otherwise: Literal | None = None


@fast_init
@dataclass(frozen=True, slots=True)
class Convert:
    """A value brought into a type, as storing it in a variable of that type would.

    Put around arguments, payload fields and stored values whose type differs: integer to float,
    float to integer (truncating; NaN gives 0), and integers that may lie outside the bounds, for
    which `Overflow` of the type says what happens. Of a member or a duration, written ``int(e)``,
    it is the number.
    """

    operand: Expr
    type: Type
    span: Span = field(compare=False, repr=False)
    name: str | None = field(default=None, compare=False, repr=False)
    """What was called to convert, where that is written."""

    def __post_init__(self) -> None:
        guard(self, "name")


@fast_init
@dataclass(frozen=True, slots=True)
class Invalid:
    """An expression that cannot be evaluated: doing so is a content error (``error.execution``).

    Only charts of lenient dialects hold it: SCXML wants such a guard to fail when it is reached.
    """

    reason: str
    type: Type
    span: Span = field(compare=False, repr=False)

    def __post_init__(self) -> None:
        guard(self, "reason")


@fast_init
@dataclass(frozen=True, slots=True)
class Watched:
    """A condition of a guard, in code that counts what tests reach; its value is the operand's.

    No chart that is read holds it (`plan.counting` puts it there). ``added``: to the number of
    the way through the guard where this is false; ``bit``: noted where it is false, the next one
    where it is true, for guards of which no ways are kept, else -1; ``is_first``: no other of the
    guard is evaluated before.
    """

    operand: Expr
    added: int
    bit: int
    is_first: bool
    span: Span = field(compare=False, repr=False)
    type: BoolType = BOOL


@fast_init
@dataclass(frozen=True, slots=True)
class Decided:
    """A whole guard, in code that counts what tests reach; its value is the operand's.

    ``counter``: of its first way; where no ways are kept, of how often it was false, before that of
    how often it was true and ``noted`` bytes of what its conditions noted.
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
    | Watched
    | Decided
)


@fast_init
@dataclass(frozen=True, slots=True)
class Numbers:
    """What ``for i in 0..7`` and ``for f in Fault`` go through: integers, or numbers of members."""

    numbers: tuple[int, ...] | range
    type: Type
    span: Span = field(compare=False, repr=False)
    name: str = ""
    """As it was written."""

    def __post_init__(self) -> None:
        guard(self, "name")

    @property
    def is_counted(self) -> bool:
        """Whether each number is one more than that before."""
        return len(self.numbers) == self.numbers[-1] - self.numbers[0] + 1


Iterated = Variable | Numbers
"""What a loop goes through."""
Location = Variable | Element | Member
"""What an assignment can write."""
