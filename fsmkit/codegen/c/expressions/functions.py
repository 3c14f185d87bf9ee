"""Functions of the chart as static functions in C.

What fails in one notes so in ``m->fsm.failed``, as an operator does, and the function returns at
once: the expression that called it has failed.
"""

from __future__ import annotations

from typing import Any

from fsmkit.chart.analysis.effects import can_fail, can_stop
from fsmkit.chart.content import functions_called
from fsmkit.chart.statements import Assign, ForEach, If, Local, Return
from fsmkit.codegen.c.expressions.content import loop
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.emit.identifiers import legal
from fsmkit.language import ArrayType, Expr, FunctionBody, Type


def print_functions(out: Unit, names: Names) -> None:
    """Print the functions that the chart calls, each before those that call it."""
    called = functions_called(names.chart)
    for function in names.chart.functions:
        if function.name in called:
            _Function(names, function).print(out)


class _Function:
    def __init__(self, names: Names, function: FunctionBody) -> None:
        self.names, self.function = names, function
        self.printer = Printer(names, is_sound=not can_fail(function.body))
        self.copies: list[tuple[Type, str]] = []

    def print(self, out: Unit) -> None:
        names, function, printer = self.names, self.function, self.printer
        p, records = names.own, names.records
        machine = f"{p} *m" if can_stop(function.body) else f"const {p} *m"
        taken = [machine]
        for number, parameter in enumerate(function.parameters):
            name = printer.locals[parameter.name] = f"of_{number}_{legal(parameter.name)}"
            ctype = storage(parameter.type, records).text
            is_array = isinstance(parameter.type, ArrayType)
            taken.append(f"const {ctype} *{name}" if is_array else f"{ctype} {name}")
        body = Emitter()
        self._statements(body, function.body)
        result = storage(function.result, records).text
        called = f"{p}_{names.functions[function.name]}"
        out.define(called)
        out.line(f"/* {comment(function.name)} */")
        out.line(f"static {result} {called}({', '.join(taken)})")
        with out.block("{"):
            out.lines(f"{ctype} {name};" for ctype, name in printer.temporaries)
            if not printer.reads_machine:
                out.line("(void)m;")
            out.lines(f"(void){printer.locals[part.name]};" for part in function.parameters)
            out.lines(body.collected())
        out.line()

    def _check(self, out: Emitter, *expressions: Expr) -> None:
        if any(map(can_fail, expressions)):
            with out.block("if (m->fsm.failed != FSM_FINE) {"):
                zero = storage(self.function.result, self.names.records).text
                out.line("return false;" if zero == "bool" else f"return ({zero})0;")

    def _statements(self, out: Emitter, body: tuple[Any, ...]) -> None:
        for statement in body:
            self._statement(out, statement)

    def _statement(self, out: Emitter, statement: Any) -> None:
        printer = self.printer
        match statement:
            case Local(place, value) if value is not None:
                text = printer.value(value, place.type)
                name = printer.local(place)
                out.lines([f"{name} = {text};", f"(void){name};"])
                self._check(out, value)
            case Assign(location, value):
                out.line(f"{printer.place(location)} = {printer.value(value, location.type)};")
                self._check(out, value)
            case If():
                self._if(out, statement)
            case ForEach():
                with loop(out, statement, printer, self.names, self.copies):
                    self._statements(out, statement.body)
            case Return(value):
                out.line(f"return {printer.value(value, self.function.result)};")
            case _:
                raise AssertionError(statement)

    def _if(self, out: Emitter, statement: If[Any, Any]) -> None:
        depth = 0
        for number, branch in enumerate(statement.branches):
            if number:
                out.turn("} else {")
            if branch.condition is None:
                self._statements(out, branch.body)
                break
            condition = self.printer.condition(branch.condition)
            if can_fail(branch.condition):
                if not depth:
                    out.open()
                    depth += 1
                name = f"holds_{number}"
                out.line(f"const bool {name} = {condition};")
                self._check(out, branch.condition)
                condition = name
            out.open(f"if ({condition}) {{")
            depth += 1
            self._statements(out, branch.body)
        for _ in range(depth):
            out.close()
