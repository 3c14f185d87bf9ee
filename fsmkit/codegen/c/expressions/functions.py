"""Functions of the chart as static functions in C.

A failure inside one sets ``m->fsm.failed``, as an operator does. The function then returns
immediately, and the expression that called it has failed.
"""

from __future__ import annotations

from fsmkit.chart.analysis.effects import can_fail, can_stop
from fsmkit.chart.content import functions_called
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit.c import comment
from fsmkit.emit.identifiers import legal
from fsmkit.language import ArrayType, Expr, FunctionBody, Location


def print_functions(out: Unit, names: Names) -> None:
    """Print the functions that the chart calls, each before those that call it."""
    called = functions_called(names.chart)
    for function in names.chart.functions:
        if function.name in called:
            _Function(names, function).print(out)


class _Function(ContentPrinter):
    """Prints one function: the statements of content, but with returns."""

    def __init__(self, names: Names, function: FunctionBody) -> None:
        super().__init__(names, Unit())
        self.function, self.result = function, function.result
        zero = storage(function.result, names.records).text
        self._leave = "return false;" if zero == "bool" else f"return ({zero})0;"

    def print(self, out: Unit) -> None:
        names, function = self._names, self.function
        self.printer = printer = Printer(names, is_sound=not can_fail(function.body))
        p, records = names.own, names.records
        machine = f"{p} *m" if can_stop(function.body) else f"const {p} *m"
        taken = [machine]
        for number, parameter in enumerate(function.parameters):
            name = printer.locals[parameter.name] = f"of_{number}_{legal(parameter.name)}"
            ctype = storage(parameter.type, records).text
            is_array = isinstance(parameter.type, ArrayType)
            taken.append(f"const {ctype} *{name}" if is_array else f"{ctype} {name}")
        self.statements(function.body)
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
            out.lines(self.out.collected())
        out.line()

    def _assign(self, location: Location, value: Expr) -> None:
        text = self.printer.value(value, location.type)
        self.out.line(f"{self.printer.place(location)} = {text};")
        self._check(value)

    def _held(self, condition: str) -> str:
        self._conditions += 1
        self.out.line(f"const bool holds_{self._conditions} = {condition};")
        return f"holds_{self._conditions}"
