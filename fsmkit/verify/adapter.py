"""The C that stands between the generated machines and the search: one file for each machine, and one
for the system.

A machine's file gives the functions of ``fsm_machine`` (core/system.h), the operations, and what
takes the events that leave. The system's file holds the wires and judges the properties.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fsmkit.codegen.c.expressions import Printer
from fsmkit.codegen.c.header import event_type, parameters
from fsmkit.codegen.c.names import Names, name_everything
from fsmkit.codegen.c.types import storage
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter, snake
from fsmkit.expressions import (
    ArrayType,
    Field,
    FloatType,
    Literal,
    RecordType,
    SymbolType,
    Type,
    Value,
)
from fsmkit.model.chart import Chart, Operation
from fsmkit.model.document import Direction
from fsmkit.plan import lower
from fsmkit.verify.closed import Closed
from fsmkit.verify.steps import reads_inputs_eventless, resting

MOST_VALUES = 32
"""Scalars in one message: FSM_MOST_VALUES of core/recorder.h."""


@dataclass(frozen=True, slots=True)
class Built:
    """A machine as the adapter sees it: its C names, and the members its struct has."""

    number: int
    chart: Chart
    names: Names
    members: frozenset[str]

    @property
    def prefix(self) -> str:
        """The prefix of its functions."""
        return self.names.prefix


def prefix_of(number: int, name: str) -> str:
    """Return the prefix under which a machine of a system is generated for exploration."""
    return f"m{number}_{snake(name)}"


def describe(closed: Closed, number: int, header: str) -> Built:
    """Return what the adapter needs to know of a generated machine."""
    chart = closed.charts[number]
    prefix = prefix_of(number, closed.system.machines[number].name)
    struct = header.partition(f"typedef struct {prefix} {{")[2].partition(f"}} {prefix};")[0]
    members = frozenset(
        line.partition(";")[0].partition("[")[0].split()[-1]
        for line in struct.splitlines()
        if ";" in line
    )
    return Built(number, chart, name_everything(lower(chart), prefix), members)


class MachineAdapter:
    """Writes the file of one machine."""

    def __init__(self, closed: Closed, built: Built) -> None:
        """Write for a machine of a closed system."""
        self.closed, self.built = closed, built
        self.names, self.chart = built.names, built.chart
        self.out = Emitter()
        self.type = built.prefix
        self.upper = built.names.upper

    def text(self) -> str:
        """Return the file, section by section."""
        self.out.line(f"/* What the explorer does with `{self.chart.name}`. */")
        self.out.lines([f'#include "{self.type}.h"', '#include "system.h"', ""])
        self.out.lines(["#include <inttypes.h>", "#include <stdio.h>", "#include <string.h>", ""])
        self.out.lines(["union number {", "    double number;", "    fsm_value bits;", "};", ""])
        self._events()
        self._operations()
        self._sent_events()
        self._steps()
        self._inputs_and_outputs()
        self._settle()
        self._view()
        self._dump()
        self._table()
        return self.out.finish()

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

    def _tell(self, what: str, name: str, fields: tuple[Field, ...]) -> None:
        """Write what prints a line of the trace, without its end."""
        self.out.line(f'printf("{what} {name}");')
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

    def _operations(self) -> None:
        for place, operation in enumerate(self.chart.operations):
            self._operation(len(self.closed.system.machines[self.built.number].chart.events) + place,
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

    # --- steps ----------------------------------------------------------------------------------

    def _steps(self) -> None:
        out, t = self.out, self.type
        out.text(f"""
        static void init(void *m) {{ {t}_init(m); }}
        static void start(void *m) {{ {t}_start(m, 0u); }}
        static void take(void *m) {{ (void){t}_step_event(m); }}
        static void elapse(void *m, uint32_t ticks) {{ {t}_rebase(m, ticks); }}

        static bool post(void *m, uint32_t event, const fsm_value *values)
        {{
            {t}_event e = event_of(event, values);
            return {t}_post(m, &e);
        }}
        """)
        out.line()
        if self._tries_inputs:
            out.line(f"static void eventless(void *m) {{ (void){t}_step_eventless(m); }}")
            out.line()
        self._recalled()
        self._fire()
        out.text(f"""
        /* At once, ahead of the queue; not deferred where it could not be put there. */
        static void occur(void *state, uint32_t event, const fsm_value *values)
        {{
            {t} *m = state;
            {t}_event e = event_of(event, values);
            if (m->queue_count{self._deferred_count} >= {self.upper}_QUEUE || recalled(m) > 0u) {{
                (void){t}_dispatch(m, &e, 0u);
                return;
            }}
            for (uint32_t i = m->queue_count; i > 0u; i--)
                m->queue[i] = m->queue[i - 1u];
            m->queue[0] = e;
            m->queue_count++;
            (void){t}_step_event(m);
        }}
        """)
        out.line()

    @property
    def _tries_inputs(self) -> bool:
        return reads_inputs_eventless(self.chart)

    @property
    def _deferred_count(self) -> str:
        return " + m->deferred_count" if "deferred_count" in self.built.members else ""

    def _recalled(self) -> None:
        """Write the function that counts deferred events which no active state defers any more."""
        out, t = self.out, self.type
        out.line(f"static uint32_t recalled(const {t} *m)")
        with out.block("{"):
            if "deferred_count" not in self.built.members:
                out.lines(["(void)m;", "return 0u;"])
            else:
                out.line("uint32_t count = 0u;")
                with out.block("for (uint32_t i = 0u; i < m->deferred_count; i++) {"):
                    with out.block("switch (m->deferred[i].event) {"):
                        for event in self.chart.events:
                            states = [s.index for s in self.chart.states if event.index in s.defer]
                            if not states:
                                continue
                            tests = " || ".join(self.in_state(state) for state in states)
                            out.line(f"case {self.names.events[event.index]}:")
                            out.line(f"    count += !({tests});")
                            out.line("    break;")
                        out.lines(["default:", "    count++;", "    break;"])
                out.line("return count;")
        out.line()

    def in_state(self, state: int) -> str:
        """Spell the test whether a state of this machine is active."""
        if state == 0:
            return "true"
        return f"{self.type}_in(m, {self.names.states[state]})"

    def _fire(self) -> None:
        out, t = self.out, self.type
        has_timers = "timer_count" in self.built.members
        if not has_timers:
            out.text("""
            static bool fire(void *m, uint32_t timer)
            {
                (void)m;
                (void)timer;
                return false;
            }
            """)
            out.line()
            return
        silent = [
            transition.index
            for transition in self.chart.transitions
            if self.closed.is_silent(self.built.number, transition.index)
        ]
        with out.block("static bool is_silent(uint32_t what)\n{"):
            with out.block("switch (what) {"):
                for transition in silent:
                    out.line(f"case {transition}u:")
                if silent:
                    out.line("    return true;")
                out.lines(["default:", "    return false;"])
        out.line()
        if not self.closed.untimed:
            out.text(f"""
            static bool fire(void *m, uint32_t timer)
            {{
                (void)timer;
                return {t}_step_timer(m);
            }}
            """)
            out.line()
            return
        delayed = "delayed" in self.built.members
        move = f"""
                    {t}_delayed first = m->delayed[rank];
                    for (uint32_t i = rank; i > 0u; i--)
                        m->delayed[i] = m->delayed[i - 1u];
                    m->delayed[0] = first;"""
        out.text(f"""
        /* Any armed timer may be the next: it is put first. */
        static bool fire(void *state, uint32_t timer)
        {{
            {t} *m = state;
            fsm_timer chosen = m->timers[timer];
            if (is_silent(chosen.what))
                return false;
            uint32_t rank = 0u;
            for (uint32_t i = 0u; i < timer; i++)
                rank += m->timers[i].what == FSM_TIMER_SEND;
            if (chosen.what == FSM_TIMER_SEND) {{{move if delayed else " (void)rank;"}
            }}
            for (uint32_t i = timer; i > 0u; i--)
                m->timers[i] = m->timers[i - 1u];
            m->timers[0] = chosen;
            return {t}_step_timer(m);
        }}
        """)
        out.line()

    # --- inputs, outputs, what is state -----------------------------------------------------------

    def _inputs_and_outputs(self) -> None:
        out, t = self.out, self.type
        with out.block("static void set_input(void *state, uint32_t input, fsm_value value)\n{"):
            out.line(f"{t} *m = state;")
            out.lines(["const fsm_value *v = &value;", "(void)m;", "(void)v;"])
            with out.block("switch (input) {"):
                for place, declared in enumerate(self.chart.inputs):
                    if isinstance(declared.type, ArrayType | RecordType):
                        continue
                    out.line(f"case {place}u:")
                    with out.indented():
                        self._store(f"m->{self.names.variables[declared.name]}", declared.type, 0)
                        out.line("break;")
                out.lines(["default:", "    break;"])
        out.line()
        with out.block("static fsm_value output(const void *state, uint32_t output_number)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("(void)m;")
            with out.block("switch (output_number) {"):
                for place, declared in enumerate(self.chart.outputs):
                    if isinstance(declared.type, ArrayType | RecordType):
                        continue
                    text = f"m->{self.names.variables[declared.name]}"
                    out.line(f"case {place}u:")
                    out.line(f"    return {self._as_value(text, declared.type)};")
                out.lines(["default:", "    return 0;"])
        out.line()
        if not self.closed.is_open:
            return
        with out.block("static void choose_inputs(void *state)\n{"):
            out.line(f"{t} *m = state;")
            out.line("(void)m;")
            for free in self.closed.free_inputs:
                declared = self.chart.inputs[free.input]
                self._choose(declared.name, declared.type, free.values)
        out.line()

    def _choose(self, name: str, type_: Type, values: tuple[Value, ...]) -> None:
        out = self.out
        with out.block(f"switch (fsm_choose({len(values)}u)) {{"):
            for number, value in enumerate(values):
                out.line(f"case {number}u:" if number else "default:")
                with out.indented():
                    self.assign(f"m->{self.names.variables[name]}", type_, value)
                    out.line("break;")

    def assign(self, place: str, type_: Type, value: Value) -> None:
        """Write the assignments of a constant."""
        match type_, value:
            case ArrayType(element), tuple():
                for number, part in enumerate(value):
                    self.assign(f"{place}[{number}]", element, part)
            case RecordType(_, fields), tuple():
                for field, part in zip(fields, value, strict=True):
                    self.assign(f"{place}.{self.names.field(field.name)}", field.type, part)
            case _:
                cast = storage(type_, self.names.records).text
                self.out.line(f"{place} = ({cast})({self.literal(value, type_)});")

    def _settle(self) -> None:
        """Write what clears all that does not count as state."""
        out, t, members = self.out, self.type, self.built.members
        with out.block("static void settle(void *state)\n{"):
            out.line(f"{t} *m = state;")
            for name in ("now", "budget", "unhandled", "rejected", "failed", "busy"):
                out.line(f"m->{name} = 0;")
            if "reply" in members:
                out.line("memset(&m->reply, 0, sizeof m->reply);")
            if "asked" in members:
                out.line("memset(m->asked, 0, sizeof m->asked);")
            if self.closed.is_open and not self.closed.keeps_inputs:
                for declared in self.chart.inputs:
                    place = f"m->{self.names.variables[declared.name]}"
                    self.assign(place, declared.type, declared.init.value)
            with out.block("if (!m->running) {"):
                for name in ("queue", "deferred", "delayed", "timers"):
                    if name in members:
                        out.line(f"memset(m->{name}, 0, sizeof m->{name});")
                for name in ("queue_count", "deferred_count", "delayed_count", "timer_count"):
                    if name in members:
                        out.line(f"m->{name} = 0u;")
                for name in self.names.histories.values():
                    out.line(f"m->{name} = 0u;")
            if self.closed.untimed and "timer_count" in members:
                self._sort_timers()
        out.line()

    def _sort_timers(self) -> None:
        """Write what makes equal sets of timers equal bytes, without their deadlines."""
        out, t = self.out, self.type
        delayed = "delayed" in self.built.members
        out.text("""
        for (uint32_t i = 0u; i < m->timer_count; i++)
            m->timers[i].deadline = 0u;
        """)
        if delayed:
            out.text(f"""
            uint32_t rank = 0u;
            struct send {{ fsm_timer timer; {t}_delayed event; }} sends[{self.upper}_DELAYED];
            memset(sends, 0, sizeof sends);
            for (uint32_t i = 0u; i < m->timer_count; i++)
                if (m->timers[i].what == FSM_TIMER_SEND) {{
                    sends[rank].timer = m->timers[i];
                    sends[rank].event = m->delayed[rank];
                    rank++;
                }}
            for (uint32_t i = 1u; i < rank; i++)
                for (uint32_t j = i; j > 0u && memcmp(&sends[j - 1u], &sends[j], sizeof sends[0]) > 0; j--) {{
                    struct send other = sends[j];
                    sends[j] = sends[j - 1u];
                    sends[j - 1u] = other;
                }}
            """)
        out.text("""
        for (uint32_t i = 1u; i < m->timer_count; i++)
            for (uint32_t j = i; j > 0u && m->timers[j - 1u].what > m->timers[j].what; j--) {
                fsm_timer other = m->timers[j];
                m->timers[j] = m->timers[j - 1u];
                m->timers[j - 1u] = other;
            }
        """)
        if delayed:
            out.text("""
            for (uint32_t i = 0u; i < rank; i++) {
                m->timers[m->timer_count - rank + i] = sends[i].timer;
                m->delayed[i] = sends[i].event;
            }
            """)

    # --- looking ---------------------------------------------------------------------------------

    def _view(self) -> None:
        out, t, members = self.out, self.type, self.built.members
        restless = [
            self.in_state(state.index)
            for state in self.chart.states
            if state.is_leaf and not self._rests(state.index)
        ]
        with out.block("static fsm_view view(const void *state)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("fsm_view v = {0};")
            out.line("v.running = m->running;")
            out.line(f"v.faulted = {t}_fault(m) != FSM_NO_FAULT;")
            with out.block("if (!m->running) {"):
                out.line(f"v.at_rest = {t}_finished(m);")
                out.line("return v;")
            out.line("v.waiting = m->queue_count + recalled(m);")
            out.line(
                f"v.queued = m->queue_count{self._deferred_count};".replace(
                    "count +", "count + (uint32_t)"
                )
            )
            if "timer_count" in members:
                out.line("v.armed = m->timer_count;")
                out.line("for (uint32_t i = 0u; i < m->timer_count; i++)")
                out.line("    v.awaited += !is_silent(m->timers[i].what);")
                out.line("v.due = m->timer_count > 0u && fsm_reached(0u, m->timers[0].deadline);")
            out.line(f"v.at_rest = !({' || '.join(restless) or 'false'});")
            out.line("return v;")
        out.line()
        with out.block("static void configuration(const void *state, unsigned char *shown)\n{"):
            out.line(f"const {t} *m = state;")
            out.line("shown[0] = m->running;")
            out.line(f"for (uint32_t s = 1u; s < {self.upper}_STATES; s++)")
            out.line(f"    if ({t}_in(m, ({t}_state)s))")
            out.line("        shown[s / 8u + 1u] |= (unsigned char)(1u << s % 8u);")
        out.line()

    def _rests(self, state: int) -> bool:
        return state in resting(self.chart)

    def _dump(self) -> None:
        out, t = self.out, self.type
        leaves = [state.index for state in self.chart.states if state.is_leaf]
        with out.block("static void dump(const void *state)\n{"):
            out.line(f"const {t} *m = state;")
            for variable in (*self.chart.data, *self.chart.outputs):
                out.line(f'printf("d {variable.name}");')
                self._show(f"m->{self.names.variables[variable.name]}", variable.type)
                out.line('printf("\\n");')
            out.line('printf("=");')
            for leaf in leaves:
                out.line(f"if ({self.in_state(leaf)})")
                out.line(f'    printf(" {leaf}");')
            out.line(f'printf("%s\\n", {t}_finished(m) ? " finished" : "");')
        out.line()

    def _table(self) -> None:
        chart, t = self.chart, self.type
        machine = self.closed.system.machines[self.built.number]
        noted = ", ".join(
            str(int(n < len(machine.chart.events) and bool(event.directions)))
            for n, event in enumerate(chart.events)
        )
        size = len(chart.states) // 8 + 2
        if size > 256:
            raise fail(
                "not-explored-yet",
                f"`{chart.name}` has more than 2,000 states",
                help="use `--engine python`",
            )
        out = self.out
        out.line(f"static const unsigned char noted[] = {{{noted or '0'}}};")
        out.line()
        with out.block(f"const fsm_machine fsm_machine_{self.built.number} = {{", "};"):
            out.line(f'.name = "{machine.name}",')
            out.line(f".size = sizeof({t}),")
            out.line(f".environment = {str(machine.environment).lower()},")
            out.line(f".state_count = {len(chart.states)}u,")
            out.line(f".transition_count = {len(chart.transitions)}u,")
            out.line(f".event_count = {len(chart.events)}u,")
            out.line(".noted = noted,")
            out.line(f".microsteps = {self.upper}_MICROSTEPS,")
            out.line(f".configuration_size = {size}u,")
            for name in [
                "init",
                "start",
                "take",
                "fire",
                "occur",
                "post",
                "elapse",
                "set_input",
                "output",
                "settle",
                "view",
                "configuration",
                "dump",
            ]:
                out.line(f".{name} = {name},")
            out.line(f".eventless = {'eventless' if self._tries_inputs else 'NULL'},")
            out.line(f".choose_inputs = {'choose_inputs' if self.closed.is_open else 'NULL'},")
