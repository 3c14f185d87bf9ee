"""Executable content as JavaScript."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.chart import Chart, Transition
from fsmkit.codegen.javascript.expressions import Printer
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
    """Return what prints guard and content of a transition."""
    payload = payload_of(chart, transition)
    if payload is None:
        return printer
    fields = {chart.events[event].fields for event in transition.events}
    return replace(printer, payload=payload) if len(fields) == 1 else printer


@dataclass(frozen=True, slots=True)
class ContentPrinter:
    """Prints blocks of one chart, as bodies of functions of the machine `m`."""

    chart: Chart
    out: Emitter
    printer: Printer
    result: lang.Type | None = None
    """Of the function of the chart in which the statements are."""

    def of(self, transition: Transition) -> ContentPrinter:
        """Return what prints the content of a transition."""
        return replace(self, printer=of_transition(self.chart, self.printer, transition))

    def block(self, block: stmt.Block) -> None:
        """Print statements; those behind a local variable know it."""
        printer = self
        for statement in block:
            if isinstance(statement, stmt.Local):
                printer = printer.declared(statement)
            else:
                printer.statement(statement)

    def declared(self, statement: stmt.Local[lang.Variable, lang.Expr]) -> ContentPrinter:
        """Print a local variable; return what prints the statements behind it."""
        assert statement.value is not None  # noqa: S101  (typed so)
        text = self.printer.print(statement.value, statement.place.type)
        inner = self.knowing(statement.place)
        self.out.line(f"let {inner.printer.print(statement.place)} = {text};")
        return inner

    def knowing(self, *variables: lang.Variable | None) -> ContentPrinter:
        """Return what prints statements that know some more local variables."""
        known = dict(self.printer.locals)
        for variable in variables:
            if variable is not None and variable.storage is lang.Storage.LOCAL:
                known[variable.name] = f"let{len(known)}_{legal(variable.name)}"
        return replace(self, printer=replace(self.printer, locals=known))

    def function(self, function: lang.FunctionBody) -> None:
        """Print a function of the chart."""
        inner = self.knowing(*function.parameters)
        passed = [inner.printer.locals[parameter.name] for parameter in function.parameters]
        name = self.printer.functions[function.name]
        inner = replace(inner, result=function.result)
        with self.out.block(f"function {name}({', '.join(('m', *passed))}) {{"):
            inner.block(function.body)
        self.out.line()

    def statement(self, statement: stmt.Statement) -> None:
        """Print a statement that declares no variable."""
        out, printer = self.out, self.printer
        match statement:
            case stmt.Assign(location, value):
                self._assign(location, value)
            case stmt.Raise(event, arguments):
                out.line(f"m._raise({event}, {self.payload(event, arguments)});")
            case stmt.Send():
                self._send(statement)
            case stmt.Cancel(name):
                out.line(f"m._cancel({quoted(name)});")
            case stmt.Log(label, values):
                texts = ", ".join(printer.print(value) for value in values)
                out.line(f"m._log({quoted(label)}, [{texts}]);")
            case stmt.If():
                self._if(statement)
            case stmt.ForEach():
                self._for_each(statement)
            case stmt.Return(value):
                out.line(f"return {printer.print(value, self.result)};")
            case stmt.Local():
                raise AssertionError(statement)  # `block` knows what follows it
            case stmt.Reply(value):
                out.line(f"m._reply({printer.print(value)});")
            case stmt.CallOperation(call):
                out.line(f"{printer.print(call)};")
            case stmt.Fail(reason, is_raised=is_raised):
                out.line(f"rt.{'endOfBlock' if is_raised else 'cannot'}({quoted(reason)});")
            case stmt.Invoke(slot, arguments):
                self._invoke(slot, arguments)
            case _:
                assert_never(statement)

    def payload(self, event: int, arguments: tuple[lang.Expr, ...]) -> str:
        """Return an array of the values of the fields of an event."""
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
        """Print how a variable gets a copy of what it holds, with another part."""
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

    def _if(self, statement: stmt.If[lang.Expr, stmt.Statement]) -> None:
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
            self.block(branch.body)
        out.close("}")

    def _condition(self, condition: lang.Expr) -> str:
        text = self.printer.print(condition)
        is_handled = can_fail(condition) and self.result is None
        return f"m._holds(() => {text})" if is_handled else text

    def _for_each(
        self, statement: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement]
    ) -> None:
        inner = self.knowing(statement.item, statement.index)
        printer = inner.printer
        if isinstance(statement.array, lang.Numbers):
            inner.count(statement, statement.array)
            return
        array = statement.array.type
        assert isinstance(array, lang.ArrayType)  # noqa: S101
        with self.out.block(
            f"for (const [at, element] of {printer.print(statement.array)}.entries()) {{"
        ):
            item = statement.item
            text = printer.moved("element", array.element, item.type)
            inner.set(item, text)
            if statement.index is not None:
                big = printer.is_big(statement.index.type)
                inner.set(statement.index, "BigInt(at)" if big else "at")
            inner.block(statement.body)

    def count(
        self,
        statement: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement],
        array: lang.Numbers,
    ) -> None:
        """Print a loop over numbers."""
        out, big = self.out, self.printer.is_big(statement.item.type)
        first = array.numbers[0]
        if array.is_counted:
            head = f"for (let at = 0; at < {len(array.numbers)}; at++) {{"
            text = f"at + {first}" if first >= 0 else f"at - {-first}"
            if big:
                text = f"BigInt(at) + ({first}n)"
        else:
            listed = ", ".join(map(str, array.numbers))
            head = f"for (const [at, element] of [{listed}].entries()) {{"
            text = "element"
        with out.block(head):
            self.set(statement.item, text)
            if statement.index is not None:
                is_big = self.printer.is_big(statement.index.type)
                self.set(statement.index, "BigInt(at)" if is_big else "at")
            self.block(statement.body)

    def set(self, variable: lang.Variable, text: str) -> None:
        """Print how a loop variable gets its value; a local one is declared so."""
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
