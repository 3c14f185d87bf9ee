"""Functions of charts in the conditions of properties, as functions in C.

What cannot be evaluated in one is told to the condition that called it. An array or a record that
is passed is that variable itself: for each there is a function of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import fsmkit.language as lang
from fsmkit.chart.statements import Assign, ForEach, If, Local, Return
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.emit import Emitter, legal
from fsmkit.emit.c import comment
from fsmkit.language.evaluation import iteration_count


class Printer(Protocol):
    """Prints the conditions in which functions are called, and what the functions evaluate."""

    names: Names
    temporaries: list[tuple[str, str]]

    def value(self, expr: lang.Expr, type_: lang.Type | None = None) -> str:
        """Return an expression as a value of a type is stored."""

    def condition(self, expr: lang.Expr) -> str:
        """Return an expression as a condition."""

    def place(self, expr: lang.Expr) -> str:
        """Return the C text of a variable."""

    def inside(self, names: Mapping[str, str]) -> Printer:
        """Return a printer for the body of a function, which has names of its own."""


@dataclass(slots=True)
class Helpers:
    """The functions of one condition. ``machines``: the C parameters by which it has these."""

    prefix: str
    machines: Mapping[str, str]
    out: Emitter
    known: dict[tuple[lang.FunctionBody, tuple[tuple[str, str], ...]], str] = field(
        default_factory=dict
    )

    def call(self, expr: lang.CallFunction, printer: Printer) -> str:
        """Return the call of a function, which is printed where it is not there yet."""
        passed: list[str] = []
        held: dict[str, str] = {}
        for parameter, argument in zip(expr.function.parameters, expr.arguments, strict=True):
            if not isinstance(parameter.type, lang.ArrayType | lang.RecordType):
                passed.append(printer.value(argument, parameter.type))
            elif isinstance(argument, lang.Variable):
                held[parameter.name] = printer.place(argument)
            else:
                raise _unexplored(expr.function)
        key = expr.function, tuple(held.items())
        if key not in self.known:
            lines = self._printed(expr.function, held, printer)  # those it calls come first
            name = f"{self.prefix}_{len(self.known)}"
            self.known[key] = name
            self.out.line(f"/* {comment(expr.function.name)} */")
            self.out.line(lines[0].replace("()", f"{name}(", 1))
            self.out.lines([*lines[1:], ""])
        return f"{self.known[key]}({', '.join([*self.machines, '&failed', *passed])})"

    def _printed(
        self, function: lang.FunctionBody, held: Mapping[str, str], printer: Printer
    ) -> tuple[str, ...]:
        """Return the lines of a function, which has no name yet."""
        locals_, records = dict(held), printer.names.records
        taken = [f"{ctype} {name}" for name, ctype in self.machines.items()]
        taken.append("uint8_t *reported")
        for parameter in function.parameters:
            if parameter.name not in held:
                name = locals_[parameter.name] = f"v_{legal(parameter.name)}"
                taken.append(f"{storage(parameter.type, records).text} {name}")
        body = _Body(function, printer.inside(locals_), locals_, Emitter())
        body.statements(function.body)
        out = Emitter()
        out.line(f"static {storage(function.result, records).text} (){', '.join(taken)})")
        with out.block("{"):
            out.line("uint8_t failed = FSM_FINE;")
            out.lines(f"{ctype} {name};" for ctype, name in body.printer.temporaries)
            out.lines(f"(void){name};" for name in self.machines)
            out.lines(body.out.collected())
        return out.collected()


@dataclass(slots=True)
class _Body:
    """Prints the statements of one function."""

    function: lang.FunctionBody
    printer: Printer
    names: dict[str, str]
    out: Emitter
    loops: int = 0

    def statements(self, body: tuple[Any, ...]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, statement: Any) -> None:
        out, printer = self.out, self.printer
        match statement:
            case Local(place, value) if value is not None:
                self._declare(place, printer.value(value, place.type))
                self._check()
            case Assign(lang.Variable(name, type_), value) if name in self.names:
                out.line(f"{self.names[name]} = {printer.value(value, type_)};")
                self._check()
            case If(branches):
                self._if(branches)
            case ForEach():
                self._loop(statement)
            case Return(value):
                with out.block("{"):
                    text = printer.value(value, self.function.result)
                    out.line(f"const {self._ctype(self.function.result)} result = {text};")
                    self._check()
                    out.line("return result;")
            case _:
                raise _unexplored(self.function)

    def _ctype(self, type_: lang.Type) -> str:
        return storage(type_, self.printer.names.records).text

    def _check(self) -> None:
        with self.out.block("if (failed != FSM_FINE) {"):
            self.out.lines(["*reported = failed;", "return 0;"])

    def _declare(self, place: lang.Variable, value: str) -> None:
        if isinstance(place.type, lang.ArrayType | lang.RecordType):
            raise _unexplored(self.function)
        name = self.names[place.name] = f"v_{legal(place.name)}"
        self.out.lines([f"{self._ctype(place.type)} {name} = {value};", f"(void){name};"])

    def _if(self, branches: tuple[Any, ...]) -> None:
        if not branches:
            return
        first, *others = branches
        if first.condition is None:
            self.statements(first.body)
            return
        out = self.out
        with out.block("{"):
            out.line(f"const bool holds = {self.printer.condition(first.condition)};")
            self._check()
            with out.block("if (holds) {"):
                self.statements(first.body)
            with out.block("else {"):
                self._if(tuple(others))

    def _loop(self, loop: ForEach[Any, Any, Any]) -> None:
        self.loops += 1
        out, at, array = self.out, f"at_{self.loops}", loop.array
        with out.block("{"):
            if isinstance(array, lang.Numbers):
                numbers = ", ".join(f"INT64_C({number})" for number in array.numbers)
                out.line(f"static const fsm_value in_{at}[] = {{{numbers}}};")
                value = f"({self._ctype(loop.item.type)})in_{at}[{at}]"
            else:
                value = f"{self.printer.place(array)}[{at}]"
            with out.block(f"for (uint32_t {at} = 0u; {at} < {iteration_count(loop)}u; {at}++) {{"):
                self._declare(loop.item, value)
                if loop.index is not None:
                    self._declare(loop.index, f"({self._ctype(loop.index.type)}){at}")
                self.statements(loop.body)


def _unexplored(function: lang.FunctionBody) -> FsmkitError:
    return fail(
        "not-explored-yet",
        f"`{function.name}` has arrays or records of its own, which conditions in C cannot have",
        function.span,
        help="use `--engine python`",
    )
