"""What a path knows of the data, which are open: a choice for each test.

Each expression of a chart stands in a *recording chart* as a call of an operation ``#n``; what it
asks of the interpreter (active states, the event at hand) comes as arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart, Event
from fsmkit.chart.walk import nodes
from fsmkit.diagnostics import Span
from fsmkit.export.uppaal.entries import FIRST_SLOT, Assigned, Entry, Picked, Test, scratch
from fsmkit.export.uppaal.terms import fitting, refuse, safety, saturating, staying
from fsmkit.language import (
    BOOL,
    SYMBOL,
    Binary,
    BinaryOp,
    Call,
    Conditional,
    ContentError,
    Convert,
    Element,
    EventField,
    EventName,
    EventType,
    Expr,
    InState,
    IntType,
    Invalid,
    Literal,
    RangeFault,
    Storage,
    Unary,
    UnaryOp,
    Value,
    Variable,
    default_value,
    fold,
)
from fsmkit.language.walk import rebuilt
from fsmkit.verify.statespace.actions import Chooser

NUMBER = IntType(-(2**30), -1)
AT = "#at"
"""The one field of each event of a recording chart: which event at hand this is."""
NOBODY, BLANK = -2, -1
"""No event is at hand; one that the platform has raised, without a payload."""

INSIDE, OUTSIDE = 0, 2
INSIDE_TYPE = IntType(0, 1)
IGNORED = "#"
"""A variable of a recording chart. To store `OUTSIDE` in it raises ``error.range``."""

Deed = Callable[[tuple[Value, ...]], Value]


@dataclass(frozen=True, slots=True)
class Term:
    """An expression, and how to bring along what the interpreter knows of it."""

    expr: Expr
    asked: tuple[Expr, ...]
    """What is asked of the interpreter, in order: states, results; then name and number."""


class Evaluator(Chooser):
    """Notes what a macrostep evaluates and does; a choice for each test that is open."""

    def __init__(
        self,
        chart: Chart,
        results: Mapping[str, tuple[Value, ...]],
        is_wired: Callable[[int], bool],
    ) -> None:
        """Record a chart; ``is_wired`` tells whether anybody hears of a port."""
        super().__init__(results)
        self.original = chart
        self.is_wired = is_wired
        self.deeds: list[Deed] = []
        self.ports = {o.name: len(chart.events) + n for n, o in enumerate(chart.operations)}
        everything = (chart.states, chart.transitions, chart.script)
        self._read = {n.name for n in nodes(everything) if isinstance(n, EventField)}
        self.hears_errors = "error.range" in chart.event_index
        self.constants: Mapping[str, Literal] = {}
        """Inputs that never change."""
        self.entries: list[Entry] = []
        self._known: dict[str, Literal] = {}
        self._asked: dict[Expr, bool] = {}
        self.events: dict[int, int] = {}
        self.payload: dict[tuple[int, str], Expr] = {}
        self.slots: set[int] = set()
        self.left = False
        """Whether a value was brought back into its range."""

    def start(self, events: Mapping[int, int], payload: Mapping[tuple[int, str], Expr]) -> None:
        """Begin a path: which events are at hand or delayed, by number, and what they carry."""
        self.begin()
        self.entries = []
        self._known = dict(self.constants)
        self._asked = {}
        self.events = dict(events)
        self.payload = dict(payload)
        self.slots = {number for number in events if number >= FIRST_SLOT}

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Do what stands for an operation, or give one of its results."""
        if operation.startswith("#"):
            return self.deeds[int(operation[1:])](arguments)
        values = self.results.get(operation)
        if values is None:
            return None
        if self.is_wired(self.ports[operation]):
            raise refuse(
                f"`{operation}` has a result, and somebody is told of its call",
                next(o.span for o in self.original.operations if o.name == operation),
                "send an event instead, and wait for the answer",
            )
        value = values[self.choose(len(values))]
        if len(values) > 1:
            self.entries.append(Picked(operation, value))
        return value

    # --- what is known and what is open ----------------------------------------------------------

    def bound(self, term: Term, arguments: tuple[Value, ...]) -> Expr:
        """Return an expression with all that is not data made constant."""
        values = list(arguments)
        at, name = values.pop(), values.pop()
        assert isinstance(at, int)  # noqa: S101  (numbered here)
        assert isinstance(name, str)  # noqa: S101  (a name)

        def change(node: Expr) -> Expr | None:
            match node:
                case InState():
                    return Literal(values.pop(0), BOOL, node.span)
                case Call(_, _, type_) if type_ is not None:
                    return Literal(values.pop(0), type_, node.span)
                case EventType():
                    return Literal(self._type(at, name, node), SYMBOL, node.span)
                case EventName():
                    return Literal(name, SYMBOL, node.span)
                case EventField(field):
                    return self._field(at, name, field, node)
                case Variable(variable) if variable in self._known:
                    return replace(self._known[variable], span=node.span)
                case _:
                    return None

        return fold(rebuilt(term.expr, change))

    def _type(self, at: int, name: str, node: EventType) -> str:
        """Return the type of the event at hand; refused where its name does not tell it."""
        if at == NOBODY:
            return ""
        types = {event.type for event in self.original.events if event.name == name}
        if len(types) > 1:
            raise refuse(
                f"`{name}` is both raised and sent, and its type is asked",
                node.span,
                "give what is raised a name of its own",
            )
        return types.pop()

    def _field(self, at: int, name: str, field: str, node: EventField) -> Expr:
        if at == NOBODY:
            return Invalid("there is no event at hand", node.type, node.span)
        index = self.original.event_index[name] if at == BLANK else self.events[at]
        declared = next((f for f in self.original.events[index].fields if f.name == field), None)
        if declared is None:
            return Invalid(f"`{name}` has no `{field}`", node.type, node.span)
        if at == BLANK:
            return Literal(default_value(declared.type), declared.type, node.span)
        return self.payload[at, field]

    def test(self, condition: Expr | None) -> bool:
        """Tell whether a condition holds on this path; None does."""
        if condition is None:
            return True
        holds = True
        while isinstance(condition, Unary) and condition.op is UnaryOp.NOT:
            condition, holds = condition.operand, not holds
        if isinstance(condition, Literal):
            return bool(condition.value) is holds
        known = self._asked.get(condition)
        if known is None:
            known = (self.choose(2) == 0) is holds
            self._asked[condition] = known
            self.entries.append(Test(condition, known))
            self._learn(condition, known)
        return known is holds

    def _learn(self, condition: Expr, holds: bool) -> None:
        match condition:
            case Variable(name):
                self._known[name] = Literal(holds, BOOL, condition.span)
            case Unary(UnaryOp.NOT, operand):
                self._learn(operand, not holds)
            case Binary(BinaryOp.AND, left, right) if holds:
                self._learn(left, True)
                self._learn(right, True)
            case Binary(BinaryOp.OR, left, right) if not holds:
                self._learn(left, False)
                self._learn(right, False)
            case Binary(BinaryOp.EQ, Variable(name), Literal() as value) if holds:
                self._known[name] = value
            case _:
                pass

    def checked(self, expr: Expr, *, may_leave: bool = False) -> Expr:
        """Evaluate on this path; raises what the interpreter would meet.

        ``may_leave``: that a value is brought back into its range can be told (``error.range``).
        """
        safe, inside = safety(expr), staying(expr)
        if not self.test(None if safe is None else fold(safe)):
            raise ContentError("this cannot be evaluated")
        if not self.test(None if inside is None else fold(inside)):
            raise RangeFault("a value left its range")
        leaving = saturating(expr) if self.hears_errors else []
        if leaving and not (may_leave and len(leaving) == 1):
            raise refuse(
                "a value may leave its range here, and the chart answers `error.range`",
                expr.span,
                "store it in a variable first",
            )
        for convert in leaving:
            fits = fitting(convert)
            if self.test(None if fits is None else fold(fits)):
                return _without(expr, convert)
            self.left = True
        return expr

    def assign(self, location: Expr, value: Expr) -> None:
        """Store a value on this path."""
        if isinstance(location, Element):
            safe = safety(location)
            if not self.test(None if safe is None else fold(safe)):
                raise ContentError("the index is outside the array")
        self.entries.append(Assigned(location, value))
        self._asked = {}
        if isinstance(location, Variable):
            self._known.pop(location.name, None)
            if isinstance(value, Literal) and not isinstance(value.value, tuple):
                self._known[location.name] = value

    def keep(self, number: int, event: Event, values: tuple[Expr, ...]) -> None:
        """Keep the payload of an event until it is taken."""
        self.events[number] = event.index
        for field, value in zip(event.fields, values, strict=True):
            wanted = field.name in self._read or number >= FIRST_SLOT
            if number < FIRST_SLOT and (isinstance(value, Literal) or not wanted):
                self.payload[number, field.name] = value
                continue
            name = scratch(number, field.name)
            variable = Variable(name, field.type, Storage.DATA, value.span)
            self.payload[number, field.name] = variable
            self.assign(variable, value)


def _without(expr: Expr, convert: Convert) -> Expr:
    """Return an expression in which a value is not brought into a range that it is in."""
    return rebuilt(expr, lambda node: convert.operand if node is convert else None)


def term_of(expr: Expr) -> Term:
    """Return an expression with what it asks of the interpreter."""
    asked: list[Expr] = []

    def look(node: Expr) -> Expr | None:
        if isinstance(node, InState) or (isinstance(node, Call) and node.type is not None):
            asked.append(node if isinstance(node, InState) else replace(node, arguments=()))
            return node
        return None

    rebuilt(expr, look)
    return Term(expr, tuple(asked))


def number_at_hand(span: Span) -> Expr:
    """Return what asks the interpreter for the number of the event at hand."""
    none = Binary(BinaryOp.EQ, EventName(span), Literal("", SYMBOL, span), BOOL, span)
    return Conditional(
        none, Literal(NOBODY, NUMBER, span), EventField(AT, NUMBER, span), NUMBER, span
    )
