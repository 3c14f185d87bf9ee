"""Executable content as Python."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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
from fsmkit.codegen.statements import Choice, Loop, StatementPrinter
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
"""Targets of delayed sends. Invoked machines follow, numbered as in `Needs.addresses`."""

ALIKE = frozenset(
    {stmt.Assign, stmt.Raise, stmt.Send, stmt.Cancel, stmt.Log, stmt.CallOperation, stmt.Reply}
)
"""Statements whose text depends only on their form and on the current payload."""


@dataclass
class Needs:
    """The members of the class that the content of a chart needs."""

    raised: set[int] = field(default_factory=set)
    sent: set[int] = field(default_factory=set)
    emitted: set[int] = field(default_factory=set)
    delayed: set[int] = field(default_factory=set)
    marks: dict[str, int] = field(default_factory=dict)
    """Ids of delayed sends."""
    conditions: list[str] = field(default_factory=list)
    """Texts of conditions in content that can fail."""
    invoked: set[int] = field(default_factory=set)
    """Events that are sent to invoked machines."""
    answered: set[int] = field(default_factory=set)
    """Events that are sent to the invoker."""
    addresses: list[tuple[int, ...]] = field(default_factory=list)
    """Slots of invoked machines that delayed sends go to."""
    copies: list[int] = field(default_factory=list)
    """The lengths of the arrays that loops iterate over."""
    is_covered: bool = False
    """Whether coverage is counted."""


@dataclass
class ContentPrinter(StatementPrinter):
    """Prints blocks of one chart."""

    chart: Chart
    names: Names
    needs: Needs
    loops: int = 0
    """The number of printed loops over numbers."""
    _printed: dict[tuple[int, bool, object], tuple[str, ...]] = field(default_factory=dict)
    """The lines of printed blocks, by form or identity, and by the current payload."""
    out: Lines = field(default_factory=Lines)
    printer: Printer = field(init=False)

    def blocks(
        self, out: Lines, blocks: tuple[stmt.Block, ...], payload: Mapping[str, int] | None
    ) -> None:
        """Print handlers in order; an error in one ends only that handler."""
        for block in blocks:
            self.block(out, block, payload)

    def block(self, out: Lines, block: stmt.Block, payload: Mapping[str, int] | None) -> None:
        """Print one handler; equal handlers are printed once."""
        is_alike = all(statement.__class__ in ALIKE for statement in block)
        known = None if payload is None else tuple(payload.items())
        key = form(block) if is_alike else id(block), is_alike, known
        if key not in self._printed:
            once = Lines(is_traced=out.is_traced, is_recorded=out.is_recorded)
            self._block(once, block, payload)
            self._printed[key] = once.collected()
        out.lines(self._printed[key])

    def _block(self, out: Lines, block: stmt.Block, payload: Mapping[str, int] | None) -> None:
        self.out, self.printer = out, Printer(self.names, payload)
        if not any(map(can_break_off, block)):
            self.statements(block)
            return
        with out.suite("try:"):
            self.statements(block)
        with out.suite(f"except {LINK}ContentError:"):
            out.line(f"{ME}_error_execution()")
        with out.suite(f"except {LINK}RangeFault:"):
            out.line(f'{ME}_stop("range")')
        if any(isinstance(part, stmt.Fail) and part.is_raised for part in statements(block)):
            with out.suite(f"except {LINK}EndOfBlock:"):
                out.line("pass")

    def done(self, out: Lines, event: int, data: tuple[lang.Expr, ...]) -> None:
        """Print the statement that raises ``done.state``, with a final state's data (SCXML 5.5)."""
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

    def _assign(self, location: lang.Location, value: lang.Expr) -> None:
        if (parts := self.printer.sum(value)) is not None:
            self.out.line(f"value = {parts[0]}")
            self._set(location, parts[1])
        else:
            self._set(location, self.printer.print(value))

    def _raise(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        self.needs.raised.add(event)
        self.out.line(f"{ME}_raise_{self.names.events[event]}({self._argument_list(arguments)})")

    def _cancel(self, name: str) -> None:
        self.out.print_trace(quoted("cancel " + name))
        self.out.line(f"{ME}_cancel({self._mark(name)})")

    def _local(self, variable: lang.Variable, value: lang.Expr) -> None:
        self.out.line(f"{self._place(variable)} = {self.printer.print(value)}")

    def _return(self, value: lang.Expr) -> None:
        self.out.line(f"return {self.printer.print(value)}")

    def _reply(self, value: lang.Expr) -> None:
        self.out.line(f"{ME}reply = {self.printer.frozen(value)}")
        self.out.print_trace("f" + _quoted("reply " + shown(f"{ME}reply", value.type)))

    def _call(self, call: lang.Call) -> None:
        self.out.line(self.printer.print(call))

    def _fail(self, reason: str, *, is_raised: bool) -> None:
        error = "EndOfBlock" if is_raised else "ContentError"
        self.out.line(f"raise {LINK}{error}({reason!r})")

    def _invoke(self, slot: int, arguments: tuple[lang.Expr, ...]) -> None:
        self.out.line(f"{ME}_start_{slot}({self._argument_list(arguments)})")

    def _set(self, location: lang.Location, text: str) -> None:
        place_ = self._place(location)
        is_made_of_parts = isinstance(location.type, lang.ArrayType | lang.RecordType)
        self.out.line(
            f"{LINK}replace({place_}, {text})" if is_made_of_parts else f"{place_} = {text}"
        )

    def _place(self, location: lang.Expr) -> str:
        match location:
            case lang.Variable(name, storage=lang.Storage.LOCAL):
                return self.printer.local(name)
            case lang.Variable(name):
                return f"{ME}{self.names.variables[name]}"
            case lang.Element(array):
                return f"{self._place(array)}[{self.printer.index(location)}]"
            case lang.Member(record, name):
                return f"{self._place(record)}[{field_position(record.type, name)}]"
            case _:
                raise AssertionError(location)

    def _send(self, statement: stmt.Send) -> None:
        out, printer = self.out, self.printer
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
            self.needs.invoked.add(statement.event)
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

    def _log(self, label: str, values: tuple[lang.Expr, ...]) -> None:
        texts = [self.printer.frozen(value) for value in values]
        self.out.line(f"{ME}_log({', '.join([repr(label), *texts])})")

    def _if(self, statement: Choice) -> None:
        for number, branch in enumerate(statement.branches):
            if branch.condition is None:
                opening = "else:" if number else "if True:"
            else:
                word = "elif" if number else "if"
                opening = f"{word} {self._condition(branch.condition)}:"
            with self.out.suite(opening):
                self.statements(branch.body)

    def _condition(self, condition: lang.Expr) -> str:
        text = self.printer.print(condition)
        if not can_fail(condition) or self.printer.parameters is not None:
            return text
        if text not in self.needs.conditions:
            self.needs.conditions.append(text)
        return f"{ME}_holds_{self.needs.conditions.index(text)}()"

    @contextmanager
    def _loop(self, statement: Loop) -> Iterator[tuple[str, str]]:
        array = statement.array
        if isinstance(array, lang.Numbers):
            self.loops += 1
            number = self.loops
            over = f"({', '.join(map(str, array.numbers))},)"
            if array.is_counted:
                over = f"range({array.numbers[0]}, {array.numbers[-1] + 1})"
            with self.out.suite(f"for at_{number}n, of_{number}n in enumerate({over}):"):
                yield f"of_{number}n", f"at_{number}n"
            return
        assert isinstance(array.type, lang.ArrayType)  # noqa: S101
        number, length = len(self.needs.copies), array.type.length
        self.needs.copies.append(length)
        self.out.line(f"{LINK}replace({ME}_copy_{number}, {self.printer.print(array)})")
        with self.out.suite(f"for at_{number} in range({length}):"):
            yield f"{ME}_copy_{number}[at_{number}]", f"at_{number}"

    def _argument_list(self, arguments: tuple[lang.Expr, ...]) -> str:
        return ", ".join(self.printer.frozen(argument) for argument in arguments)

    def function(self, out: Lines, function: lang.FunctionBody) -> None:
        """Print a function of the chart as a method."""
        names = {v.name: v for v in function.parameters}
        names |= {v.name: v for s in statements(function.body) for v in map(root, written(s))}
        known = {name: f"v{n}_{legal(name)}" for n, name in enumerate(names)}
        self.out, self.printer = out, Printer(self.names, parameters=known)
        passed = ", ".join(f"{known[p.name]}: Any" for p in function.parameters)
        with out.method(
            self.names.functions[function.name], "A function of the chart.", passed, "Any"
        ):
            self.statements(function.body)


def shown(text: str, type_: lang.Type | None) -> str:
    """Return the field of an f-string that formats a value as traces do."""
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
