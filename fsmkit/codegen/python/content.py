"""Executable content as Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import assert_never

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_break_off, can_fail
from fsmkit.chart.chart import Chart
from fsmkit.chart.content import written
from fsmkit.chart.forms import form
from fsmkit.codegen.python.expressions import Printer, spell
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.names import Names
from fsmkit.emit.identifiers import legal
from fsmkit.emit.python import quoted
from fsmkit.language.evaluation import field_position
from fsmkit.language.statements.tree import statements
from fsmkit.language.walk import root

ROUTES = {
    stmt.Destination.SELF: 0,
    stmt.Destination.INTERNAL: 1,
    stmt.Destination.PORT: 2,
    stmt.Destination.INVOKER: 3,
    stmt.Destination.INVOKED: 4,
}
"""Of delayed sends. To invoked machines: this and the number of their `Needs.addresses`."""

ALIKE = frozenset(
    {stmt.Assign, stmt.Raise, stmt.Send, stmt.Cancel, stmt.Log, stmt.CallOperation, stmt.Reply}
)
"""Statements whose text depends on nothing but their form and the payload at hand."""


@dataclass
class Needs:
    """What the content of a chart asks the class to hold besides."""

    raised: set[int] = field(default_factory=set)
    sent: set[int] = field(default_factory=set)
    emitted: set[int] = field(default_factory=set)
    delayed: set[int] = field(default_factory=set)
    marks: dict[str, int] = field(default_factory=dict)
    """Ids of delayed sends."""
    conditions: list[str] = field(default_factory=list)
    """Texts of conditions in content that can fail."""
    passed: set[int] = field(default_factory=set)
    """Sent to invoked machines."""
    answered: set[int] = field(default_factory=set)
    """Sent to the invoker."""
    addresses: list[tuple[int, ...]] = field(default_factory=list)
    """Slots of invoked machines that delayed sends go to."""
    copies: list[int] = field(default_factory=list)
    """Lengths of the arrays that are iterated over."""
    is_covered: bool = False
    """What tests reach is counted."""


@dataclass
class ContentPrinter:
    """Prints blocks of one chart."""

    chart: Chart
    names: Names
    needs: Needs
    loops: int = 0
    """Loops over numbers that were printed."""
    _printed: dict[tuple[int, object], tuple[str, ...]] = field(default_factory=dict)
    """What was printed of a block of the chart, by its identity and the payload at hand."""
    _alike: dict[tuple[int, object], tuple[str, ...]] = field(default_factory=dict)
    """The same by its form."""

    def blocks(
        self, out: Lines, blocks: tuple[stmt.Block, ...], payload: Mapping[str, int] | None
    ) -> None:
        """Print handlers one after the other: an error in one ends only that.

        Handlers of states are printed once, wherever they stand.
        """
        for block in blocks:
            key = id(block), None if payload is None else tuple(payload.items())
            if key not in self._printed:
                once = Lines(is_traced=out.is_traced, is_recorded=out.is_recorded)
                self.block(once, block, payload)
                self._printed[key] = once.collected()
            out.lines(self._printed[key])

    def block(self, out: Lines, block: stmt.Block, payload: Mapping[str, int] | None) -> None:
        """Print one handler; those that are alike are printed once."""
        if any(statement.__class__ not in ALIKE for statement in block):
            self._block(out, block, payload)
            return
        key = form(block), None if payload is None else tuple(payload.items())
        if key not in self._alike:
            once = Lines(is_traced=out.is_traced, is_recorded=out.is_recorded)
            self._block(once, block, payload)
            self._alike[key] = once.collected()
        out.lines(self._alike[key])

    def _block(self, out: Lines, block: stmt.Block, payload: Mapping[str, int] | None) -> None:
        printer = Printer(self.names, payload)
        if not any(map(can_break_off, block)):
            self._statements(out, block, printer)
            return
        with out.suite("try:"):
            self._statements(out, block, printer)
        with out.suite(f"except {LINK}ContentError:"):
            out.line(f"{ME}_error_execution()")
        with out.suite(f"except {LINK}RangeFault:"):
            out.line(f'{ME}_stop("range")')
        if any(isinstance(part, stmt.Fail) and part.is_raised for part in statements(block)):
            with out.suite(f"except {LINK}EndOfBlock:"):
                out.line("pass")

    def done(self, out: Lines, event: int, data: tuple[lang.Expr, ...]) -> None:
        """Print how ``done.state`` is raised, with the data of a final state (SCXML 5.5)."""
        fields = self.chart.events[event].fields
        printer = Printer(self.names)
        if not fields:
            out.line(f"{ME}_enqueue_internal({event})")
            return
        for number, part in enumerate(fields):
            out.line(f"value_{number}: Any = {spell(lang.default_value(part.type), part.type)}")
            if number >= len(data):
                continue
            with out.suite("try:"):
                out.line(f"value_{number} = {printer.frozen(data[number])}")
            with out.suite(f"except {LINK}ContentError:"):
                out.line(f"{ME}_error_execution()")
            with out.suite(f"except {LINK}RangeFault:"):
                out.line(f'{ME}_stop("range")')
        out.line(f"at = {ME}_enqueue_internal({event})")
        with out.suite("if at >= 0:"):
            for number in range(len(fields)):
                out.line(f"{ME}_internal_fields[at + {number}] = value_{number}")

    def _statements(self, out: Lines, block: stmt.Block, printer: Printer) -> None:
        for statement in block:
            self._statement(out, statement, printer)

    def _statement(self, out: Lines, statement: stmt.Statement, printer: Printer) -> None:
        match statement:
            case stmt.Assign(location, value) if (parts := printer.sum(value)) is not None:
                out.line(f"value = {parts[0]}")
                out.line(self._assign(location, parts[1], printer))
            case stmt.Assign(location, value):
                out.line(self._assign(location, printer.print(value), printer))
            case stmt.Raise(event, arguments):
                self.needs.raised.add(event)
                out.line(f"{ME}_raise_{self.names.events[event]}({_passed(printer, arguments)})")
            case stmt.Send():
                self._send(out, statement, printer)
            case stmt.Cancel(name):
                out.tell(quoted("cancel " + name))
                out.line(f"{ME}_cancel({self._mark(name)})")
            case stmt.Log(label, values):
                self._log(out, label, values, printer)
            case stmt.If():
                self._if(out, statement, printer)
            case stmt.ForEach():
                self._for_each(out, statement, printer)
            case stmt.Local(place, value) if value is not None:
                out.line(f"{self._place(place, printer)} = {printer.print(value)}")
            case stmt.Return(value):
                out.line(f"return {printer.print(value)}")
            case stmt.Local():
                raise AssertionError(statement)  # it has a value
            case stmt.Reply(value):
                out.line(f"{ME}reply = {printer.frozen(value)}")
                out.tell("f" + _quoted("reply " + shown(f"{ME}reply", value.type)))
            case stmt.CallOperation(call):
                out.line(printer.print(call))
            case stmt.Fail(reason, is_raised=is_raised):
                out.line(f"raise {LINK}{'EndOfBlock' if is_raised else 'ContentError'}({reason!r})")
            case stmt.Invoke(slot, arguments):
                out.line(f"{ME}_start_{slot}({_passed(printer, arguments)})")
            case _:
                assert_never(statement)

    def _assign(self, location: lang.Location, value: str, printer: Printer) -> str:
        if isinstance(location.type, lang.ArrayType | lang.RecordType):
            return f"{LINK}replace({self._place(location, printer)}, {value})"
        return f"{self._place(location, printer)} = {value}"

    def _place(self, location: lang.Expr, printer: Printer) -> str:
        match location:
            case lang.Variable(name, storage=lang.Storage.LOCAL):
                return printer.local(name)
            case lang.Variable(name):
                return f"{ME}{self.names.variables[name]}"
            case lang.Element(array):
                return f"{self._place(array, printer)}[{printer.index(location)}]"
            case lang.Member(record, name):
                return f"{self._place(record, printer)}[{field_position(record.type, name)}]"
            case _:
                raise AssertionError(location)

    def _send(self, out: Lines, statement: stmt.Send, printer: Printer) -> None:
        event = self.names.events[statement.event]
        arguments = [printer.frozen(argument) for argument in statement.arguments]
        if statement.delay is not None:
            self.needs.delayed.add(statement.event)
            if statement.destination is stmt.Destination.PORT:
                self.needs.emitted.add(statement.event)
            mark = -1 if statement.id is None else self._mark(statement.id)
            rest = [str(mark), str(self._route(statement)), repr(statement.peer)]
            passed = ", ".join([*arguments, printer.print(statement.delay), *rest])
            out.line(f"{ME}_delay_{event}({passed})")
        elif statement.destination is stmt.Destination.PORT:
            self.needs.emitted.add(statement.event)
            passed = ", ".join([*arguments, repr(statement.peer)])
            out.line(f"{ME}_emit_{event}({passed})")
        elif statement.destination is stmt.Destination.INVOKED:
            self.needs.passed.add(statement.event)
            passed = ", ".join([*arguments, repr(statement.invocations), repr(statement.peer)])
            out.line(f"{ME}_pass_{event}({passed})")
        elif statement.destination is stmt.Destination.INVOKER:
            self.needs.answered.add(statement.event)
            out.line(f"{ME}_answer_{event}({', '.join(arguments)})")
        else:
            is_own = statement.destination is stmt.Destination.SELF
            (self.needs.sent if is_own else self.needs.raised).add(statement.event)
            how = "send" if is_own else "raise"
            out.line(f"{ME}_{how}_{event}({', '.join(arguments)})")

    def _route(self, statement: stmt.Send) -> int:
        route = ROUTES[statement.destination]
        if statement.destination is not stmt.Destination.INVOKED:
            return route
        addresses = self.needs.addresses
        if statement.invocations not in addresses:
            addresses.append(statement.invocations)
        return route + addresses.index(statement.invocations)

    def _mark(self, name: str) -> int:
        return self.needs.marks.setdefault(name, len(self.needs.marks))

    def _log(self, out: Lines, label: str, values: tuple[lang.Expr, ...], printer: Printer) -> None:
        texts = [printer.frozen(value) for value in values]
        out.line(f"{ME}_log({', '.join([repr(label), *texts])})")

    def _if(
        self, out: Lines, statement: stmt.If[lang.Expr, stmt.Statement], printer: Printer
    ) -> None:
        for place_, branch in enumerate(statement.branches):
            if branch.condition is None:
                opening = "else:" if place_ else "if True:"
            else:
                word = "elif" if place_ else "if"
                opening = f"{word} {self._condition(branch.condition, printer)}:"
            with out.suite(opening):
                self._statements(out, branch.body, printer)

    def _condition(self, condition: lang.Expr, printer: Printer) -> str:
        text = printer.print(condition)
        if not can_fail(condition) or printer.parameters is not None:
            return text
        if text not in self.needs.conditions:
            self.needs.conditions.append(text)
        return f"{ME}_holds_{self.needs.conditions.index(text)}()"

    def _for_each(
        self,
        out: Lines,
        statement: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement],
        printer: Printer,
    ) -> None:
        if isinstance(statement.array, lang.Numbers):
            self._count(out, statement, statement.array, printer)
            return
        array = statement.array.type
        assert isinstance(array, lang.ArrayType)  # noqa: S101
        number = len(self.needs.copies)
        self.needs.copies.append(array.length)
        copy = f"{ME}_copy_{number}"
        out.line(f"{LINK}replace({copy}, {printer.print(statement.array)})")
        with out.suite(f"for at_{number} in range({array.length}):"):
            out.line(self._assign(statement.item, f"{copy}[at_{number}]", printer))
            if statement.index is not None:
                out.line(self._assign(statement.index, f"at_{number}", printer))
            self._statements(out, statement.body, printer)

    def _count(
        self,
        out: Lines,
        statement: stmt.ForEach[lang.Iterated, lang.Variable, stmt.Statement],
        array: lang.Numbers,
        printer: Printer,
    ) -> None:
        """Print a loop over numbers."""
        self.loops += 1
        number = self.loops
        over = f"({', '.join(map(str, array.numbers))},)"
        if array.is_counted:
            over = f"range({array.numbers[0]}, {array.numbers[-1] + 1})"
        with out.suite(f"for at_{number}n, of_{number}n in enumerate({over}):"):
            out.line(self._assign(statement.item, f"of_{number}n", printer))
            if statement.index is not None:
                out.line(self._assign(statement.index, f"at_{number}n", printer))
            self._statements(out, statement.body, printer)

    def function(self, out: Lines, function: lang.FunctionBody) -> None:
        """Print a function of the chart as a method."""
        names = {v.name: v for v in function.parameters}
        names |= {v.name: v for s in statements(function.body) for v in map(root, written(s))}
        known = {name: f"v{n}_{legal(name)}" for n, name in enumerate(names)}
        printer = Printer(self.names, parameters=known)
        passed = ", ".join(f"{known[p.name]}: Any" for p in function.parameters)
        with out.method(
            self.names.functions[function.name], "A function of the chart.", passed, "Any"
        ):
            self._statements(out, function.body, printer)


def shown(text: str, type_: lang.Type | None) -> str:
    """Return what stands in an f-string to spell a value as traces do."""
    match type_:
        case lang.BoolType() | lang.IntType() | lang.EnumType() | lang.DurationType():
            return f"{{{text}:d}}"
        case lang.FloatType():
            return f"{{{text}:.17g}}"
        case lang.SymbolType() | lang.ArrayType() | lang.RecordType() | None:
            return f"{{{LINK}shown({text})}}"
        case _:
            assert_never(type_)


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _passed(printer: Printer, arguments: tuple[lang.Expr, ...]) -> str:
    return ", ".join(printer.frozen(argument) for argument in arguments)
