"""The part of a C test for one machine: its host, its observable state, and its single steps."""

from __future__ import annotations

from collections.abc import Sequence

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Operation
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.header import event_type, parameters
from fsmkit.codegen.c.naming import name_everything
from fsmkit.codegen.c.storage import storage
from fsmkit.document.document import Direction
from fsmkit.emit import Emitter
from fsmkit.emit.c import printed
from fsmkit.plan import lower
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.system.shared import type_of_slot
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.testgen.script import Command


class MachineTest:
    """Writes the part of a test for one machine: its host, its observable state, its steps."""

    def __init__(
        self, closed: ClosedSystem, number: int, chart: Chart, members: frozenset[str]
    ) -> None:
        """``members``: of the struct of the machine."""
        self.names = name_everything(lower(chart), None)
        self.type = self.names.prefix
        self.out = Emitter()
        self._chart, self._members = chart, members
        self._shared = closed.system.machines[number].shared
        self._results = closed.results[number]

    def _literal(self, value: lang.Value, type_: lang.Type) -> str:
        span = self._chart.states[0].span
        return Printer(self.names).value(lang.Literal(value, type_, span), type_)

    def _assign(self, place: str, type_: lang.Type, value: lang.Value) -> None:
        """Write the assignments of a constant."""
        match type_, value:
            case lang.ArrayType(element), tuple():
                for number, part in enumerate(value):
                    self._assign(f"{place}[{number}]", element, part)
            case lang.RecordType(_, fields), tuple():
                for field, part in zip(fields, value, strict=True):
                    self._assign(f"{place}.{self.names.field(field.name)}", field.type, part)
            case _:
                cast = storage(type_, self.names.records).text
                self.out.line(f"{place} = ({cast})({self._literal(value, type_)});")

    def functions(self, used: str) -> str:
        """Return the functions; single steps only if the text of the paths uses them."""
        self.out = Emitter()
        for operation in self._chart.operations:
            self._answers(operation)
        for event in self._chart.events:
            if Direction.OUT in event.directions:
                name = self.names.event_names[event.index]
                head = f"void {self.type}_send_{name}({self.type} *m"
                self.out.line(f"{head}{parameters(event.fields, self.names)})")
                with self.out.block("{"):
                    self.out.line("(void)m;")
                    self._note_call("out", event.name, event.fields)
                    self.out.line('printf("\\n");')
                self.out.line()
        self._observation()
        if f"{self.type}_come(" in used:
            self._delivery()
        if f"{self.type}_fire(" in used:
            self._fire_now()
        return self.out.finish().replace("printf(", "note(")

    def _note_call(self, what: str, name: str, fields: tuple[lang.Field, ...]) -> None:
        """Write the C that records a call, without the end of its line."""
        self.out.line(f'printf("{printed(f"{what} " + name)}");')
        for part in fields:
            self._show(self.names.field(part.name), part.type)

    def _show(self, text: str, type_: lang.Type) -> None:
        """Write the C that records a value, with a space before it."""
        match type_:
            case lang.ArrayType(element, length):
                self._show_parts([(f"{text}[{n}]", element) for n in range(length)])
            case lang.RecordType(_, fields):
                parts = [(f"{text}.{self.names.field(part.name)}", part.type) for part in fields]
                self._show_parts(parts)
            case lang.FloatType():
                self.out.line(f'printf(" %.17g", (double)({text}));')
            case lang.SymbolType():
                self.out.line(f'printf(" \\"%s\\"", {self.type}_symbol({text}));')
            case lang.IntType(_, hi) if hi > lang.INT64.hi:
                self.out.line(f'printf(" %" PRIu64, {text});')
            case _:
                self.out.line(f'printf(" %" PRId64, (int64_t)({text}));')

    def _show_parts(self, parts: Sequence[tuple[str, lang.Type]]) -> None:
        self.out.line('printf(" [");')
        for text, type_ in parts:
            self._show(text, type_)
        self.out.line('printf(" ]");')

    def _answers(self, operation: Operation) -> None:
        out, result = self.out, operation.result
        stored = "void" if result is None else parameter_type(result, self.names)
        name = self.names.operations[operation.name]
        out.line(
            f"{stored} {self.type}_{name}({self.type} *m"
            f"{parameters(operation.parameters, self.names)})"
        )
        with out.block("{"):
            out.line("(void)m;")
            if result is not None:
                values = self._results[operation.name]
                texts = ", ".join(self._literal(value, result) for value in values)
                out.line(f"static const {stored} values[] = {{{texts}}};")
                out.line(f"{stored} value = values[{'answer()' if len(values) > 1 else '0'}];")
            self._note_call("op", operation.name, operation.parameters)
            if result is not None:
                out.line('printf(" =");')
                self._show("value", result)
            out.line('printf("\\n");')
            if result is not None:
                out.line("return value;")
        out.line()

    def _observation(self) -> None:
        """Write the C that records data, outputs and active states."""
        out, t = self.out, self.type
        with out.block(f"static void {t}_look(const {t} *m)\n{{"):
            for variable in (*self._chart.data, *self._chart.outputs):
                out.line(f'printf("d {printed(variable.name)}");')
                self._show(f"m->{self.names.variables[variable.name]}", variable.type)
                out.line('printf("\\n");')
            out.line('printf("=");')
            for state in self._chart.states:
                if state.is_leaf:
                    number = self.names.states[state.index]
                    out.line(f"if ({t}_in(m, {number}))")
                    out.line(f'    printf(" {printed(state.id)}");')
            out.line(f'printf("%s\\n", {t}_finished(m) ? " finished" : "");')
        out.line()

    def _delivery(self) -> None:
        """Write the C that delivers an external event ahead of the queue."""
        out, t = self.out, self.type
        out.text(f"""
        /* Delivers an event ahead of the queue. */
        static void {t}_come({t} *m, const {t}_event *e, bool may_defer)
        {{
            if (!may_defer) {{
                (void){t}_dispatch(m, e, 0u);
                return;
            }}
            (void){t}_post(m, e);
            for (uint32_t i = m->fsm.queue_count - 1u; i > 0u; i--)
                m->fsm.queue[i] = m->fsm.queue[i - 1u];
            m->fsm.queue[0] = *e;
            (void){t}_step_event(m);
        }}
        """)
        out.line()

    def _fire_now(self) -> None:
        """Write the C that fires a timer: late, if it has expired, else before its deadline."""
        out, t = self.out, self.type
        out.line("/* Fires a timer before all others: that of a transition, or of a sent event. */")
        delayed = "fsm.delayed" in self._members
        event = f", const {t}_event *e" if delayed else ""
        with out.block(
            f"static void {t}_fire({t} *m, uint32_t what, bool due, uint32_t late{event})\n{{"
        ):
            out.lines(["uint32_t at = 0u;", "uint32_t rank = 0u;"])
            found = "m->fsm.timers[at].what == what"
            if delayed:
                found += " && (what != FSM_TIMER_SEND"
                found += " || memcmp(&m->fsm.delayed[rank].e, e, sizeof *e) == 0)"
            out.line("while (at < m->fsm.timer_count")
            with out.block(f"    && !({found})) {{"):
                out.lines(["rank += m->fsm.timers[at].what == FSM_TIMER_SEND;", "at++;"])
            with out.block("if (at == m->fsm.timer_count) {"):
                out.lines(['printf("no such timer\\n");', "return;"])
            out.line("fsm_timer timer = m->fsm.timers[at];")
            with out.block("if (due && timer.deadline != 0u - late) {"):
                out.line('printf("not due, but in %" PRId32 " ticks\\n", (int32_t)timer.deadline);')
            with out.block("for (; at > 0u; at--) {"):
                out.line("m->fsm.timers[at] = m->fsm.timers[at - 1u];")
            out.lines(["timer.deadline = 0u - late;", "m->fsm.timers[0] = timer;"])
            if delayed:
                out.text(f"""
                if (what == FSM_TIMER_SEND) {{
                    {t}_delayed first = m->fsm.delayed[rank];
                    for (; rank > 0u; rank--)
                        m->fsm.delayed[rank] = m->fsm.delayed[rank - 1u];
                    m->fsm.delayed[0] = first;
                }}
                """)
            else:
                out.line("(void)rank;")
            out.line(f"(void){t}_step_timer(m);")
        out.line()

    # --- a step ----------------------------------------------------------------------------------

    def step(self, out: Emitter, command: Command, machine: str, elapsed: int | None) -> None:
        """Write a step of a machine; ``elapsed`` ticks since its last, None before its start."""
        t = self.type
        self.out = out
        with out.block("{"):
            if elapsed:
                out.line(f"{t}_rebase(&{machine}, {elapsed}u);")
            if "fsm.now" in self._members and elapsed is not None:
                out.line(f"{machine}.fsm.now = 0u;")
            if command.inputs:
                out.line(f"{t} *m = &{machine};")
            for place, value in command.inputs:
                self._put(place, value)
            for number, event in enumerate(command.posts):
                self._event(f"posted_{number}", event)
                out.line(f"(void){t}_post(&{machine}, &posted_{number});")
            chosen = ", ".join(f"{choice}u" for choice in command.choices)
            if chosen:
                out.line(f"static const unsigned chosen[] = {{{chosen}}};")
            out.line(f"begin({'chosen' if chosen else 'NULL'});")
            self._act(command, machine)
            out.line(f"{t}_look(&{machine});")

    def _put(self, place: int, value: lang.Value) -> None:
        inputs = self._chart.inputs
        if place < len(inputs):
            declared = inputs[place]
            self._assign(f"m->{self.names.variables[declared.name]}", declared.type, value)
            return
        slot = self._shared[place - len(inputs)]
        member = f"m->{self.names.variables[slot.name]}"
        place_of = member if slot.element is None else f"{member}[{slot.element}]"
        self._assign(place_of, type_of_slot(self._chart, slot), value)

    def _event(self, name: str, event: Occurrence) -> None:
        out, t = self.out, self.type
        out.line(f"{t}_event {name};")
        out.line(f"memset(&{name}, 0, sizeof {name});")
        out.line(f"{name}.event = ({event_type(self.names)})({event.event}u + 1u);")
        fields = self._chart.events[event.event].fields
        for part, value in zip(fields, event.payload, strict=True):
            payload = self.names.payloads[event.event]
            place = f"{name}.of.{payload}.{self.names.field(part.name)}"
            self._assign(place, part.type, value)

    def _act(self, command: Command, machine: str) -> None:
        out, t = self.out, self.type
        match command.action:
            case Action.START:
                out.line(f"{t}_start(&{machine}, 0u);")
            case Action.TAKE:
                out.line(f"(void){t}_step_event(&{machine});")
            case Action.EVENTLESS:
                out.line(f"(void){t}_step_eventless(&{machine});")
            case Action.OCCUR:
                assert command.occurs is not None  # noqa: S101  (an event comes)
                self._event("coming", command.occurs)
                out.line(f"{t}_come(&{machine}, &coming, {str(command.may_defer).lower()});")
            case Action.FIRE:
                self._act_timer(command, machine)
            case _:
                pass

    def _act_timer(self, command: Command, machine: str) -> None:
        out, t, timer = self.out, self.type, command.timer
        more = ""
        if isinstance(timer, Occurrence):
            self._event("sent", timer)
            more = ", &sent"
            what = "FSM_TIMER_SEND"
        else:
            assert timer is not None  # noqa: S101  (one fires)
            what = f"{timer.transition}u"
            more = ", NULL" if "fsm.delayed" in self._members else ""
        out.line(
            f"{t}_fire(&{machine}, {what}, {str(command.due).lower()}, {command.late}u{more});"
        )
