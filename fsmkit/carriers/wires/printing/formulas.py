"""Values of a board in C: all numbers are ``int32_t``, and no operator can fail."""

from __future__ import annotations

from fsmkit.carriers.wires.board import (
    Bit,
    Cases,
    Formula,
    Hysteresis,
    Invalid,
    Meaning,
    Notice,
    Origin,
    Parameter,
    Query,
    Wire,
)
from fsmkit.carriers.wires.printing.names import BoardNames
from fsmkit.chart.analysis.exclusion import joint_outcome, outcome
from fsmkit.codegen.c.expressions.types import enumeration_of
from fsmkit.emit import Identifier, plain
from fsmkit.language import (
    Binary,
    BinaryOp,
    BoolType,
    Conditional,
    Convert,
    Expr,
    Literal,
    Unary,
    UnaryOp,
    Variable,
)
from fsmkit.system.conditions import variables_of
from fsmkit.system.machine import port_fields
from fsmkit.system.properties.condition import Atom


class FormulaPrinter:
    """Prints values; ``port``: the machine and the port whose parameters may be named."""

    def __init__(self, names: BoardNames, port: tuple[int, int] | None = None) -> None:
        """Print within a function that has the pointer to the board."""
        self.names = names
        self.port = port
        self.parameters: set[int] = set()
        """The places of those that were printed."""

    def origin(self, origin: Origin) -> str:
        """Return a value of any origin."""
        if isinstance(origin, Cases):
            text = str(origin.otherwise)
            for value, bit in reversed(origin.cases):
                text = f"{self.bit(bit, is_inner=True)} ? {value} : {text}"
            return text
        return self.bit(origin)

    def bit(self, bit: Bit, *, is_inner: bool = False) -> str:
        """Return a value; ``is_inner``: as an operand."""
        match bit:
            case Formula():
                return self.formula(bit, is_inner=is_inner)
            case Hysteresis():
                return self.names.threshold(bit)
            case Invalid(signal, readings):
                text = f"{self.names.io}->own.{invalid(self.names, signal)} >= {readings}u"
                return f"({text})" if is_inner else text
            case Query():
                return self.query(bit)

    def query(self, query: Query) -> str:
        """Return a call of a function of a device."""
        device = self.names.board.devices[query.device]
        arguments = "".join(f", {self.formula(each)}" for each in query.arguments)
        name = f"{plain_name(device.type)}_{plain_name(query.function)}"
        return f"{name}(&{self.names.io}->{self.names.devices[query.device]}{arguments})"

    def formula(self, formula: Formula, *, is_inner: bool = False) -> str:
        """Return an expression."""
        return self._text(formula.expression, formula, is_inner=is_inner)

    def _text(self, expr: Expr, formula: Formula, *, is_inner: bool = True) -> str:
        match expr:
            case Literal(value):
                return _literal(value)
            case Variable(name):
                return self._meaning(formula.meanings[name], expr)
            case Convert(operand):
                return self._text(operand, formula, is_inner=is_inner)
            case Unary(op, operand):
                inner = self._text(operand, formula)
                text = f"!{inner}" if op is UnaryOp.NOT else f"-{inner}"
                return f"({text})" if is_inner and op is not UnaryOp.NOT else text
            case Binary(op, left, right):
                if (known := _known(expr)) is not None:
                    return _literal(known)  # compilers have something to say to such a test
                sign = "!=" if op is BinaryOp.NE else op.value
                text = f"{self._text(left, formula)} {sign} {self._text(right, formula)}"
            case Conditional(test, then, otherwise):
                a, b, c = (self._text(part, formula) for part in (test, then, otherwise))
                text = f"{a} ? {b} : {c}"
            case _:
                raise AssertionError(expr)
        return f"({text})" if is_inner else text

    def _meaning(self, meaning: Meaning, variable: Variable) -> str:
        match meaning:
            case Wire(signal):
                return self.names.value(signal)
            case Notice(device, bit):
                return notice(self.names, device, bit)
            case Parameter(place):
                assert self.port is not None  # noqa: S101  (of a binding of what leaves)
                machine, port = self.port
                self.parameters.add(place)
                part = self.names.parts[machine]
                text = part.names.field(port_fields(part.chart, port)[place].name)
                return text if isinstance(variable.type, BoolType) else f"(int32_t){text}"
            case Atom(machine, state, name):
                part = self.names.parts[machine]
                member = f"{self.names.io}->node.{part.member}"
                if state is not None:
                    return f"{part.prefix}_in(&{member}, {part.names.states[state]})"
                text = f"{member}.{part.names.variables[name]}"
                type_ = variables_of(part.chart)[name]
                if enumeration_of(type_, part.names) or not isinstance(type_, BoolType):
                    return f"(int32_t){text}"
                return text


def _known(expr: Binary) -> bool | None:
    """Return the value of a test that has always the same one."""
    if expr.op in (BinaryOp.AND, BinaryOp.OR):
        return joint_outcome(expr)
    if expr.left == expr.right and isinstance(expr.type, BoolType):
        return expr.op in (BinaryOp.EQ, BinaryOp.LE, BinaryOp.GE)
    return outcome(expr) if isinstance(expr.type, BoolType) else None


def invalid(names: BoardNames, signal: int) -> str:
    """Return the member that counts readings that are not valid."""
    converted = names.board.signals[signal].points
    return f"{names.signals[signal]}.invalid" if converted else f"{names.signals[signal]}_invalid"


def notice(names: BoardNames, device: int, bit: int) -> str:
    """Return the test whether a device noticed something in this cycle."""
    found = names.board.devices[device]
    constant = f"{plain_name(found.type)}_{plain_name(found.notices[bit])}".upper()
    return f"(((unsigned){constant} & {names.io}->own.{names.devices[device]}_noticed) != 0u)"


def plain_name(name: str) -> Identifier:
    """Return a name that was read as an identifier."""
    return Identifier(plain(name))


def _literal(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    assert isinstance(value, int)  # noqa: S101  (of numbers, bits and enumerations)
    if value == -(2**31):
        return "INT32_MIN"
    return str(value) if value >= 0 else f"({value})"
