"""What the binding of a machine says about timers where time is dense: they are clocks of a zone.

A local state then holds its timers in the order in which they were armed, each with its duration in
place of the deadline. The shipped code runs such a state as it is: before a step the deadlines of
what is armed become marks that lie before all times, the step is taken at time 0, and what it arms
has its duration as deadline.
"""

from __future__ import annotations

from fsmkit.verify.engines.c.binding_state import StateWriter


class TimerWriter(StateWriter):
    """Writes ``mark``, ``unmark`` and ``limits`` of ``fsm_machine`` (core/system/system.h)."""

    @property
    def has_clocks(self) -> bool:
        """Whether the timers of this machine are clocks."""
        return self.closed.zones and "timer_count" in self.built.members

    def _clocks(self) -> None:
        out, t = self.out, self.type
        if not self.has_clocks:
            return
        out.text(f"""
        static void mark(void *state)
        {{
            {t} *m = state;
            for (uint32_t i = 0u; i < m->timer_count; i++)
                m->timers[i].deadline = i - m->timer_count;
        }}

        static void unmark(void *state, const void *before, uint32_t *source)
        {{
            {t} *m = state;
            const {t} *old = before;
            for (uint32_t i = 0u; i < m->timer_count; i++) {{
                uint32_t place = m->timers[i].deadline + old->timer_count;
                bool is_old = m->timers[i].deadline >= 0x80000000u;
                source[i] = is_old ? place + 1u : 0u;
                if (is_old)
                    m->timers[i].deadline = old->timers[place].deadline;
            }}
        }}

        static void limits(const void *state, fsm_limits *of)
        {{
            const {t} *m = state;
            for (uint32_t i = 0u; i < m->timer_count; i++) {{
                of[i].upper = (int32_t)m->timers[i].deadline;
                of[i].lower = of[i].upper - (int32_t)slack(m->timers[i].what);
            }}
        }}
        """)
        out.line()

    def _clock_members(self) -> None:
        if self.has_clocks:
            self.out.lines(f".{name} = {name}," for name in ("mark", "unmark", "limits"))
