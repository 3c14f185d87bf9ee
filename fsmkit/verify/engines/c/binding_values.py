"""What the binding of a machine says about values: events, operations, what leaves the machine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, Operation
from fsmkit.chart.walk import charts_within
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.generate import Machine
from fsmkit.codegen.c.header import event_type, parameters
from fsmkit.codegen.c.names import Names, name_everything
from fsmkit.codegen.c.options import COMPILING, Options, read_options
from fsmkit.document.document import Direction
from fsmkit.emit import Emitter, snake
from fsmkit.language import (
    ArrayType,
    Field,
    FloatType,
    Literal,
    RecordType,
    SymbolType,
    Type,
    Value,
)
from fsmkit.plan import lower
from fsmkit.system.system import OBSERVED
from fsmkit.texts.c import quoted
from fsmkit.verify.statespace.closed_system import ClosedSystem

MOST_STRAIGHT = 256
"""States of a machine up to which its straight code is explored, as it is by default."""
MOST_VALUES = 32
"""Scalars in one message: FSM_MOST_VALUES of core/system/recorder.h."""


@dataclass(frozen=True, slots=True)
class Built:
    """A machine as the binding sees it: its C names, and the members its struct has."""

    number: int
    chart: Chart
    names: Names
    members: frozenset[str]

    @property
    def prefix(self) -> str:
        """The prefix of its functions."""
        return self.names.prefix


LONGEST_NAME = 60


def prefix_of(number: int, name: str) -> str:
    """Return the prefix under which a machine of a system is generated for exploration.

    Files are called by it, which no name of a machine may make too long for a file system.
    """
    return f"m{number}_{snake(name)[:LONGEST_NAME]}"


def options_for(chart: Chart) -> Options:
    """Return the options with which a chart is generated for exploration.

    Straight code of thousands of states takes a compiler minutes; tables take it seconds.
    """
    states = sum(len(one.states) for one in charts_within(chart))
    return read_options({"optimize": COMPILING} if states > MOST_STRAIGHT else {})


def describe(closed: ClosedSystem, number: int, generated: Machine) -> Built:
    """Return what the binding needs to know of a generated machine.

    Its strings have the numbers that they have there, in the order in which they were printed.
    """
    chart = closed.charts[number]
    prefix = prefix_of(number, closed.system.machines[number].name)
    members = members_by_prefix(generated)[prefix]
    names = name_everything(lower(chart), prefix, options_for(chart))
    names.symbols[:] = generated.names.symbols  # in place: machines in its slots share them
    names.numbers.update(generated.names.numbers)
    return Built(number, chart, names, members)


def members_by_prefix(generated: Machine) -> dict[str, frozenset[str]]:
    """Return the members of the structs of a generated machine and of those in its slots."""
    return {
        names.prefix: frozenset(member.name for member in members)
        for names, members in generated.family
    }


class ValueWriter:
    """Writes C that moves values between the machine and the explorer."""

    def __init__(self, closed: ClosedSystem, built: Built) -> None:
        """Write for a machine of a closed system."""
        self.closed, self.built = closed, built
        self.names, self.chart = built.names, built.chart
        self.machine = closed.system.machines[built.number]
        self.out = Emitter()
        self.type = built.prefix
        self.upper = built.names.upper
        self.path = ""
        """What the lines of its trace begin with: the slots in which it lies."""

    @property
    def sessions(self) -> list[tuple[str, str]]:
        """The members that are slots, and the tables of what can be asked of them."""
        inner = (f"fsm_session_{names.prefix}" for names in self.names.invoked)
        return list(zip(self.names.slots, inner, strict=True))

    def _declare_sessions(self) -> None:
        self.out.lines(f"extern const fsm_session {table};" for _, table in self.sessions)
        self.out.line()

    def in_state(self, state: int) -> str:
        """Spell the test whether a state of this machine is active."""
        if state == 0:
            return "true"
        return f"{self.type}_in(m, {self.names.states[state]})"

    @property
    def running(self) -> str:
        """The test whether this machine runs."""
        return f"{self.type}_in(m, {self.names.states[0]})"

    @property
    def _deferred_count(self) -> str:
        return " + m->deferred_count" if "deferred_count" in self.built.members else ""

    # --- values --------------------------------------------------------------------------------

    def literal(self, value: Value, type_: Type) -> str:
        """Spell a value ready to be stored."""
        span = self.chart.states[0].span
        return Printer(self.names).value(Literal(value, type_, span), type_)

    def _store(self, place: str, type_: Type, at: int) -> int:
        """Write the assignments of values from ``v[at]`` on; return how many there were."""
        match type_:
            case ArrayType(element, length):
                used = 0
                for n in range(length):
                    used += self._store(f"{place}[{n}]", element, at + used)
                return used
            case RecordType(_, fields):
                used = 0
                for part in fields:
                    inner = f"{place}.{self.names.field(part.name)}"
                    used += self._store(inner, part.type, at + used)
                return used
            case FloatType():
                cast = storage(type_, self.names.records).text
                self.out.line(f"{place} = ({cast})((union number){{.bits = v[{at}]}}).number;")
            case _:
                cast = storage(type_, self.names.records).text
                self.out.line(f"{place} = ({cast})v[{at}];")
        return 1

    @staticmethod
    def _as_value(text: str, type_: Type) -> str:
        if isinstance(type_, FloatType):
            return f"((union number){{.number = (double)({text})}}).bits"
        return f"(fsm_value)({text})"

    def _show(self, text: str, type_: Type) -> None:
        """Write what prints a value, with a space before it."""
        match type_:
            case ArrayType(element, length):
                self.out.line('printf(" [");')
                for n in range(length):
                    self._show(f"{text}[{n}]", element)
                self.out.line('printf(" ]");')
            case RecordType(_, fields):
                self.out.line('printf(" [");')
                for part in fields:
                    self._show(f"{text}.{self.names.field(part.name)}", part.type)
                self.out.line('printf(" ]");')
            case FloatType():
                self.out.line(f'printf(" %.17g", (double)({text}));')
            case SymbolType():
                self.out.line(f'printf(" \\"%s\\"", {self.type}_symbol({text}));')
            case _:
                self.out.line(f'printf(" %" PRId64, (int64_t)({text}));')

    # --- events and operations -------------------------------------------------------------------

    def _events(self) -> None:
        out, t = self.out, self.type
        out.line(f"static {t}_event event_of(uint32_t number, const fsm_value *v)")
        with out.block("{"):
            out.line(f"{t}_event e;")
            out.line("memset(&e, 0, sizeof e);")
            out.line("(void)v;")
            out.line(f"e.event = ({event_type(self.names)})(number + 1u);")
            with out.block("switch (number) {"):
                for event in self.chart.events:
                    if not event.fields:
                        continue
                    out.line(f"case {event.index}u:")
                    with out.indented():
                        at = 0
                        for part in event.fields:
                            payload = self.names.payloads[event.index]
                            place = f"e.of.{payload}.{self.names.field(part.name)}"
                            at += self._store(place, part.type, at)
                        out.line("break;")
                out.lines(["default:", "    break;"])
            out.line("return e;")
        out.line()

    def _traced(self, text: str) -> str:
        """Return a format that prints the beginning of a line of the trace."""
        return (self.path + text).replace("%", "%%")

    def _tell(self, what: str, name: str, fields: tuple[Field, ...]) -> None:
        """Write what prints a line of the trace, without its end."""
        self.out.line(f"printf({quoted(self._traced(f'{what} ' + name))});")
        for part in fields:
            self._show(self.names.field(part.name), part.type)

    def _note_sent(self, port: int, fields: tuple[Field, ...]) -> None:
        linked = any(
            link.source == self.built.number and link.port == port
            for link in self.closed.system.event_links
        )
        if not linked:
            return
        values = [
            "0" if isinstance(part.type, ArrayType | RecordType)
            else self._as_value(self.names.field(part.name), part.type)
            for part in fields
        ]  # fmt: skip
        if not values:
            self.out.line(f"fsm_note_sent({port}u, 0u, NULL);")
            return
        self.out.line(f"const fsm_value values[] = {{{', '.join(values)}}};")
        self.out.line(f"fsm_note_sent({port}u, {len(values)}u, values);")

    def _hear(self) -> None:
        """Write what tells monitors of the events that the machine is handed."""
        out, t = self.out, self.type
        heard = [event for event in self.chart.events if self._is_heard(event.index)]
        if not heard:
            return
        with out.block("static void hear(const void *event)\n{"):
            out.line(f"const {t}_event *e = event;")
            with out.block("switch ((uint32_t)e->event - 1u) {"):
                for event in heard:
                    fields = [] if not event.fields else [
                        "0" if isinstance(part.type, ArrayType | RecordType)
                        else self._as_value(
                            f"e->of.{self.names.payloads[event.index]}.{self.names.field(part.name)}",
                            part.type,
                        )
                        for part in event.fields
                    ]  # fmt: skip
                    with out.block(f"case {event.index}u: {{"):
                        values = f"{{{', '.join(fields) or '0'}}}"
                        out.line(f"const fsm_value values[] = {values};")
                        out.line(
                            f"fsm_note_sent({OBSERVED + event.index}u, {len(fields)}u, values);"
                        )
                        out.line("break;")
                out.lines(["default:", "    break;"])
        out.line()

    @property
    def _hears(self) -> bool:
        return any(self._is_heard(event.index) for event in self.chart.events)

    def _is_heard(self, event: int) -> bool:
        wanted = self.built.number, OBSERVED + event
        return any((link.source, link.port) == wanted for link in self.closed.system.event_links)

    def _operations(self) -> None:
        first = len(self.closed.system.machines[self.built.number].chart.events)
        for place, operation in enumerate(self.chart.operations):
            self._operation(first + place,
                            operation)  # fmt: skip

    def _operation(self, port: int, operation: Operation) -> None:
        out, t = self.out, self.type
        result = operation.result
        stored = "void" if result is None else storage(result, self.names.records).text
        name = self.names.operations[operation.name]
        head = f"{stored} {t}_{name}({t} *m{parameters(operation.parameters, self.names)})"
        out.line(head)
        with out.block("{"):
            if result is not None:
                values = self.closed.results[self.built.number][operation.name]
                texts = ", ".join(self.literal(value, result) for value in values)
                out.line(f"static const {stored} answers[] = {{{texts}}};")
                out.line(f"{stored} answer = answers[fsm_choose({len(values)}u)];")
            out.line("(void)m;")
            self._ignore(operation.parameters)
            self._note_sent(port, operation.parameters)
            with out.block("if (fsm_recording.tracing) {"):
                self._tell("op", operation.name, operation.parameters)
                if result is not None:
                    out.line('printf(" =");')
                    self._show("answer", result)
                out.line('printf("\\n");')
            if result is not None:
                out.line("return answer;")
        out.line()

    def _ignore(self, fields: Iterable[Field]) -> None:
        for part in fields:
            self.out.line(f"(void){self.names.field(part.name)};")

    def _sent_events(self) -> None:
        out, t = self.out, self.type
        for event in self.chart.events:
            if Direction.OUT not in event.directions:
                continue
            name = self.names.event_names[event.index]
            out.line(f"void {t}_send_{name}({t} *m{parameters(event.fields, self.names)})")
            with out.block("{"):
                out.line("(void)m;")
                self._ignore(event.fields)
                self._note_sent(event.index, event.fields)
                with out.block("if (fsm_recording.tracing) {"):
                    self._tell("out", event.name, event.fields)
                    out.line('printf("\\n");')
            out.line()
