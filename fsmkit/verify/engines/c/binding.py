"""The C between a generated machine and the search: the functions of ``fsm_machine``.

Besides those (core/system/system.h), a machine's file holds its operations and what takes the
events that leave it; `verify.engines.c.binding_system` writes the file of the system.
"""

from __future__ import annotations

from fsmkit.chart.chart import OPEN_ENDED, Transition
from fsmkit.system.properties.property import asked_events
from fsmkit.system.readiness import tries_eventless
from fsmkit.texts import printing
from fsmkit.texts.c import comment, quoted
from fsmkit.verify.engines.c.binding_regions import configuration_size
from fsmkit.verify.engines.c.binding_timers import TimerWriter
from fsmkit.verify.statespace.sessions import names_of_timers
from fsmkit.verify.statespace.spread import parts_of


class MachineBinding(TimerWriter):
    """Writes the file of one machine."""

    @printing
    def text(self) -> str:
        """Return the file, section by section."""
        self.out.line(f"/* What the explorer does with `{comment(self.chart.name)}`. */")
        includes = (f"{self.type}.h", f"{self.type}_info.inc", "system/session.h")
        self.out.lines(f'#include "{name}"' for name in (*includes, "system/binding.h"))
        self.out.line()
        self._declare_sessions()
        self._regions()
        self._host()
        self._steps()
        self._inputs_and_outputs()
        self._settle()
        self._clocks()
        self._view()
        self._dump()
        self._table()
        return self.out.finish()

    # --- steps ----------------------------------------------------------------------------------

    def _steps(self) -> None:
        out, t = self.out, self.type
        out.text(f"""
        static void init(void *m) {{ {t}_init(m); }}
        static void take(void *m) {{ (void){t}_step_event(m); }}

        static bool post(void *m, uint32_t event, const fsm_value *values)
        {{
            {t}_event e;
            fsm_make_event(&{t}_info, event, values, &e);
            return {t}_post(m, &e);
        }}
        """)
        out.line()
        self._start()
        if self._tries_inputs:
            out.line(f"static void eventless(void *m) {{ (void){t}_step_eventless(m); }}")
            out.line()
        self._elapse()
        self._recalled()
        self._fire()
        out.text(f"""
        /* At once, ahead of the queue; not deferred where it could not be put there. */
        static void occur(void *state, uint32_t event, const fsm_value *values)
        {{
            {t} *m = state;
            {t}_event e;
            fsm_make_event(&{t}_info, event, values, &e);
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
        return tries_eventless(self.machine, self.chart)

    def _start(self) -> None:
        """Write the start; shared data are not set to their start values then."""
        out, t = self.out, self.type
        if not self.machine.shared:
            out.lines([f"static void start(void *m) {{ {t}_start(m, 0u); }}", ""])
            return
        out.lines([f"static {t} kept;", ""])
        with out.block("static void begin(void *state)\n{"):
            out.line(f"{t} *m = state;")
            for name in dict.fromkeys(slot.name for slot in self.machine.shared):
                member = self.names.variables[name]
                out.line(f"memcpy(&m->{member}, &kept.{member}, sizeof m->{member});")
        out.line()
        with out.block("static void start(void *state)\n{"):
            out.lines([f"kept = *({t} *)state;", "fsm_recording.begin = begin;"])
            out.lines([f"{t}_start(state, 0u);", "fsm_recording.begin = NULL;"])
        out.line()

    def _recalled(self) -> None:
        """Write the function that counts deferred events which no active state defers any more."""
        out, t = self.out, self.type
        out.line(f"static uint32_t recalled(const {t} *m)")
        with out.block("{"):
            if "deferred_count" not in self.built.members:
                out.lines(["(void)m;", "return 0u;"])
            else:
                out.line("uint32_t count = 0u;")
                each = "for (uint32_t i = 0u; i < m->deferred_count; i++) {"
                with out.block(each), out.block("switch (m->deferred[i].event) {"):
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

    def _elapse(self) -> None:
        """Write the passing of time: the deadline of an interval without an end stays away."""
        out, t = self.out, self.type
        with out.block("static void elapse(void *state, uint32_t ticks)\n{"):
            out.line(f"{t} *m = state;")
            out.line(f"{t}_rebase(m, ticks);")
            if self._endless:
                with out.block("for (uint32_t i = 0u; i < m->timer_count; i++) {"):
                    is_endless = self._is_endless("m->timers[i].what")
                    out.line(f"if (m->timers[i].deadline < {OPEN_ENDED}u && ({is_endless}))")
                    out.line(f"    m->timers[i].deadline = {OPEN_ENDED}u;")
        out.line()

    @property
    def _endless(self) -> list[Transition]:
        return [t for t in self.chart.transitions if t.is_open_ended]

    def _is_endless(self, what: str) -> str:
        return " || ".join(f"{what} == {found.index}u" for found in self._endless)

    def _fire(self) -> None:
        out, t = self.out, self.type
        if not self._has_timers and not self.sessions:
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
        self._silence()
        self._slack()
        self._timer_name()
        if not self.closed.untimed and not self.closed.zones and not self._intervals:
            out.text(f"""
            static bool fire(void *m, uint32_t timer)
            {{
                (void)timer;
                return {t}_step_timer(m);
            }}
            """)
            out.line()
            return
        if self.sessions:
            self._choose_timer("0u")
            with out.block("static bool fire(void *m, uint32_t timer)\n{"):
                out.line(f"return choose(m, timer) && {t}_step_timer(m);")
            out.line()
            return
        took = f"return {t}_step_timer(m);"
        if self._endless:
            took = f"""(void){t}_step_timer(m);
            return fsm_recording.took || !({self._is_endless("chosen.what")});"""
        out.text(f"""
        static bool fire(void *state, uint32_t timer)
        {{
            {t} *m = state;
            {self._moved_to_front("0u")}
            {took}
        }}
        """)
        out.line()

    @property
    def _has_timers(self) -> bool:
        return "timer_count" in self.built.members

    def _silence(self) -> None:
        """Write which timers never fire."""
        out = self.out
        if not self._has_timers:
            return
        silent = [t.index for t in self.chart.transitions if self.closed.silent and t.watchdog]
        with out.block("static bool is_silent(uint32_t what)\n{"), out.block("switch (what) {"):
            for transition in silent:
                out.line(f"case {transition}u:")
            if silent:
                out.line("    return true;")
            out.lines(["default:", "    return false;"])
        out.line()

    def _moved_to_front(self, deadline: str) -> str:
        """Spell what puts an armed timer first, with a deadline; a silent one is none."""
        delayed = "delayed" in self.built.members
        move = f"""
                    {self.type}_delayed first = m->delayed[rank];
                    for (uint32_t i = rank; i > 0u; i--)
                        m->delayed[i] = m->delayed[i - 1u];
                    m->delayed[0] = first;"""
        if self.closed.untimed and self.machine.is_channel:
            return f"""/* A connection keeps its order: only the oldest message may be the next. */
            if (timer > 0u)
                return false;
            m->timers[0].deadline = {deadline};"""
        return f"""/* Any armed timer may be the next: it is put first. */
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
            chosen.deadline = {deadline};
            m->timers[0] = chosen;"""

    def _choose_timer(self, deadline: str) -> None:
        """Write what lets a timer, of this machine or of one in a slot, be the next to fire."""
        out, t = self.out, self.type
        with out.block("static bool choose(void *state, uint32_t timer)\n{"):
            out.line(f"{t} *m = state;")
            if self._has_timers:
                with out.block("if (timer < m->timer_count) {"):
                    out.text(self._moved_to_front(deadline))
                    out.line("return true;")
                out.line("timer -= m->timer_count;")
            for slot, table in self.sessions:
                with out.block(f"if (m->{slot}.running) {{"):
                    out.line(f"uint32_t armed = {table}.view(&m->{slot}).armed;")
                    out.line("if (timer < armed)")
                    out.line(f"    return {table}.choose(&m->{slot}, timer);")
                    out.line("timer -= armed;")
            out.line("return false;")
        out.line()

    def _timer_name(self) -> None:
        """Write what tells the timers of a machine apart where deadlines do not count."""
        if not self.closed.untimed:
            return
        out, t = self.out, self.type
        with out.block("static uint32_t timer_name(const void *state, uint32_t timer)\n{"):
            out.line(f"const {t} *m = state;")
            self._name_within()
            if not self._has_timers:
                out.line("return 0u;")
                return
            out.line("if (is_silent(m->timers[timer].what))")
            out.line("    return FSM_NONE;")
            if "delayed" in self.built.members:
                out.text(f"""
                uint32_t rank = 0u;
                for (uint32_t i = 0u; i < timer; i++)
                    rank += m->timers[i].what == FSM_TIMER_SEND;
                if (m->timers[timer].what == FSM_TIMER_SEND)
                    return {len(self.chart.transitions)}u + (uint32_t)m->delayed[rank].e.event - 1u;
                """)
            out.line("return m->timers[timer].what;")
        out.line()

    def _name_within(self) -> None:
        """Write the naming of the timers of machines in slots."""
        out = self.out
        if not self.sessions:
            out.line("(void)m;")
            return
        count = "m->timer_count" if self._has_timers else "0u"
        first = len(self.chart.transitions) + len(self.chart.events)
        with out.block(f"if (timer >= {count}) {{"):
            out.line(f"timer -= {count};")
            for inner, (slot, table) in zip(self.chart.invocations, self.sessions, strict=True):
                with out.block(f"if (m->{slot}.running) {{"):
                    out.line(f"uint32_t armed = {table}.view(&m->{slot}).armed;")
                    with out.block("if (timer < armed) {"):
                        out.line(f"uint32_t name = {table}.timer_name(&m->{slot}, timer);")
                        out.line(f"return name == FSM_NONE ? name : {first}u + name;")
                    out.line("timer -= armed;")
                first += names_of_timers(inner.chart)
            out.line("return 0u;")
        out.line()

    @property
    def _intervals(self) -> list[Transition]:
        return [t for t in self.chart.transitions if t.least is not None]

    def _slack(self) -> None:
        """Write how long before its deadline each timer may fire, and whether one may now."""
        out, t = self.out, self.type
        with out.block("static uint32_t slack(uint32_t what)\n{"), out.block("switch (what) {"):
            for found in self._intervals:
                out.line(f"case {found.index}u:")
                out.line(f"    return {found.delay - (found.least or 0)}u;")
            out.lines(["default:", "    return 0u;"])
        out.line()
        if self._intervals:
            out.text(f"""
            static bool early(const void *state, uint32_t timer)
            {{
                const {t} *m = state;
                uint32_t most = slack(m->timers[timer].what);
                return most > 0u && m->timers[timer].deadline <= most;
            }}
            """)
            out.line()

    def _table(self) -> None:
        chart, t = self.chart, self.type
        machine = self.machine
        own = 0 if machine.is_monitor else len(machine.chart.events)
        noted = ", ".join(
            str(int(n < own and bool(event.directions))) for n, event in enumerate(chart.events)
        )
        out = self.out
        out.line(f"static const unsigned char noted[] = {{{noted or '0'}}};")
        events = asked_events(self.closed.system.properties)
        asked = [int((self.built.number, n) in events) for n in range(len(chart.events))]
        if any(asked):
            numbers = ", ".join(map(str, asked))
            out.line(f"static const unsigned char asked[] = {{{numbers}}};")
        out.line()
        spans = self._spans()
        with out.block(f"const fsm_machine fsm_machine_{self.built.number} = {{", "};"):
            out.line(f".name = {quoted(machine.name)},")
            out.line(f".size = sizeof({t}),")
            out.line(f".spans = spans, .span_count = {spans}u,")
            out.line(f".part_count = {len(parts_of(self.chart))}u,")
            out.line(f".environment = {str(machine.environment).lower()},")
            out.line(f".monitor = {str(machine.is_monitor).lower()},")
            out.line(f".state_count = {len(chart.states)}u,")
            out.line(f".transition_count = {len(chart.transitions)}u,")
            out.line(f".event_count = {len(chart.events)}u,")
            covered = len(chart.transitions) if self.closed.covers else 0
            out.line(f".covered = {covered}u,")
            out.line(".noted = noted,")
            out.line(f".asked = {'asked' if any(asked) else 'NULL'},")
            out.line(f".hear = {'hear' if self._hears else 'NULL'},")
            out.line(f".microsteps = {self.upper}_MICROSTEPS,")
            out.line(f".configuration_size = {configuration_size(chart)}u,")
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
            self._clock_members()
            out.line(f".timer_names = {names_of_timers(chart)}u,")
            named = self.closed.untimed and (self._has_timers or bool(self.sessions))
            out.line(f".timer_name = {'timer_name' if named else 'NULL'},")
            out.line(f".early = {'early' if self._intervals else 'NULL'},")
            out.line(f".eventless = {'eventless' if self._tries_inputs else 'NULL'},")
            out.line(f".choose_inputs = {'choose_inputs' if self.closed.is_open else 'NULL'},")
