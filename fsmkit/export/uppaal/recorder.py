"""Record the macrosteps of a chart whose guards and statements become calls of a host.

Each expression of the chart becomes a call of an operation ``#n`` of the `Recorder`, which knows
the original. So the reference interpreter decides, unchanged, which expressions are evaluated in
which order. Configuration, histories, internal queue and timers are its own; data are expressions.
The arguments of the call are the facts that an expression needs of the interpreter: the active
states, and the current event.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart, Data, Event
from fsmkit.chart.content import written
from fsmkit.diagnostics import Span
from fsmkit.export.uppaal.entries import (
    FIRST_SLOT,
    Assignment,
    Entry,
    Output,
    QueuedEvent,
    ResultChoice,
    Test,
    scratch,
)
from fsmkit.export.uppaal.terms import (
    conversion_condition,
    range_condition,
    safety,
    saturating_conversions,
    unsupported,
)
from fsmkit.language.arithmetic import exact
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import EXPRESSIONS, child_fields, nodes, rewrite, root
from fsmkit.verify.statespace.actions import Chooser

MOST_LIMITS = 1 << 14
"""Expressions whose limits are kept."""
NUMBER = lang.IntType(-(2**30), -1)
AT = "#at"
"""The only field of each event of a recording chart: the number of the current event."""
NOBODY, BLANK = -2, -1
"""No current event; an event that the platform has raised, without a payload."""

INSIDE, OUTSIDE = 0, 2
INSIDE_TYPE = lang.IntType(0, 1)
IGNORED = "#"
"""A variable of a recording chart. To store `OUTSIDE` in it raises ``error.range``."""

Action = Callable[[tuple[lang.Value, ...]], lang.Value]


@dataclass(frozen=True, slots=True)
class Term:
    """An expression, and the facts that it needs of the interpreter."""

    expr: lang.Expr
    needs: tuple[lang.Expr, ...]
    """The interpreter's values for it, in order: states, results; then name and number."""
    names: frozenset[str]
    """The variables that it reads."""
    reads_event: bool
    """Whether it depends on the current event."""
    known: dict[tuple[lang.Value, ...], lang.Expr] = field(default_factory=dict, compare=False)
    """By states and results: the expression, if none of its variables is known."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Where evaluating an expression raises nothing, and where its value stays in its range.

    None: everywhere. ``leaving``: the conversions that may limit a value.
    """

    expr: lang.Expr
    safe: lang.Expr | None
    inside: lang.Expr | None
    leaving: tuple[lang.Convert, ...]

    @classmethod
    def of(cls, expr: lang.Expr) -> Limits:
        """Return the limits of an expression."""
        safe, inside = safety(expr), range_condition(expr)
        return cls(
            expr,
            None if safe is None else lang.fold(safe),
            None if inside is None else lang.fold(inside),
            tuple(saturating_conversions(expr)),
        )


class Recorder(Chooser):
    """The host of a recording chart: it records the evaluations and effects of a macrostep.

    Each open test is a choice.
    """

    def __init__(
        self,
        chart: Chart,
        results: Mapping[str, tuple[lang.Value, ...]],
        is_wired: Callable[[int], bool],
    ) -> None:
        """Build the recording chart; ``is_wired``: whether a port is connected."""
        super().__init__(results)
        self.original = chart
        self.is_wired = is_wired
        self.actions: list[Action] = []
        self.ports = {o.name: len(chart.events) + n for n, o in enumerate(chart.operations)}
        everything = (chart.states, chart.transitions, chart.script)
        self._read = {n.name for n in nodes(everything) if isinstance(n, lang.EventField)}
        self.answers_errors = "error.range" in chart.event_index
        self.constants: Mapping[str, lang.Literal] = {}
        """Inputs that never change."""
        self.entries: list[Entry] = []
        self._known: dict[str, lang.Literal] = {}
        self._asked: dict[lang.Expr, bool] = {}
        self.events: dict[int, int] = {}
        self.payload: dict[tuple[int, str], lang.Expr] = {}
        self.slots: set[int] = set()
        self.left = False
        """Whether a value was brought back into its range."""
        self._limits: dict[int, Limits] = {}
        """By the identity of an expression; its limits keep it, so no other has that identity."""
        self.chart = self._recording(chart)

    def start(
        self, events: Mapping[int, int], payload: Mapping[tuple[int, str], lang.Expr]
    ) -> None:
        """Start a path with current or delayed events, by number, and their payloads."""
        self.start_step()
        self.entries = []
        self._known = dict(self.constants)
        self._asked = {}
        self.events = dict(events)
        self.payload = dict(payload)
        self.slots = {number for number in events if number >= FIRST_SLOT}

    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        """Perform the recorded action of an operation, or return one of its results."""
        if operation.startswith("#"):
            return self.actions[int(operation[1:])](arguments)
        values = self.results.get(operation)
        if values is None:
            return None
        if self.is_wired(self.ports[operation]):
            raise unsupported(
                f"`{operation}` has a result, and its call is observed",
                next(o.span for o in self.original.operations if o.name == operation),
                "send an event instead, and wait for the answer",
            )
        value = values[self.choose(len(values))]
        if len(values) > 1:
            self.entries.append(ResultChoice(operation, value))
        return value

    # --- known and open values -------------------------------------------------------------------

    def bound(self, term: Term, arguments: tuple[lang.Value, ...]) -> lang.Expr:
        """Return an expression with everything constant that is not data."""
        if term.reads_event or not term.names.isdisjoint(self._known):
            return self._bound(term, arguments)
        key = arguments[:-2]
        if key not in term.known:
            term.known[key] = self._bound(term, arguments)
        return term.known[key]

    def _bound(self, term: Term, arguments: tuple[lang.Value, ...]) -> lang.Expr:
        values = list(arguments)
        at, name = values.pop(), values.pop()
        assert isinstance(at, int)  # noqa: S101  (numbered here)
        assert isinstance(name, str)  # noqa: S101  (a name)

        def change(node: lang.Expr) -> lang.Expr | None:
            match node:
                case lang.InState():
                    return lang.Literal(values.pop(0), lang.BOOL, node.span)
                case lang.Call(_, _, type_) if type_ is not None:
                    return lang.Literal(values.pop(0), type_, node.span)
                case lang.EventType():
                    return lang.Literal(self._type(at, name, node), lang.SYMBOL, node.span)
                case lang.EventName():
                    return lang.Literal(name, lang.SYMBOL, node.span)
                case lang.EventField(field):
                    return self._field(at, name, field, node)
                case lang.Variable(variable) if variable in self._known:
                    return replace(self._known[variable], span=node.span)
                case _:
                    return None

        return lang.fold(rewrite(term.expr, change))

    def _type(self, at: int, name: str, node: lang.EventType) -> str:
        """Return the type of the current event; rejected if its name does not determine it."""
        if at == NOBODY:
            return ""
        types = {event.type for event in self.original.events if event.name == name}
        if len(types) > 1:
            raise unsupported(
                f"`{name}` is both raised and sent, and its type is used",
                node.span,
                "rename the raised event",
            )
        return types.pop()

    def _field(self, at: int, name: str, field: str, node: lang.EventField) -> lang.Expr:
        if at == NOBODY:
            return lang.Invalid("there is no current event", node.type, node.span)
        index = self.original.event_index[name] if at == BLANK else self.events[at]
        declared = next((f for f in self.original.events[index].fields if f.name == field), None)
        if declared is None:
            return lang.Invalid(f"`{name}` has no `{field}`", node.type, node.span)
        if at == BLANK:
            return lang.Literal(lang.default_value(declared.type), declared.type, node.span)
        return self.payload[at, field]

    def test(self, condition: lang.Expr | None) -> bool:
        """Return whether a condition holds on this path; None does."""
        if condition is None:
            return True
        holds = True
        while isinstance(condition, lang.Unary) and condition.op is lang.UnaryOp.NOT:
            condition, holds = condition.operand, not holds
        if isinstance(condition, lang.Literal):
            return bool(condition.value) is holds
        known = self._asked.get(condition)
        if known is None:
            known = (self.choose(2) == 0) is holds
            self._asked[condition] = known
            self.entries.append(Test(condition, known))
            self._learn(condition, known)
        return known is holds

    def _learn(self, condition: lang.Expr, holds: bool) -> None:
        match condition:
            case lang.Variable(name):
                self._known[name] = lang.Literal(holds, lang.BOOL, condition.span)
            case lang.Unary(lang.UnaryOp.NOT, operand):
                self._learn(operand, not holds)
            case lang.Binary(lang.BinaryOp.AND, left, right) if holds:
                self._learn(left, True)
                self._learn(right, True)
            case lang.Binary(lang.BinaryOp.OR, left, right) if not holds:
                self._learn(left, False)
                self._learn(right, False)
            case lang.Binary(lang.BinaryOp.EQ, lang.Variable(name), lang.Literal() as value) if (
                holds
            ):
                self._known[name] = value
            case _:
                pass

    def checked(self, expr: lang.Expr, *, may_leave: bool = False) -> lang.Expr:
        """Evaluate on this path; raise the interpreter's errors.

        ``may_leave``: a value may be limited to its range (``error.range``).
        """
        limits = self._limits.get(id(expr))
        if limits is None:
            if len(self._limits) == MOST_LIMITS:
                self._limits.clear()
            limits = self._limits[id(expr)] = Limits.of(expr)
        if not self.test(limits.safe):
            raise lang.ContentError("this cannot be evaluated")
        if not self.test(limits.inside):
            raise lang.RangeFault("a value left its range")
        leaving = limits.leaving if self.answers_errors else ()
        if leaving and not (may_leave and len(leaving) == 1):
            raise unsupported(
                "a value may leave its range here, and the chart answers `error.range`",
                expr.span,
                "store it in a variable first",
            )
        for convert in leaving:
            fits = conversion_condition(convert)
            if self.test(None if fits is None else lang.fold(fits)):
                return _without(expr, convert)
            self.left = True
        return expr

    def assign(self, location: lang.Expr, value: lang.Expr) -> None:
        """Store a value on this path."""
        if isinstance(location, lang.Element):
            safe = safety(location)
            if not self.test(None if safe is None else lang.fold(safe)):
                raise lang.ContentError("the index is outside the array")
        self.entries.append(Assignment(location, value))
        self._asked = {}
        if isinstance(location, lang.Variable):
            self._known.pop(location.name, None)
            if isinstance(value, lang.Literal) and not isinstance(value.value, tuple):
                self._known[location.name] = value

    def keep(self, number: int, event: Event, values: tuple[lang.Expr, ...]) -> None:
        """Store the payload of an event until it is taken."""
        self.events[number] = event.index
        for part, value in zip(event.fields, values, strict=True):
            is_read = part.name in self._read or number >= FIRST_SLOT
            if number < FIRST_SLOT and (isinstance(value, lang.Literal) or not is_read):
                self.payload[number, part.name] = value
                continue
            name = scratch(number, part.name)
            variable = lang.Variable(name, part.type, lang.Storage.DATA, value.span)
            self.payload[number, part.name] = variable
            self.assign(variable, value)

    # --- the recording chart ---------------------------------------------------------------------

    def _recording(self, chart: Chart) -> Chart:
        states = tuple(
            replace(
                state,
                on_entry=tuple(map(self._block, state.on_entry)),
                on_exit=tuple(map(self._block, state.on_exit)),
                done_data=self._done_data(chart, state.parent, state.done_data),
            )
            for state in chart.states
        )
        transitions = tuple(
            replace(
                t,
                guard=None if t.guard is None else self._guard(t.guard),
                content=self._block(t.content),
            )
            for t in chart.transitions
        )
        events = tuple(replace(e, fields=(lang.Field(AT, NUMBER),)) for e in chart.events)
        script = self._block(chart.script)
        span = chart.root.span
        ignored = Data(IGNORED, INSIDE_TYPE, lang.Literal(INSIDE, INSIDE_TYPE, span), span)
        return replace(
            chart,
            states=states,
            transitions=transitions,
            events=events,
            script=script,
            data=(*chart.data, ignored),
        )

    def _guard(self, guard: lang.Expr) -> lang.Expr:
        term = term_of(guard)

        def action(arguments: tuple[lang.Value, ...]) -> lang.Value:
            return self.test(self.checked(self.bound(term, arguments)))

        return self._call(action, (term,), guard.span, lang.BOOL)

    def _call(
        self, action: Action, terms: tuple[Term, ...], span: Span, type_: object
    ) -> lang.Call:
        """Return the call for an action, with the values that the interpreter evaluates for it."""
        self.actions.append(action)
        arguments: list[lang.Expr] = []
        for term in terms:
            arguments += [*term.needs, lang.EventName(span), current_event_number(span)]
        return lang.Call(f"#{len(self.actions) - 1}", tuple(arguments), type_, span)  # type: ignore[arg-type]

    def _done_data(
        self, chart: Chart, parent: int | None, values: tuple[lang.Expr, ...]
    ) -> tuple[lang.Expr, ...]:
        if not values or parent is None:
            return ()
        event = chart.event_index.get(f"done.state.{chart.states[parent].id}")
        if event is None:
            return ()
        given = values[: len(chart.events[event].fields)]
        return (self._raising(event, given, given[0].span),) if given else ()

    def _raising(self, event: int, values: tuple[lang.Expr, ...], span: Span) -> lang.Call:
        """Return the call that stores a payload and returns the number of the raised event."""
        terms = tuple(map(term_of, values))
        declared = self.original.events[event]

        def action(arguments: tuple[lang.Value, ...]) -> lang.Value:
            found = self._values(terms, arguments)
            number = 1 + max((n for n in self.events if n < FIRST_SLOT), default=0)
            self.keep(number, declared, found)
            return number

        return self._call(action, terms, span, NUMBER)

    def _values(
        self, terms: tuple[Term, ...], arguments: tuple[lang.Value, ...], *, may_leave: bool = False
    ) -> tuple[lang.Expr, ...]:
        found, at = [], 0
        for term in terms:
            end = at + len(term.needs) + 2
            bound = self.bound(term, arguments[at:end])
            found.append(self.checked(bound, may_leave=may_leave))
            at = end
        return tuple(found)

    def _block(self, block: stmt.Block) -> stmt.Block:
        return tuple(done for statement in block for done in self._statement(statement))

    def _statement(self, statement: stmt.Statement) -> list[stmt.Statement]:
        match statement:
            case stmt.Local() | stmt.Return():
                raise unsupported(
                    "local variables are not translated",
                    statement.span,
                    "declare the variable under `data`",
                )
            case stmt.Assign(location, value):
                return [self._assigning(location, value, statement.span)]
            case stmt.Raise(event, arguments, span):
                return [replace(statement, arguments=(self._raising(event, arguments, span),))]
            case stmt.Send():
                return [self._sending(statement)]
            case stmt.Log(_, values, span) | stmt.Reply(values, span) if values:
                parts = values if isinstance(values, tuple) else (values,)
                return [self._doing(tuple(parts), span, lambda _: None)]
            case stmt.Log():
                return []
            case stmt.If(branches):
                return [replace(statement, branches=tuple(map(self._branch, branches)))]
            case stmt.ForEach():
                return self._unroll(statement)
            case stmt.CallOperation(call, span):
                port = self.ports[call.operation]
                if call.type is not None:
                    return [self._doing((call,), span, lambda _: None)]
                return [self._doing(call.arguments, span, lambda v: self._record_call(port, v))]
            case stmt.Cancel() | stmt.Fail():
                return [statement]
            case stmt.Invoke():
                raise unsupported(
                    "invoked machines are not translated",
                    statement.span,
                    "make it a machine of its own in a system",
                )
            case _:
                raise unsupported(
                    f"the statement `{stmt.word_of(statement)}` is not translated",
                    statement.span,
                    "use other statements",
                )

    def _branch(
        self, branch: stmt.Branch[lang.Expr, stmt.Statement]
    ) -> stmt.Branch[lang.Expr, stmt.Statement]:
        condition = None if branch.condition is None else self._guard(branch.condition)
        return stmt.Branch(condition, self._block(branch.body))

    def _doing(
        self,
        values: tuple[lang.Expr, ...],
        span: Span,
        action: Callable[[tuple[lang.Expr, ...]], None],
    ) -> stmt.Statement:
        terms = tuple(map(term_of, values))

        def done(arguments: tuple[lang.Value, ...]) -> lang.Value:
            self.left = False
            action(self._values(terms, arguments, may_leave=True))
            return OUTSIDE if self.left else INSIDE

        return self._performing(done, terms, span)

    def _performing(self, done: Action, terms: tuple[Term, ...], span: Span) -> stmt.Statement:
        """Return the statement that performs an action; for `OUTSIDE`, with ``error.range``."""
        if not self.answers_errors:
            return stmt.CallOperation(self._call(done, terms, span, None), span)
        value = lang.Convert(self._call(done, terms, span, INSIDE_TYPE), INSIDE_TYPE, span)
        return stmt.Assign(
            lang.Variable(IGNORED, INSIDE_TYPE, lang.Storage.DATA, span), value, span
        )

    def _record_call(self, port: int, values: tuple[lang.Expr, ...]) -> None:
        if self.is_wired(port):
            self.entries.append(Output(port, values))

    def _assigning(self, location: lang.Expr, value: lang.Expr, span: Span) -> stmt.Statement:
        if not isinstance(location, lang.Element):
            return self._doing((value,), span, lambda v: self.assign(location, v[0]))
        term, index = term_of(value), term_of(location.index)

        def done(arguments: tuple[lang.Value, ...]) -> lang.Value:
            split = len(term.needs) + 2
            self.left = False
            stored = self.checked(self.bound(term, arguments[:split]), may_leave=True)
            at = self.bound(index, arguments[split:])
            self.assign(replace(location, index=at), stored)
            return OUTSIDE if self.left else INSIDE

        return self._performing(done, (term, index), span)

    def _sending(self, statement: stmt.Send) -> stmt.Statement:
        event, span = self.original.events[statement.event], statement.span
        if statement.destination in (stmt.Destination.INVOKER, stmt.Destination.INVOKED):
            way_out = "make it a machine of its own in a system"
            raise unsupported("invoked machines are not translated", span, way_out)
        if statement.delay is not None:
            return self._delaying(statement)
        match statement.destination:
            case stmt.Destination.INTERNAL:
                number = self._raising(event.index, statement.arguments, span)
                return replace(statement, arguments=(number,))
            case stmt.Destination.SELF:
                return self._doing(
                    statement.arguments,
                    span,
                    lambda values: self.entries.append(QueuedEvent(event.index, values)),
                )
            case _:
                return self._doing(
                    statement.arguments, span, lambda values: self._record_call(event.index, values)
                )

    def _delaying(self, statement: stmt.Send) -> stmt.Statement:
        """Return the statement that arms the timer; its payload is the number of a slot."""
        assert statement.delay is not None  # noqa: S101  (it has one)
        if not isinstance(lang.fold(statement.delay), lang.Literal):
            raise unsupported(
                "this delay is not constant",
                statement.delay.span,
                "send after a constant, one statement for each delay",
            )
        terms = tuple(map(term_of, statement.arguments))
        declared = self.original.events[statement.event]

        def action(arguments: tuple[lang.Value, ...]) -> lang.Value:
            values = self._values(terms, arguments)
            slot = next(n for n in range(FIRST_SLOT, 2 * FIRST_SLOT + 1000) if n not in self.slots)
            self.slots.add(slot)
            self.keep(slot, declared, values)
            return slot

        number = self._call(action, terms, statement.span, NUMBER)
        return replace(statement, arguments=(number,))

    def _unroll(
        self, loop: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement]
    ) -> list[stmt.Statement]:
        """Return the rounds of a loop one after the other.

        A local variable of the loop is replaced by its value in each round.
        """
        array = loop.array
        changed = {root(p).name for inner in statements(loop.body) for p in written(inner)}
        if isinstance(array, lang.Variable) and array.name in changed:
            raise unsupported("this loop changes its array", loop.span, "loop over a copy")
        found: list[stmt.Statement] = []
        for place, item in enumerate(_items(array, loop.span)):
            index = lang.Literal(place, exact(place, place), loop.span)
            local: dict[str, lang.Expr] = {}
            for variable, value in ((loop.item, item), (loop.index, index)):
                if variable is None:
                    continue
                if variable.storage is not lang.Storage.LOCAL:
                    found.append(stmt.Assign(variable, value, loop.span))
                elif variable.name in changed:
                    raise unsupported(
                        f"this loop assigns its variable `{variable.name}`",
                        loop.span,
                        "assign a variable that is declared under `data`",
                    )
                else:
                    local[variable.name] = value
            found += (_with_values(inner, local) for inner in loop.body)
        return list(self._block(tuple(found)))


def _items(array: lang.Iterated, span: Span) -> Iterator[lang.Expr]:
    """Yield the value of the variable of a loop in each round."""
    if isinstance(array, lang.Numbers):
        yield from (lang.Literal(number, array.type, span) for number in array.numbers)
        return
    assert isinstance(array.type, lang.ArrayType)  # noqa: S101  (typed so)
    for place in range(array.type.length):
        yield lang.Element(
            array, lang.Literal(place, exact(place, place), span), array.type.element, span
        )


def _with_values(node: Any, values: Mapping[str, lang.Expr]) -> Any:
    """Return a statement, or a part of one, with local variables replaced by values."""

    def change(expr: lang.Expr) -> lang.Expr | None:
        match expr:
            case lang.Variable(name, _, lang.Storage.LOCAL):
                return values.get(name)
            case _:
                return None

    if node.__class__ in EXPRESSIONS:
        return rewrite(node, change)
    if isinstance(node, tuple):
        return tuple(_with_values(part, values) for part in node)
    held = child_fields(node.__class__)
    if not values or not held:
        return node
    return replace(node, **{name: _with_values(getattr(node, name), values) for name in held})


def _without(expr: lang.Expr, convert: lang.Convert) -> lang.Expr:
    """Return an expression without conversions to a range that the value is in anyway."""
    return rewrite(expr, lambda node: convert.operand if node is convert else None)


def term_of(expr: lang.Expr) -> Term:
    """Return an expression with the values that the interpreter evaluates for it."""
    needs: list[lang.Expr] = []

    def look(node: lang.Expr) -> lang.Expr | None:
        if isinstance(node, lang.InState) or (
            isinstance(node, lang.Call) and node.type is not None
        ):
            needs.append(node if isinstance(node, lang.InState) else replace(node, arguments=()))
            return node
        return None

    rewrite(expr, look)
    inside = list(nodes(expr))
    return Term(
        expr,
        tuple(needs),
        frozenset(node.name for node in inside if isinstance(node, lang.Variable)),
        any(isinstance(node, lang.EventField | lang.EventName | lang.EventType) for node in inside),
    )


def current_event_number(span: Span) -> lang.Expr:
    """Return the expression for the number of the current event."""
    none = lang.Binary(
        lang.BinaryOp.EQ, lang.EventName(span), lang.Literal("", lang.SYMBOL, span), lang.BOOL, span
    )
    return lang.Conditional(
        none, lang.Literal(NOBODY, NUMBER, span), lang.EventField(AT, NUMBER, span), NUMBER, span
    )
