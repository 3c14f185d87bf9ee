"""Firing timers: timeouts of states, and delayed events."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.analysis.effects import can_stop
from fsmkit.chart.chart import Transition
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.invocation import COMMUNICATION, InvocationPrinter
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter

NO_FAULT = "m->fsm.fault == FSM_NO_FAULT"


def print_macrostep(out: Emitter, names: Names, cause: str, lines: Iterable[str]) -> None:
    """Print a macrostep that starts with some lines, and the code around them.

    ``cause``: the arguments of the hooks, a kind of step and a number.
    """
    if names.does.begins:
        out.line(f"{names.own}_begin(m);")
    out.line(f"FSM_HOOK_BEGIN(m, {cause});")
    if names.does.loops:
        out.line("m->fsm.budget--;")
    out.lines(lines)
    if names.does.settles:
        out.line(f"(void){names.own}_settle(m);")
    if names.does.rests:
        out.line(f"{names.own}_rest(m);")
    out.line("FSM_HOOK_END(m);")


class TimeoutPrinter:
    """Prints the reactions to expired timers."""

    def __init__(
        self,
        names: Names,
        selection: SelectionPrinter,
        reactions: ReactionPrinter,
        invocation: InvocationPrinter,
    ) -> None:
        """Create a printer that uses these printers."""
        self.names = names
        self.chart = names.chart
        self.selection = selection
        self.reactions = reactions
        self.invocation = invocation

    def answers(self, out: Emitter) -> None:
        """Print the reactions to timeouts; each takes one transition, whatever else is active."""
        names, chart = self.names, self.chart
        timed = [t for t in chart.transitions if t.has_timer]
        if not timed:
            return
        bodies = {t.index: self._body(t) for t in timed}
        done, before = self.reactions.form.merge_timeouts(bodies)
        out.lines(before)
        with out.block("switch (timer.what) {"):
            for members, lines in done:
                for t in members:
                    first, *others = map(self.selection.comment, chart.alternatives[t])
                    out.line(f"case {names.timers[t]}: /* {first} */")
                    out.lines(f"/* else {comment} */" for comment in others)
                with out.indented():
                    out.lines((*lines, "break;"))
            default(out)

    def _body(self, timer: Transition) -> tuple[str, ...]:
        """Return the reaction to a timer: it takes the first enabled transition."""
        out = Emitter()
        if timer.trigger is Trigger.EVERY:
            out.line(self.reactions.form.actions.arm(timer.index))
        running: list[str] = []
        is_open = False
        for t in self.chart.alternatives[timer.index]:
            tests = running
            if t.guard is not None:
                running = [NO_FAULT] if can_stop(t.guard) else running
                own = [NO_FAULT] if can_stop(t.guard) else []
                tests = [*tests, self.reactions.guard(t), *own]
            head = f"if ({' && '.join(tests)}) {{" if tests else "{"
            if is_open:
                out.turn(f"}} else {head}")
            elif tests:
                out.open(head)
                is_open = True
            out.lines(self.reactions.step(t).lines)
            if t.guard is None:
                break
        if is_open:
            out.close()
        return out.collected()

    def print(self, out: Unit, timeouts: Emitter) -> None:
        """Print the function that fires the first timer; ``timeouts``: what `answers` printed."""
        names, p = self.names, self.names.own
        out.define()
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
                print_macrostep(out, names, "FSM_TIMEOUT, timer.what", timeouts.collected())
                out.line("return true;")
        out.line()

    def _first_deadline(self, out: Emitter) -> None:
        """Print the returns for no armed timer, and for a first deadline within a slot."""
        names = self.names
        if not names.slots:
            with out.block(f"if (m->fsm.timer_count == 0u || {names.ignores_steps}) {{"):
                out.line("return false;")
            return
        out.line("uint32_t deadline = 0u;")
        with out.block(
            f"if ({names.ignores_steps} || !{names.own}_next_deadline(m, &deadline)) {{"
        ):
            out.line("return false;")
        within = [f"{names.own}_step_timer_within(m, deadline);", "return true;"]
        if names.has_timers or names.does.delays:
            with out.block(
                "if (m->fsm.timer_count == 0u || m->fsm.timers[0].deadline != deadline) {"
            ):
                out.lines(within)
        else:
            out.lines(within)

    def _deliver(self, out: Emitter) -> None:
        """Print the delivery of a delayed event to its target."""
        names, p, upper = self.names, self.names.own, self.names.own_upper
        never = ", false" if names.does.defers else ""
        within = ", false" if names.does.external else ""
        with out.block("if (timer.what == FSM_TIMER_SEND) {"):
            out.line(f"const {p}_delayed due = {p}_undelay(m, 0u);")
            out.open(f"if (due.route == {upper}_TO_INTERNAL) {{")
            out.line(f"(void){p}_macrostep(m, &due.e{never}{within});")
            out.turn(f"}} else if (due.route == {upper}_TO_PORT) {{")
            out.line("m->fsm.busy = true; /* the host is called as within a step */")
            out.lines([f"{p}_emit(m, &due.e, due.peer);", "m->fsm.busy = false;"])
            self._pass_on(out, f"{never}{within}")
            if names.does.queued:
                out.turn(f"}} else if (!{p}_enqueue(m, &due.e)) {{")
                out.line('FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);')
            out.close()
            out.line("return true;")

    def _pass_on(self, out: Emitter, flags: str) -> None:
        """Print the branches for events that go to the invoker or to an invoked machine."""
        names, p, upper = self.names, self.names.own, self.names.own_upper
        go_on = [f"(void){p}_go_on(m);"] if names.slots else []
        if "to_invoker" in names.used:
            out.turn(f"}} else if (due.route == {upper}_TO_INVOKER) {{")
            out.lines([f"{p}_to_invoker(m, &due.e);", *go_on])
        for slots, number in names.reached.items():
            tests = [f"m->{names.slots[slot]}.fsm.running" for slot in slots]
            running = f" && ({' || '.join(tests)})" if len(tests) > 1 else f" && {tests[0]}"
            if slots:
                out.turn(f"}} else if (due.route == {upper}_TO_INVOKED_{number}{running}) {{")
                out.lines([f"{p}_to_invoked_{number}(m, &due.e, due.peer);", *go_on])
        if names.reached:
            error = names.events[self.chart.event_index[COMMUNICATION]]
            out.turn(f"}} else if (due.route >= {upper}_TO_INVOKED_0) {{")
            out.lines([f"{p}_event error = {p}_no_event;", f"error.event = {error};"])
            out.line(f"(void){p}_macrostep(m, &error{flags});")
