"""Executable content as methods of a model."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.codegen.python.content import ContentPrinter, Needs
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.statements import Loop
from fsmkit.codegen.transitions.expressions import ModelPrinter
from fsmkit.codegen.transitions.names import ModelNames, text
from fsmkit.language import Expr, Location, Variable

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
"""The statements that a model supports; charts with others are rejected."""


def has_peer(chart: Chart, event: int) -> bool:
    """Whether the host receives the target of an event: some send specifies one."""
    sent = (each for each in all_statements(chart) if isinstance(each, stmt.Send))
    return any(each.event == event and each.peer is not None for each in sent)


class ModelContentPrinter(ContentPrinter):
    """Prints statements of one chart as Python does, except calls of the model."""

    def __init__(self, chart: Chart, model: ModelNames) -> None:
        """Print the content of a chart under the names of its model."""
        super().__init__(chart, model.names, Needs())

    def handler(self, out: Lines, block: stmt.Block, printer: ModelPrinter) -> None:
        """Print the statements of a handler."""
        self.out, self.printer = out, printer
        self.statements(block)

    def _assign(self, location: Location, value: Expr) -> None:
        self._set(location, self.printer.print(value))

    def _raise(self, event: int, arguments: tuple[Expr, ...]) -> None:
        self.out.line(f"self.trigger({self._triggered(event, arguments)})")

    def _triggered(self, event: int, arguments: tuple[Expr, ...]) -> str:
        return ", ".join(
            (text(self.chart.events[event].name), *map(self.printer.frozen, arguments))
        )

    def _send(self, statement: stmt.Send) -> None:
        if statement.destination is stmt.Destination.PORT:
            called = f"self.send_{self.names.events[statement.event]}"
            passed = self._argument_list(statement.arguments)
            if has_peer(self.chart, statement.event):
                peer = "None" if statement.peer is None else text(statement.peer)
                passed = f"{passed}, {peer}" if passed else peer
        else:
            called, passed = "self.trigger", self._triggered(statement.event, statement.arguments)
        if statement.delay is None:
            self.out.line(f"{called}({passed})")
            return
        name = "None" if statement.id is None else text(statement.id)
        rest = f", {passed}" if passed else ""
        self.out.line(
            f"self.machine.arm({name}, {self.printer.print(statement.delay)}, {called}{rest})"
        )

    def _cancel(self, name: str) -> None:
        self.out.line(f"self.machine.disarm({text(name)})")

    def _log(self, label: str, values: tuple[Expr, ...]) -> None:
        passed = [text(label), *map(self.printer.frozen, values)]
        self.out.line(f"self.log({', '.join(passed)})")

    def _condition(self, condition: Expr) -> str:
        return self.printer.print(condition)

    @contextmanager
    def _loop(self, statement: Loop) -> Iterator[tuple[str, str]]:
        assert isinstance(statement.array, Variable)  # noqa: S101  (others are rejected)
        array = self.printer.print(statement.array)
        with self.out.suite(f"for at, item in enumerate(tuple({array})):"):
            yield "item", "at"
