"""Firing timers: timeouts of states, and events that were sent later."""

from __future__ import annotations

from fsmkit.analysis.effects import can_stop
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.invocation import COMMUNICATION, InvocationPrinter
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter


class TimeoutPrinter:
    """Prints what happens when a time has come."""

    def __init__(
        self,
        names: Names,
        selection: SelectionPrinter,
        reactions: ReactionPrinter,
        invocation: InvocationPrinter,
    ) -> None:
        """Print with these."""
        self.names = names
        self.chart = names.chart
        self.selection = selection
        self.reactions = reactions
        self.invocation = invocation

    def answers(self, out: Emitter) -> None:
        """Print what timeouts do: only one transition is taken, whatever else is active."""
        names, chart = self.names, self.chart
        timed = [t for t in chart.transitions if t.trigger in (Trigger.AFTER, Trigger.EVERY)]
        if not timed:
            return
        with out.block("switch (timer.what) {"):
            for t in timed:
                out.line(f"case {names.timers[t.index]}: /* {self.selection.comment(t)} */")
                with out.indented():
                    if t.trigger is Trigger.EVERY:
                        out.line(self.reactions.arm(t.index))
                    leaf = None if chart.states[t.source].children else t.source
                    step = self.reactions.step(t, leaf).lines
                    if t.guard is None:
                        out.lines(step)
                    else:
                        may_stop = can_stop(t.guard)
                        test = self.reactions.guard(t)
                        if may_stop:
                            test += " && m->fsm.fault == FSM_NO_FAULT"
                        with out.block(f"if ({test}) {{"):
                            out.lines(step)
                    out.line("break;")
            default(out)

    def print(self, out: Emitter, timeouts: Emitter) -> None:
        """Print the function that fires the first timer; ``timeouts``: what `answers` printed."""
        names, chart = self.names, self.chart
        p = names.prefix
        out.line(f"bool {p}_step_timer({p} *m)")
        with out.block("{"):
            if not names.does.deadlines:
                out.line("(void)m;")
                out.line("return false;")
            else:
                self._first_deadline(out)
            if names.has_timers or names.does.delays:
                out.line("fsm_timer timer = m->fsm.timers[0];")
                out.line("fsm_timers_remove(m->fsm.timers, &m->fsm.timer_count, 0u);")
                out.line("m->fsm.now = timer.deadline;")
                if self.names.does.delays:
                    self._deliver(out)
                self._timeouts(out, timeouts)
                out.line("return true;")
        out.line()
        del chart

    def _first_deadline(self, out: Emitter) -> None:
        """Print that nothing is due, or not here but in a machine in a slot."""
        names = self.names
        if not names.slots:
            with out.block(f"if (m->fsm.timer_count == 0u || {names.refuses}) {{"):
                out.line("return false;")
            return
        out.line("uint32_t deadline = 0u;")
        with out.block(f"if ({names.refuses} || !{names.prefix}_next_deadline(m, &deadline)) {{"):
            out.line("return false;")
        within = [f"{names.prefix}_step_timer_within(m, deadline);", "return true;"]
        if names.has_timers or names.does.delays:
            with out.block(
                "if (m->fsm.timer_count == 0u || m->fsm.timers[0].deadline != deadline) {"
            ):
                out.lines(within)
        else:
            out.lines(within)

    def _timeouts(self, out: Emitter, timeouts: Emitter) -> None:
        names, p = self.names, self.names.prefix
        lines = [
            "[begins]    @_begin(m);",
            "    FSM_HOOK_BEGIN(m, FSM_TIMEOUT, timer.what);",
            "[loops]    m->fsm.budget--;",
        ]
        out.lines(line.removeprefix("    ") for line in fill(names, "\n".join(lines)))
        out.lines(timeouts.collected())
        if names.does.settles:
            out.line(f"(void){p}_settle(m);")
        if names.does.rests:
            out.line(f"{p}_rest(m);")
        out.line("FSM_HOOK_END(m);")

    def _deliver(self, out: Emitter) -> None:
        names = self.names
        names.used.add("emit")
        within = ", false" if self.names.does.external else ""
        out.lines(
            fill(
                self.names,
                """
if (timer.what == FSM_TIMER_SEND) {
    const @_delayed due = @_undelay(m, 0u);
    if (due.route == %_TO_INTERNAL) {
        (void)@_macrostep(m, &due.e$NEVER$WITHIN);
    } else if (due.route == %_TO_PORT) {
        @_emit(m, &due.e, due.peer);
$PASSING
[queued]    } else if (!@_enqueue(m, &due.e)) {
[queued]        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
    return true;
}
""",
                PASSING=self._passing(),
                WITHIN=within,
                NEVER=", false" if names.does.defers else "",
            )
        )

    def _passing(self) -> str:
        """Return the branches for events that go to the invoker or to an invoked machine."""
        names = self.names
        go_on = "        (void)@_go_on(m);\n" if names.slots else ""
        text = ""
        if "to_invoker" in names.used:
            text += "    } else if (due.route == %_TO_INVOKER) {\n"
            text += f"        @_to_invoker(m, &due.e);\n{go_on}"
        for slots, number in names.reached.items():
            tests = [f"m->{names.slots[slot]}.fsm.running" for slot in slots]
            running = f" && ({' || '.join(tests)})" if len(tests) > 1 else f" && {tests[0]}"
            if slots:
                text += f"    }} else if (due.route == %_TO_INVOKED_{number}{running}) {{\n"
                text += f"        @_to_invoked_{number}(m, &due.e, due.peer);\n{go_on}"
        if names.reached:
            error = names.events[self.chart.event_index[COMMUNICATION]]
            within = ", false" if self.names.does.external else ""
            text += "    } else if (due.route >= %_TO_INVOKED_0) {\n"
            text += f"        @_event error = @_no_event;\n        error.event = {error};\n"
            text += f"        (void)@_macrostep(m, &error$NEVER{within});\n"
        return text.rstrip("\n") or "~"
