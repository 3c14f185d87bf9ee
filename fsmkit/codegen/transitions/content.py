"""Executable content as methods of a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.transitions.expressions import ModelPrinter
from fsmkit.codegen.transitions.names import ModelNames, text
from fsmkit.language import ArrayType, Element, Expr, Iterated, Member, RecordType, Variable
from fsmkit.language.evaluation import field_position

PRINTED: tuple[type[Any], ...] = (
    stmt.Assign,
    stmt.Raise,
    stmt.Send,
    stmt.Cancel,
    stmt.Log,
    stmt.If,
    stmt.ForEach,
    stmt.CallOperation,
)
"""The statements that a model can have; all others are refused."""


def has_peer(chart: Chart, event: int) -> bool:
    """Whether the host is told to whom an event goes: somewhere the chart says it."""
    sent = (each for each in all_statements(chart) if isinstance(each, stmt.Send))
    return any(each.event == event and each.peer is not None for each in sent)


@dataclass(frozen=True, slots=True)
class ContentPrinter:
    """Prints statements of one chart, of those that are not refused."""

    chart: Chart
    names: ModelNames

    def block(self, out: Lines, block: stmt.Block, printer: ModelPrinter) -> None:
        """Print the statements of a handler."""
        for statement in block:
            self._statement(out, statement, printer)

    def _statement(self, out: Lines, statement: stmt.Statement, printer: ModelPrinter) -> None:
        match statement:
            case stmt.Assign(location, value):
                self._assign(out, location, printer.print(value), printer)
            case stmt.Raise(event, arguments):
                out.line(self._trigger(event, arguments, printer))
            case stmt.Send(delay=delay) if delay is not None:
                out.line(self._later(statement, delay, printer))
            case stmt.Cancel(name):
                out.line(f"self.machine.disarm({text(name)})")
            case stmt.Send(event, arguments, stmt.Destination.INTERNAL):
                out.line(self._trigger(event, arguments, printer))
            case stmt.Send():
                out.line(f"{self._port(statement)}({', '.join(self._sent(statement, printer))})")
            case stmt.Log(label, values):
                passed = [text(label), *(printer.frozen(value) for value in values)]
                out.line(f"self.log({', '.join(passed)})")
            case stmt.If():
                self._if(out, statement, printer)
            case stmt.ForEach():
                self._for_each(out, statement, printer)
            case stmt.CallOperation(call):
                out.line(printer.print(call))
            case _:
                raise AssertionError(statement)

    def _port(self, statement: stmt.Send) -> str:
        return f"self.send_{self.names.names.events[statement.event]}"

    def _sent(self, statement: stmt.Send, printer: ModelPrinter) -> list[str]:
        passed = [printer.frozen(argument) for argument in statement.arguments]
        if has_peer(self.chart, statement.event):
            passed.append("None" if statement.peer is None else text(statement.peer))
        return passed

    def _later(self, statement: stmt.Send, delay: Expr, printer: ModelPrinter) -> str:
        name = "None" if statement.id is None else text(statement.id)
        if statement.destination is stmt.Destination.PORT:
            call = [self._port(statement), *self._sent(statement, printer)]
        else:
            passed = (printer.frozen(argument) for argument in statement.arguments)
            call = ["self.trigger", text(self.chart.events[statement.event].name), *passed]
        return f"self.machine.arm({', '.join((name, printer.print(delay), *call))})"

    def _trigger(self, event: int, arguments: tuple[Expr, ...], printer: ModelPrinter) -> str:
        passed = [text(self.chart.events[event].name), *(printer.frozen(a) for a in arguments)]
        return f"self.trigger({', '.join(passed)})"

    def _assign(self, out: Lines, location: Expr, value: str, printer: ModelPrinter) -> None:
        where = self._place(location, printer)
        if isinstance(location.type, ArrayType | RecordType):
            out.line(f"replace({where}, {value})")
        else:
            out.line(f"{where} = {value}")

    def _place(self, location: Expr, printer: ModelPrinter) -> str:
        match location:
            case Variable(name):
                return f"self.{self.names.names.variables[name]}"
            case Element(array):
                return f"{self._place(array, printer)}[{printer.index(location)}]"
            case Member(record, name):
                return f"{self._place(record, printer)}[{field_position(record.type, name)}]"
            case _:
                raise AssertionError(location)

    def _if(
        self, out: Lines, statement: stmt.If[Expr, stmt.Statement], printer: ModelPrinter
    ) -> None:
        for number, branch in enumerate(statement.branches):
            word = "elif" if number else "if"
            condition = "True" if branch.condition is None else printer.print(branch.condition)
            is_else = branch.condition is None and number
            with out.suite("else:" if is_else else f"{word} {condition}:"):
                self.block(out, branch.body, printer)

    def _for_each(
        self,
        out: Lines,
        statement: stmt.ForEach[Iterated, Variable, stmt.Statement],
        printer: ModelPrinter,
    ) -> None:
        assert isinstance(statement.array, Variable)  # noqa: S101  (others are refused)
        with out.suite(f"for at, item in enumerate(tuple({printer.print(statement.array)})):"):
            self._assign(out, statement.item, "item", printer)
            if statement.index is not None:
                self._assign(out, statement.index, "at", printer)
            self.block(out, statement.body, printer)
