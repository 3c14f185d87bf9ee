"""Values of a board in C: all numbers are ``int32_t``, and no operator can fail."""

from __future__ import annotations

from dataclasses import dataclass

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
from fsmkit.codegen.c.expressions.types import enumeration_of, integer
from fsmkit.emit import Identifier, plain
from fsmkit.language import (
    Binary,
    BinaryOp,
    BoolType,
    Convert,
    ExprPrinter,
    Fragment,
    Literal,
    Variable,
)
from fsmkit.language.printing import ATOM, PREFIX
from fsmkit.plan.values import known_outcome
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
        return _Expressions(self, formula).fragment(formula.expression).at_least(PREFIX * is_inner)

    def meaning(self, meaning: Meaning, variable: Variable) -> str:
        """Return the C text of the wire, notice, parameter or atom that a variable means."""
        match meaning:
            case Wire(signal):
                return self.names.value(signal)
            case Notice(device, bit):
                return notice(self.names, device, bit)
            case Parameter(place):
                assert self.port is not None  # noqa: S101  (set for bindings of outputs)
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


@dataclass(frozen=True, slots=True)
class _Expressions(ExprPrinter):
    """Prints the expression of a value, with the names of its printer."""

    printer: FormulaPrinter
    formula: Formula

    def literal(self, expr: Literal) -> Fragment:
        """Print a constant."""
        if isinstance(expr.value, bool):
            return Fragment("true" if expr.value else "false")
        assert isinstance(expr.value, int)  # noqa: S101  (of numbers, bits and enumerations)
        text = integer(expr.value, "int32_t")
        return Fragment(text, PREFIX if text.startswith("-") else ATOM)

    def variable(self, expr: Variable) -> Fragment:
        """Print a wire, a notice, a parameter or a part of a machine."""
        return Fragment(self.printer.meaning(self.formula.meanings[expr.name], expr))

    def convert(self, expr: Convert) -> Fragment:
        """Print what is converted: all numbers have one type."""
        return self.fragment(expr.operand)

    def infix(self, expr: Binary) -> Fragment:
        """Print an operator; tests that always end alike are constants: compilers warn of them."""
        known = known_outcome(expr)
        if expr.left == expr.right and expr.op in (BinaryOp.EQ, BinaryOp.NE):  # of truth values
            known = expr.op is BinaryOp.EQ
        if known is not None:
            return Fragment("true" if known else "false")
        return ExprPrinter.infix(self, expr)


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
