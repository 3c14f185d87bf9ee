"""Executable content in C.

A block that can fail becomes a function. It returns at the failure and thereby skips the rest. A
block that cannot fail is printed inline.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy as copy_of
from functools import partial
from itertools import count

import fsmkit.language as lang
from fsmkit.chart import statements as stmt
from fsmkit.chart.analysis.effects import can_end, can_fail, needs_order
from fsmkit.chart.forms import form
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.transfer import Place, copy
from fsmkit.codegen.c.expressions.types import integer, loaded
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.statements import Choice, Loop, StatementPrinter
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment, quoted
from fsmkit.language.evaluation import iteration_count

ROUTES = {
    stmt.Destination.SELF: "SELF",
    stmt.Destination.INTERNAL: "INTERNAL",
    stmt.Destination.PORT: "PORT",
}


ALIKE = frozenset(
    {stmt.Assign, stmt.Raise, stmt.Send, stmt.Cancel, stmt.Log, stmt.CallOperation, stmt.Reply}
)
"""Statements whose text depends only on their form and on the events that can be current."""
Printed = tuple[tuple[str, ...], list[tuple[str, str]]]
"""Lines, and the variables that they need: types and names."""


class ContentPrinter(StatementPrinter):
    """Prints the blocks of one machine; blocks that can fail become functions in ``functions``."""

    result: lang.Type | None = None
    """The type that the block returns: the result type of a function (`expressions.functions`)."""
    _leave = "return;"
    """The statement that skips the rest of the block."""

    def __init__(self, names: Names, functions: Unit) -> None:
        """Create a printer with these names."""
        self._names = names
        self.out = Emitter()
        self.printer = Printer(names)
        self.functions = functions
        self._numbers = count(1)
        """The blocks that are functions."""
        self._conditions = 0
        self.copies: list[tuple[lang.Type, str]] = []
        self._texts: dict[tuple[int, tuple[int, ...]], Printed] | None = {}
        """By form and current events. Names that record their use are not cached."""

    def under(self, names: Names) -> ContentPrinter:
        """Return a printer for blocks of the same machine with other names."""
        other = copy_of(self)
        other._names, other._texts = names, None  # noqa: SLF001  (its own)
        return other

    def block(self, out: Emitter, block: stmt.Block, events: tuple[int, ...], what: str) -> None:
        """Print one handler. ``events``: those that can be current; ``what``: a description."""
        if not block:
            return
        texts, temporaries = self._printed(block, events)
        if can_end(block):
            name = f"{self._names.own}_block_{next(self._numbers)}"
            self.functions.define(name)
            self.functions.line(f"/* {comment(what)} */")
            self.functions.line(
                f"static void {name}({self._names.own} *m{self._names.copy_parameter})"
            )
            with self.functions.block("{"):
                _declare(self.functions, temporaries)
                self.functions.lines(texts)
            self.functions.line()
            out.line(f"{name}(m{self._names.copy_argument});")
            out.line(f"{self._names.own}_end_block(m);")
            self._names.used.add("end_block")
        elif temporaries:
            with out.block("{"):
                _declare(out, temporaries)
                out.lines(texts)
        else:
            out.lines(texts)

    def _printed(self, block: stmt.Block, events: tuple[int, ...]) -> Printed:
        """Print the statements of a handler, once for all equal handlers."""
        texts = self._texts
        if texts is None or any(each.__class__ not in ALIKE for each in block):
            return self._print(block, events)
        key = form(block), events
        if key not in texts:
            texts[key] = self._print(block, events)
        return texts[key]

    def _print(self, block: stmt.Block, events: tuple[int, ...]) -> Printed:
        self.out = Emitter()
        self.printer = Printer(self._names, events, is_sound=not can_end(block))
        self.statements(block)
        return self.out.collected(), self.printer.temporaries

    def _check(self, *expressions: lang.Expr) -> None:
        if any(map(can_fail, expressions)):
            with self.out.block("if (m->fsm.failed != FSM_FINE) {"):
                self.out.line(self._leave)

    def _raise(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        prefix = self._names.own
        if not arguments:
            self.out.line(f"{prefix}_raise_plain(m, {self._names.event_constant(event)});")
            return
        self._event(event, arguments)
        self.out.line(f"{prefix}_raise(m, &e, true);")
        self.out.close()

    def _cancel(self, name: str) -> None:
        self.out.lines(self._names.of_text(name, partial(_text_hook, "FSM_CANCELLED")))
        self.out.line(f"{self._names.own}_cancel(m, {self._names.marked(name)});")

    def _local(self, variable: lang.Variable, value: lang.Expr) -> None:
        text = self.printer.value(value, variable.type)
        name = self.printer.local(variable)
        self.out.lines([f"{name} = {text};", f"(void){name};"])
        self._check(value)

    def _return(self, value: lang.Expr) -> None:
        self.out.line(f"return {self.printer.value(value, self.result)};")

    def _reply(self, value: lang.Expr) -> None:
        self.out.line(f"m->fsm.reply = {self.printer.value(value)};")
        self._check(value)
        self.out.line('FSM_HOOK_TEXT(m, FSM_REPLY, "", 0);')
        self._show(value, "m->fsm.reply")
        self.out.line("FSM_HOOK_LINE(m);")

    def _call(self, call: lang.Call) -> None:
        ignored = "" if call.type is None else "(void)"
        self.out.line(f"{ignored}{self.printer.fragment(call).text};")
        self._check(call)

    def _fail(self, reason: str, *, is_raised: bool) -> None:
        del reason
        failure = f"(void)fsm_fails({self._names.failure()});"
        self.out.line("m->fsm.failed = FSM_TOLD;" if is_raised else failure)
        self.out.line("return;")

    def _invoke(self, slot: int, arguments: tuple[lang.Expr, ...]) -> None:
        """Print the start of an invoked machine: its data, then its first macrostep."""
        names, out, printer = self._names, self.out, self.printer
        inside, member = names.invoked[slot], f"m->{names.slots[slot]}"
        invocation = names.chart.invocations[slot]
        given = [invocation.chart.data[place] for place in invocation.given]
        pairs = list(zip(given, arguments, strict=True))
        out.open("{")
        for number, (data, argument) in enumerate(pairs):
            if not isinstance(data.type, lang.ArrayType):
                stored = storage(data.type, names.records).text
                out.line(f"{stored} v{number} = {printer.value(argument, data.type)};")
        self._check(*arguments)
        out.line(f"{inside.prefix}_init(&{member});")
        for number, (data, argument) in enumerate(pairs):
            is_array = isinstance(data.type, lang.ArrayType)
            text = printer.value(argument, data.type) if is_array else f"v{number}"
            target = f"{member}.{inside.variables[data.name]}"
            copy(out, Place(names, data.type, text), Place(inside, data.type, target))
        out.line(f"{inside.prefix}_start_given(&{member}, m->fsm.now);")
        out.line(f"{names.own}_absorb_{slot}(m);")
        out.close()

    def _assign(self, location: lang.Location, value: lang.Expr) -> None:
        out, printer, target = self.out, self.printer, location.type
        if isinstance(target, lang.ArrayType):
            place, text = printer.place(location), printer.value(value)
            with out.block(f"for (uint32_t i = 0u; i < {target.length}u; i++) {{"):
                out.line(f"{place}[i] = {text}[i];")
            return
        place = printer.place(location)
        is_simple = not can_fail(value) and not can_fail(location)
        if is_simple and not needs_order(location, value):
            out.line(f"{place} = {printer.value(value, target)};")
            return
        stored = storage(target, self._names.records).text
        with out.block("{"):
            out.line(f"{stored} value = {printer.value(value, target)};")
            self._check(value)
            if can_fail(location):
                out.line(f"{stored} *place = &{place};")
                self._check(location)
                out.line("*place = value;")
            else:
                out.line(f"{place} = value;")

    def _event(self, event: int, arguments: tuple[lang.Expr, ...]) -> None:
        """Open a block in which ``e`` is the event; `Emitter.close` ends it."""
        names, out, printer = self._names, self.out, self.printer
        fields = names.chart.events[event].fields
        out.open("{")
        out.line(f"{names.own}_event e = {names.own_upper}_NO_EVENT;")
        out.line(f"e.event = {names.event(event)};")
        for part, argument in zip(fields, arguments, strict=True):
            place = f"e.of.{names.payloads[event]}.{names.field(part.name)}"
            if isinstance(part.type, lang.ArrayType):
                text = printer.value(argument, part.type)
                with out.block(f"for (uint32_t i = 0u; i < {part.type.length}u; i++) {{"):
                    out.line(f"{place}[i] = {text}[i];")
            else:
                out.line(f"{place} = {printer.value(argument, part.type)};")
        self._check(*arguments)

    def _send(self, statement: stmt.Send) -> None:
        names, out, printer = self._names, self.out, self.printer
        prefix = names.own
        peer = 0 if statement.peer is None else names.symbol(statement.peer)
        is_port = statement.destination is stmt.Destination.PORT and statement.delay is None
        if is_port and not statement.arguments:
            event = names.event(statement.event)
            out.line(f"FSM_HOOK_LEFT(m, {prefix}_event, {event}, {peer}u);")
            out.line(f"{names.sending(statement.event, ())};")
            return
        self._event(statement.event, statement.arguments)
        if statement.delay is not None:
            delay = printer.value(statement.delay, lang.DurationType())
            mark = names.marked(statement.id)
            route = f"{names.own_upper}_TO_{self._route(statement)}"
            if not isinstance(statement.delay, lang.Literal):
                out.line(f"uint32_t delay = {delay};")
                self._check(statement.delay)
                delay = "delay"
            out.line(f"{prefix}_delay(m, &e, {delay}, {mark}, {route}, {peer}u);")
        elif statement.destination is stmt.Destination.PORT:
            out.line("FSM_HOOK_EVENT(m, FSM_LEFT, &e);")
            out.line(f'FSM_HOOK_TEXT(m, FSM_LEFT, "", {peer}u);')
            payload = f"e.of.{names.payloads[statement.event]}"
            fields = names.chart.events[statement.event].fields
            passed = [loaded(f.type, f"{payload}.{names.field(f.name)}", names) for f in fields]
            out.line(f"{names.sending(statement.event, passed)};")
        elif statement.destination is stmt.Destination.SELF:
            out.line(f"{prefix}_send(m, &e);")
        elif statement.destination is stmt.Destination.INVOKER:
            names.used.add("to_invoker")
            out.line(f"{prefix}_to_invoker(m, &e);")
        elif statement.destination is stmt.Destination.INVOKED:
            number = names.slot_set(statement.invocations)
            out.line(f"{prefix}_to_invoked_{number}(m, &e, {peer}u);")
        else:
            out.line(f"{prefix}_raise(m, &e, true);")
        out.close()

    def _route(self, statement: stmt.Send) -> str:
        """Return the constant of a delivery route, and record its use."""
        names = self._names
        match statement.destination:
            case stmt.Destination.INVOKED:
                number = names.slot_set(statement.invocations)
                return f"INVOKED_{number}"
            case stmt.Destination.INVOKER:
                names.used.add("to_invoker")
                return "INVOKER"
            case destination:
                return ROUTES[destination]

    def _log(self, label: str, values: tuple[lang.Expr, ...]) -> None:
        out, printer = self.out, self.printer
        if values:
            out.open("{")
        for number, value in enumerate(values):
            assert value.type is not None  # noqa: S101
            if isinstance(value.type, lang.ArrayType):
                continue
            stored = storage(value.type, self._names.records).text
            out.line(f"{stored} v{number} = {printer.value(value)};")
        self._check(*values)
        out.lines(self._names.of_text(label, partial(_text_hook, "FSM_LOG")))
        for number, value in enumerate(values):
            text = printer.value(value) if isinstance(value.type, lang.ArrayType) else f"v{number}"
            self._show(value, text)
        out.line("FSM_HOOK_LINE(m);")
        if values:
            out.close()

    def _show(self, value: lang.Expr, text: str) -> None:
        assert value.type is not None  # noqa: S101
        show(self.out, value.type, text, self._names)

    def _if(self, statement: Choice) -> None:
        """Print a chain of conditions; one that fails is false, and raises ``error.execution``."""
        out, depth = self.out, 0
        for branch in statement.branches:
            if branch is not statement.branches[0]:
                out.turn("} else {")
            if branch.condition is None:
                self.statements(branch.body)
                break
            condition = self.printer.condition(branch.condition)
            if can_fail(branch.condition):
                if not depth:
                    out.open()
                    depth += 1
                condition = self._held(condition)
                self._check(branch.condition)
            out.open(f"if ({condition}) {{")
            depth += 1
            self.statements(branch.body)
        for _ in range(depth):
            out.close()

    def _held(self, condition: str) -> str:
        """Print the evaluation of a condition that can fail; return the variable with its value."""
        self._conditions += 1
        name = f"holds_{self._conditions}"
        self.out.line(f"bool {name} = {condition};")
        self.out.line(f"{name} = {self._names.own}_holds(m, {name});")
        self._names.used.add("holds")
        return name

    @contextmanager
    def _loop(self, statement: Loop) -> Iterator[tuple[str, str]]:
        """Print a loop over a copy of an array, or over numbers."""
        names, out, printer = self._names, self.out, self.printer
        array, number = statement.array, len(self.copies)
        self.copies.append((array.type, f"copy_{number}"))
        length = iteration_count(statement)
        out.open("{")
        if isinstance(array, lang.Numbers):
            ctype = storage(statement.item.type, names.records).text
            if array.is_counted:
                least = array.numbers[0]
                count = f"(int32_t)i_{number} {'-' if least < 0 else '+'} {abs(least)}"
                if least >= 0:
                    count = f"i_{number} + {least}u" if least else f"i_{number}"
                if array.numbers[-1] > 2**31 - 1 or least < 1 - 2**31:
                    count = f"(int64_t)i_{number} + {integer(least, 'int64_t')}"
                element = f"({ctype})({count})"
            else:
                listed = ", ".join(integer(n, "int32_t") for n in array.numbers)
                out.line(f"static const int32_t copy_{number}[] = {{{listed}}};")
                element = f"({ctype})copy_{number}[i_{number}]"
        else:
            assert isinstance(array.type, lang.ArrayType)  # noqa: S101
            stored = storage(array.type.element, names.records).text
            source = printer.place(array)
            out.line(f"{stored} copy_{number}[{length}];")
            with out.block(f"for (uint32_t i = 0u; i < {length}u; i++) {{"):
                out.line(f"copy_{number}[i] = {source}[i];")
            element = f"copy_{number}[i_{number}]"
        with out.block(f"for (uint32_t i_{number} = 0u; i_{number} < {length}u; i_{number}++) {{"):
            cast = (
                "" if statement.index is None else storage(statement.index.type, names.records).text
            )
            yield element, f"({cast})i_{number}"
        out.close()

    def _set(self, variable: lang.Variable, text: str) -> None:
        is_local = variable.storage is lang.Storage.LOCAL
        place = self.printer.local(variable) if is_local else self.printer.place(variable)
        self.out.line(f"{place} = {text};")
        if is_local:
            self.out.line(f"(void){place};")


def show(out: Emitter, type_: lang.Type, text: str, names: Names) -> None:
    """Print the call that passes a value to the hooks."""
    match type_:
        case lang.FloatType():
            out.line(f"FSM_HOOK_VALUE_F(m, {text});")
        case lang.SymbolType():
            out.line(f"FSM_HOOK_VALUE_S(m, {text});")
        case lang.ArrayType(element, length):
            out.line("FSM_HOOK_VALUE_S(m, -1);")
            for place in range(length):
                show(out, element, f"{text}[{place}]", names)
            out.line("FSM_HOOK_VALUE_S(m, -2);")
        case lang.RecordType(_, fields):
            out.line("FSM_HOOK_VALUE_S(m, -1);")
            for part in fields:
                show(out, part.type, f"{text}.{names.field(part.name)}", names)
            out.line("FSM_HOOK_VALUE_S(m, -2);")
        case _:
            out.line(f"FSM_HOOK_VALUE_I(m, {text});")


def _text_hook(what: str, text: str) -> str:
    return f"FSM_HOOK_TEXT(m, {what}, {quoted(text)}, 0);"


def _declare(out: Emitter, temporaries: list[tuple[str, str]]) -> None:
    for ctype, name in temporaries:
        out.line(f"{ctype} {name};")
