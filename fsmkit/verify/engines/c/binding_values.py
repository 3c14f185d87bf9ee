"""What the binding of a machine says about values: events, operations, what leaves the machine."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.types import storage
from fsmkit.codegen.c.generate import Machine
from fsmkit.codegen.c.host import print_host
from fsmkit.codegen.c.names import Names, name_everything
from fsmkit.codegen.c.options import COMPILING, Options, read_options
from fsmkit.emit import Emitter, snake
from fsmkit.language import (
    Literal,
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
    aim = {"optimize": COMPILING} if states > MOST_STRAIGHT else {}
    return read_options({"with": "info", **aim})


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

    # --- what it calls, and what leaves it --------------------------------------------------------

    def _host(self) -> None:
        """Write the operations and what takes events that leave, by core/system/binding.h."""
        out, events = self.out, len(self.chart.events)
        first = self._first_port
        ports = range(max(events, first + len(self.chart.operations)))
        linked = ", ".join(str(int(self._is_linked(port))) for port in ports)
        out.line(f"static const unsigned char linked[] = {{{linked or '0'}}};")
        answers = []
        for place, operation in enumerate(self.chart.operations):
            if operation.result is None:
                answers.append("{NULL, 0u}")
                continue
            values = self.closed.results[self.built.number][operation.name]
            stored = storage(operation.result, self.names.records).text
            texts = ", ".join(self.literal(value, operation.result) for value in values)
            out.line(f"static const {stored} answers_{place}[] = {{{texts}}};")
            answers.append(f"{{answers_{place}, {len(values)}u}}")
        listed = ", ".join(answers) or "{NULL, 0u}"
        out.line(f"static const fsm_answers answers[] = {{{listed}}};")
        bound = f"&{self.type}_info, {quoted(self.path)}, linked, answers, {first}u"
        out.line(f"static const fsm_binding binding = {{{bound}}};")
        out.line()
        print_host(out, self.names)
        self._hear()

    @property
    def _first_port(self) -> int:
        """The port of the first operation."""
        return len(self.closed.system.machines[self.built.number].chart.events)

    def _is_linked(self, port: int) -> bool:
        wanted = self.built.number, port
        return any((link.source, link.port) == wanted for link in self.closed.system.event_links)

    def _hear(self) -> None:
        """Write what notes, for monitors, the events that the machine is handed."""
        if not self._hears:
            return
        heard = ", ".join(str(int(self._is_heard(n))) for n in range(len(self.chart.events)))
        self.out.text(f"""
        static void hear(const void *event)
        {{
            static const unsigned char heard[] = {{{heard}}};
            if (heard[fsm_event_of(&{self.type}_info, event) - 1u])
                fsm_note_heard(&{self.type}_info, {OBSERVED}u, event);
        }}
        """)
        self.out.line()

    @property
    def _hears(self) -> bool:
        return any(self._is_heard(event.index) for event in self.chart.events)

    def _is_heard(self, event: int) -> bool:
        return self._is_linked(OBSERVED + event)
