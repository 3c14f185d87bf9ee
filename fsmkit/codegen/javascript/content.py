"""Executable content as JavaScript."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.chart import Chart, Transition
from fsmkit.codegen.javascript.expressions import Printer
from fsmkit.codegen.statements import Choice, Loop, StatementPrinter
from fsmkit.emit import Emitter, legal
from fsmkit.emit.javascript import member, quoted
from fsmkit.language.evaluation import field_position
from fsmkit.plan.features import payload_of

ROUTES = {
    stmt.Destination.SELF: "rt.SELF",
    stmt.Destination.INTERNAL: "rt.INTERNAL",
    stmt.Destination.PORT: "rt.PORT",
    stmt.Destination.INVOKER: "rt.INVOKER",
    stmt.Destination.INVOKED: "rt.INVOKED",
}


def of_transition(chart: Chart, printer: Printer, transition: Transition) -> Printer:
    """Return the printer of a transition's guard and content."""
    payload = payload_of(chart, transition)
    if payload is None:
        return printer
    fields = {chart.events[event].fields for event in transition.events}
    return replace(printer, payload=payload) if len(fields) == 1 else printer


class ContentPrinter(StatementPrinter):
    """Prints blocks of one chart, as bodies of functions of the machine `m`."""

    def __init__(self, chart: Chart, out: Emitter, printer: Printer) -> None:
        """Print the content of a chart to ``out``, its expressions by ``printer``."""
        self.chart, self.out, self.printer = chart, out, printer
        self.result: lang.Type | None = None
        """The result type of the printed function of the chart, or None."""

    def for_transition(self, transition: Transition) -> ContentPrinter:
        """Return the printer of a transition's content."""
        printer = of_transition(self.chart, self.printer, transition)
        return ContentPrinter(self.chart, self.out, printer)

    def statements(self, block: stmt.Block) -> None:
        """Print statements; those after a local variable can use it."""
        outer = self.printer
        super().statements(block)
        self.printer = outer

    def _local(self, variable: lang.Variable, value: lang.Expr) -> None:
        text = self.printer.print(value, variable.type)
        self._declare(variable)
        self.out.line(f"let {self.printer.print(variable)} = {text};")

    def _declare(self, *variables: lang.Variable | None) -> None:
        """Declare local variables for the statements that follow."""
        known = dict(self.printer.locals)
        for variable in variables:
            if variable is not None and variable.storage is lang.Storage.LOCAL:
                known[variable.name] = f"let{len(known)}_{legal(variable.name)}"
        self.printer = replace(self.printer, locals=known)

    def function(self, function: lang.FunctionBody) -> None:
        """Print a function of the chart."""
        self._declare(*function.parameters)
        self.result = function.result
        passed = [self.printer.locals[parameter.name] for parameter in function.parameters]
        name = self.printer.functions[function.name]
        with self.out.block(f"function {name}({', '.join(('m', *passed))}) {{"):
            self.statements(function.body)
        self.out.line()

    def _raise(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        self.out.line(f"m._raise({event}, {self.payload(event, arguments)});")

    def _cancel(self, name: str) -> None:
        self.out.line(f"m._cancel({quoted(name)});")

    def _log(self, label: str, values: tuple[lang.Expr, ...]) -> None:
        texts = ", ".join(self.printer.print(value) for value in values)
        self.out.line(f"m._log({quoted(label)}, [{texts}]);")

    def _return(self, value: lang.Expr) -> None:
        self.out.line(f"return {self.printer.print(value, self.result)};")

    def _reply(self, value: lang.Expr) -> None:
        self.out.line(f"m._reply({self.printer.print(value)});")

    def _call(self, call: lang.Call) -> None:
        self.out.line(f"{self.printer.print(call)};")

    def _fail(self, reason: str, *, is_raised: bool) -> None:
        self.out.line(f"rt.{'endOfBlock' if is_raised else 'cannot'}({quoted(reason)});")

    def payload(self, event: int, arguments: tuple[lang.Expr, ...]) -> str:
        """Return an array with the values of an event's fields."""
        return self._values(arguments, self.chart.events[event].fields)

    def _values(self, arguments: tuple[lang.Expr, ...], fields: tuple[lang.Field, ...]) -> str:
        pairs = zip(arguments, fields, strict=True)
        texts = ", ".join(self.printer.print(argument, part.type) for argument, part in pairs)
        return f"[{texts}]"

    def _assign(self, location: lang.Location, value: lang.Expr) -> None:
        text = self.printer.print(value, location.type)
        if isinstance(location, lang.Variable):
            self.out.line(f"{self.printer.print(location)} = {text};")
            return
        with self.out.block("{"):
            self.out.line(f"const value = {text};")
            self._store(location, "value")

    def _store(self, location: lang.Location, value: str) -> None:
        """Print the assignment of a copy of a variable's value with one part replaced."""
        match location:
            case lang.Variable():
                self.out.line(f"{self.printer.print(location)} = {value};")
            case lang.Element(array):
                held = self.printer.print(array)
                at = self.printer.index(location)
                self.out.line(f"{held} = rt.changed({held}, {at}, {value});")
            case lang.Member(record, name):
                assert isinstance(record, lang.Variable | lang.Element | lang.Member)  # noqa: S101
                held = self.printer.print(record)
                at = str(field_position(record.type, name))
                self._store(record, f"rt.changed({held}, {at}, {value})")
            case _:
                assert_never(location)

    def _send(self, statement: stmt.Send) -> None:
        event = statement.event
        payload = self.payload(event, statement.arguments)
        peer = "null" if statement.peer is None else quoted(statement.peer)
        slots = f"[{', '.join(map(str, statement.invocations))}]"
        if statement.delay is not None:
            mark = "null" if statement.id is None else quoted(statement.id)
            delay = self._ticks(statement.delay)
            rest = f"{delay}, {mark}, {ROUTES[statement.destination]}, {slots}, {peer}"
            self.out.line(f"m._delay({event}, {payload}, {rest});")
            return
        match statement.destination:
            case stmt.Destination.SELF:
                text = f"m._sendOwn({event}, {payload});"
            case stmt.Destination.INTERNAL:
                text = f"m._raise({event}, {payload});"
            case stmt.Destination.PORT:
                text = f"m._emit({event}, {payload}, {peer});"
            case stmt.Destination.INVOKER:
                text = f"m._answer({event}, {payload});"
            case stmt.Destination.INVOKED:
                text = f"m._hand({slots}, {event}, {payload}, {peer});"
            case _:
                assert_never(statement.destination)
        self.out.line(text)

    def _ticks(self, delay: lang.Expr) -> str:
        text = self.printer.print(delay)
        return f"Number({text})" if self.printer.is_big(delay.type) else text

    def _if(self, statement: Choice) -> None:
        out = self.out
        for place, branch in enumerate(statement.branches):
            opening = "if (true) {"
            if branch.condition is not None:
                opening = f"if ({self._condition(branch.condition)}) {{"
            elif place:
                opening = "{"
            if place:
                out.turn(f"}} else {opening}")
            else:
                out.open(opening)
            self.statements(branch.body)
        out.close("}")

    def _condition(self, condition: lang.Expr) -> str:
        text = self.printer.print(condition)
        is_handled = can_fail(condition) and self.result is None
        return f"m._holds(() => {text})" if is_handled else text

    @contextmanager
    def _loop(self, statement: Loop) -> Iterator[tuple[str, str]]:
        array, item, index, outer = statement.array, statement.item, statement.index, self.printer
        self._declare(item, index)
        printer, over, element = self.printer, "", "element"
        if not isinstance(array, lang.Numbers):
            assert isinstance(array.type, lang.ArrayType)  # noqa: S101
            over = printer.print(array)
            element = printer.moved("element", array.type.element, item.type)
        elif not array.is_counted:
            over = f"[{', '.join(map(str, array.numbers))}]"
        else:
            first = array.numbers[0]
            element = f"at + {first}" if first >= 0 else f"at - {-first}"
            if printer.is_big(item.type):
                element = f"BigInt(at) + ({first}n)"
        head = f"for (const [at, element] of {over}.entries()) {{"
        if isinstance(array, lang.Numbers) and array.is_counted:
            head = f"for (let at = 0; at < {len(array.numbers)}; at++) {{"
        is_big = index is not None and printer.is_big(index.type)
        with self.out.block(head):
            yield element, "BigInt(at)" if is_big else "at"
        self.printer = outer

    def _set(self, variable: lang.Variable, text: str) -> None:
        word = "let " if variable.storage is lang.Storage.LOCAL else ""
        self.out.line(f"{word}{self.printer.print(variable)} = {text};")

    def _invoke(self, slot: int, arguments: tuple[lang.Expr, ...]) -> None:
        invocation = self.chart.invocations[slot]
        given = [invocation.chart.data[place] for place in invocation.given]
        fields = tuple(lang.Field(data.name, data.type) for data in given)
        with self.out.block("{"):
            self.out.line(f"const given = {self._values(arguments, fields)};")
            with self.out.block(f"m._invoke({slot}, (child) => {{", "});"):
                for place, data in enumerate(given):
                    self.out.line(f"child.data{member(data.name)} = given[{place}];")
