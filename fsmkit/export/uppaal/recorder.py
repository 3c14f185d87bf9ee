"""A chart whose guards are open and whose statements are only noted, and the host that does so.

Each expression of the chart becomes a call of an operation ``#n`` of the `Recorder`, which knows
what stood there; so the reference interpreter decides, unchanged, what is evaluated and in which
order. Configuration, histories, internal queue and timers are its own; data are expressions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from fsmkit.chart.chart import Chart, Data
from fsmkit.chart.content import statements, written
from fsmkit.chart.statements import (
    Assign,
    Block,
    Branch,
    CallOperation,
    Cancel,
    Destination,
    Fail,
    ForEach,
    If,
    Invoke,
    Log,
    Raise,
    Reply,
    Send,
    Statement,
)
from fsmkit.diagnostics import Span
from fsmkit.export.uppaal.entries import FIRST_SLOT, Posted, Told
from fsmkit.export.uppaal.evaluator import (
    AT,
    IGNORED,
    INSIDE,
    INSIDE_TYPE,
    NUMBER,
    OUTSIDE,
    Deed,
    Evaluator,
    Term,
    number_at_hand,
    term_of,
)
from fsmkit.export.uppaal.terms import refuse
from fsmkit.language import (
    BOOL,
    ArrayType,
    Call,
    Convert,
    Element,
    EventName,
    Expr,
    Field,
    Literal,
    Storage,
    Value,
    Variable,
    fold,
)
from fsmkit.language.arithmetic import exact
from fsmkit.language.walk import root


class Recorder(Evaluator):
    """The host of a recording chart, which it makes: notes what a macrostep does."""

    def __init__(
        self,
        chart: Chart,
        results: Mapping[str, tuple[Value, ...]],
        is_wired: Callable[[int], bool],
    ) -> None:
        """Record a chart; ``is_wired`` tells whether anybody hears of a port."""
        super().__init__(chart, results, is_wired)
        self.chart = self._recording(chart)

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
        events = tuple(replace(e, fields=(Field(AT, NUMBER),)) for e in chart.events)
        script = self._block(chart.script)
        span = chart.root.span
        ignored = Data(IGNORED, INSIDE_TYPE, Literal(INSIDE, INSIDE_TYPE, span), span)
        return replace(
            chart,
            states=states,
            transitions=transitions,
            events=events,
            script=script,
            data=(*chart.data, ignored),
        )

    def _guard(self, guard: Expr) -> Expr:
        term = term_of(guard)

        def deed(arguments: tuple[Value, ...]) -> Value:
            return self.test(self.checked(self.bound(term, arguments)))

        return self._call(deed, (term,), guard.span, BOOL)

    def _call(self, deed: Deed, terms: tuple[Term, ...], span: Span, type_: object) -> Call:
        """Return the call that stands for something, with what it asks of the interpreter."""
        self.deeds.append(deed)
        arguments: list[Expr] = []
        for term in terms:
            arguments += [*term.asked, EventName(span), number_at_hand(span)]
        return Call(f"#{len(self.deeds) - 1}", tuple(arguments), type_, span)  # type: ignore[arg-type]

    def _done_data(
        self, chart: Chart, parent: int | None, values: tuple[Expr, ...]
    ) -> tuple[Expr, ...]:
        if not values or parent is None:
            return ()
        event = chart.event_index.get(f"done.state.{chart.states[parent].id}")
        if event is None:
            return ()
        given = values[: len(chart.events[event].fields)]
        return (self._raising(event, given, given[0].span),) if given else ()

    def _raising(self, event: int, values: tuple[Expr, ...], span: Span) -> Call:
        """Return the call that keeps a payload and gives the number of the raised event."""
        terms = tuple(map(term_of, values))
        declared = self.original.events[event]

        def deed(arguments: tuple[Value, ...]) -> Value:
            found = self._values(terms, arguments)
            number = 1 + max((n for n in self.events if n < FIRST_SLOT), default=0)
            self.keep(number, declared, found)
            return number

        return self._call(deed, terms, span, NUMBER)

    def _values(
        self, terms: tuple[Term, ...], arguments: tuple[Value, ...], *, may_leave: bool = False
    ) -> tuple[Expr, ...]:
        found, at = [], 0
        for term in terms:
            end = at + len(term.asked) + 2
            bound = self.bound(term, arguments[at:end])
            found.append(self.checked(bound, may_leave=may_leave))
            at = end
        return tuple(found)

    def _block(self, block: Block) -> Block:
        return tuple(done for statement in block for done in self._statement(statement))

    def _statement(self, statement: Statement) -> list[Statement]:
        match statement:
            case Assign(location, value):
                return [self._assigning(location, value, statement.span)]
            case Raise(event, arguments, span):
                return [replace(statement, arguments=(self._raising(event, arguments, span),))]
            case Send():
                return [self._sending(statement)]
            case Log(_, values, span) | Reply(values, span) if values:
                parts = values if isinstance(values, tuple) else (values,)
                return [self._doing(tuple(parts), span, lambda _: None)]
            case Log():
                return []
            case If(branches):
                return [replace(statement, branches=tuple(map(self._branch, branches)))]
            case ForEach():
                return self._unrolled(statement)
            case CallOperation(call, span):
                port = self.ports[call.operation]
                if call.type is not None:
                    return [self._doing((call,), span, lambda _: None)]
                return [self._doing(call.arguments, span, lambda v: self._tell(port, v))]
            case Cancel() | Fail():
                return [statement]
            case Invoke():
                raise refuse(
                    "invoked machines are not translated",
                    statement.span,
                    "make it a machine of its own in a system",
                )
            case _:
                raise refuse("this is not translated", statement.span, "say it another way")

    def _branch(self, branch: Branch) -> Branch:
        condition = None if branch.condition is None else self._guard(branch.condition)
        return Branch(condition, self._block(branch.body))

    def _doing(
        self, values: tuple[Expr, ...], span: Span, deed: Callable[[tuple[Expr, ...]], None]
    ) -> Statement:
        terms = tuple(map(term_of, values))

        def done(arguments: tuple[Value, ...]) -> Value:
            self.left = False
            deed(self._values(terms, arguments, may_leave=True))
            return OUTSIDE if self.left else INSIDE

        return self._performing(done, terms, span)

    def _performing(self, done: Deed, terms: tuple[Term, ...], span: Span) -> Statement:
        """Return the statement that does something; if it gives `OUTSIDE`, with ``error.range``."""
        if not self.hears_errors:
            return CallOperation(self._call(done, terms, span, None), span)
        value = Convert(self._call(done, terms, span, INSIDE_TYPE), INSIDE_TYPE, span)
        return Assign(Variable(IGNORED, INSIDE_TYPE, Storage.DATA, span), value, span)

    def _tell(self, port: int, values: tuple[Expr, ...]) -> None:
        if self.is_wired(port):
            self.entries.append(Told(port, values))

    def _assigning(self, location: Expr, value: Expr, span: Span) -> Statement:
        if not isinstance(location, Element):
            return self._doing((value,), span, lambda v: self.assign(location, v[0]))
        term, index = term_of(value), term_of(location.index)

        def done(arguments: tuple[Value, ...]) -> Value:
            split = len(term.asked) + 2
            self.left = False
            stored = self.checked(self.bound(term, arguments[:split]), may_leave=True)
            at = self.bound(index, arguments[split:])
            self.assign(replace(location, index=at), stored)
            return OUTSIDE if self.left else INSIDE

        return self._performing(done, (term, index), span)

    def _sending(self, statement: Send) -> Statement:
        event, span = self.original.events[statement.event], statement.span
        if statement.destination in (Destination.INVOKER, Destination.INVOKED):
            way_out = "make it a machine of its own in a system"
            raise refuse("invoked machines are not translated", span, way_out)
        if statement.delay is not None:
            return self._delaying(statement)
        match statement.destination:
            case Destination.INTERNAL:
                number = self._raising(event.index, statement.arguments, span)
                return replace(statement, arguments=(number,))
            case Destination.SELF:
                return self._doing(
                    statement.arguments,
                    span,
                    lambda values: self.entries.append(Posted(event.index, values)),
                )
            case _:
                return self._doing(
                    statement.arguments, span, lambda values: self._tell(event.index, values)
                )

    def _delaying(self, statement: Send) -> Statement:
        """Let the interpreter arm the timer; its payload is the number of a slot."""
        assert statement.delay is not None  # noqa: S101  (asked before)
        if not isinstance(fold(statement.delay), Literal):
            raise refuse(
                "this delay is known only when running",
                statement.delay.span,
                "send after a constant, one statement for each delay",
            )
        terms = tuple(map(term_of, statement.arguments))
        declared = self.original.events[statement.event]

        def deed(arguments: tuple[Value, ...]) -> Value:
            values = self._values(terms, arguments)
            slot = next(n for n in range(FIRST_SLOT, 2 * FIRST_SLOT + 1000) if n not in self.slots)
            self.slots.add(slot)
            self.keep(slot, declared, values)
            return slot

        number = self._call(deed, terms, statement.span, NUMBER)
        return replace(statement, arguments=(number,))

    def _unrolled(self, loop: ForEach) -> list[Statement]:
        """Return the rounds of a loop one after the other."""
        array = loop.array
        assert isinstance(array.type, ArrayType)  # noqa: S101  (typed so)
        changed = (place for inner in statements(loop.body) for place in written(inner))
        if any(root(place).name == array.name for place in changed):
            raise refuse("this loop changes its array", loop.span, "loop over a copy")
        found: list[Statement] = []
        for place in range(array.type.length):
            index = Literal(place, exact(place, place), loop.span)
            item = Element(array, index, array.type.element, loop.span)
            found.append(Assign(loop.item, item, loop.span))
            if loop.index is not None:
                found.append(Assign(loop.index, index, loop.span))
            found += loop.body
        return list(self._block(tuple(found)))
