"""The functions that make a machine run: the loop, the timers, the start."""

from __future__ import annotations

from fsmkit.codegen.c.cases import default
from fsmkit.codegen.c.content import ContentPrinter, quoted
from fsmkit.codegen.c.effects import reads_input
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.invocation import COMMUNICATION, InvocationPrinter
from fsmkit.codegen.c.loop import (
    ABANDON,
    DUE,
    DUE_WITHIN,
    FORGET,
    HOST,
    INVOKE,
    LOOP_END,
    LOOP_MANY,
    LOOP_SINGLE,
    POST,
    RUN_INVOKED,
    TELL_END,
    UNHANDLED,
)
from fsmkit.codegen.c.moves import MovePrinter
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.selection import SelectionPrinter
from fsmkit.emit import Emitter
from fsmkit.expressions import ArrayType
from fsmkit.model.document import Trigger


class StepPrinter:
    """Prints them, once states and selection are printed: what those need decides what these hold.

    What is printed last may still find that events are delayed.
    """

    def __init__(
        self,
        names: Names,
        content: ContentPrinter,
        selection: SelectionPrinter,
        moves: MovePrinter,
        guards: Emitter,
        invocation: InvocationPrinter,
    ) -> None:
        """Print with these; guards of timeouts go to ``guards``, which comes before."""
        self.names = names
        self.chart = names.chart
        self.content = content
        self.selection = selection
        self.moves = moves
        self.guards = guards
        self.invocation = invocation

    def print(self, out: Emitter) -> None:
        """Print the loop, the timers and the start."""
        # its content may be the only one that sends later, which the loop must know
        start = Emitter()
        self._start_function(start)
        self.invocation.print_steps(out)
        if self.names.is_invoked and self.chart.done is not None:
            self.moves.tell_end(out, self.chart.done)
        self._loop(out)
        self.invocation.print_timers(out)
        self._fire(out)
        out.lines(start.finish().rstrip("\n").split("\n"))

    def _loop(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        has_external = self.invocation.has_external
        within = ", false" if has_external else ""
        strict = "    (void)e; /* for the hook alone */"
        if not chart.lenient:
            errors = [e for e in chart.events if e.name.startswith("error.") and not e.directions]
            strict = "\n".join(
                f"    if (e->event == {names.events[e.index]})\n"
                f"        @_stop(m, FSM_FAULT_UNHANDLED_ERROR, {quoted(e.name)});"
                for e in errors
            )
        out.lines(fill(names, UNHANDLED, STRICT=strict))
        out.line()
        single = names.plan.is_single
        flag = (
            "taken == " + names.upper + "_DEFER" if single else "found.count == 0u && found.defers"
        )
        if self.names.defers:
            deferring = (
                f"    bool is_deferred = {flag};\n"
                + ("    if (is_deferred)\n        taken = 0u;\n" if single else "")
                + "    if (is_deferred && may_defer) {\n"
                "        m->deferred[m->deferred_count] = *e;\n"
                "        m->deferred_count++;\n"
                + ("        @_take(m, 0u);\n" if single else "        @_take(m, &found);\n")
                + "        return false;\n    }"
            )
        else:
            deferring = "    (void)may_defer;"
        has_histories = any(s.is_history for s in chart.states)
        remembered = len(self.selection.remembered)
        forget = (
            f"for (uint8_t i = 0u; i < {remembered}u; i++)\n        m->asked[i] = 0u;"
            if remembered
            else "~"
        )
        text = LOOP_SINGLE if single else LOOP_MANY
        lines = fill(
            names,
            text,
            DOMAIN="uint16_t domain = @_domain(m, taken);",
            RECORD="@_record(m, domain);" if has_histories else "~",
            DEFERRING=deferring,
            FORGET=forget,
        )
        out.lines(lines)
        out.line()
        clear = []
        if self.names.defers:
            clear.append(
                "        while (m->deferred_count > 0u)\n"
                "            (void)@_take_out(m->deferred, &m->deferred_count, %_QUEUE, 0u);"
            )
        if self.names.delays:
            clear.append(
                "        while (m->delayed_count > 0u)\n            (void)@_undelay(m, 0u);"
            )
        if self.names.has_timers or self.names.delays:
            clear.append(
                "        while (m->timer_count > 0u)\n"
                "            fsm_timers_remove(m->timers, &m->timer_count, 0u);"
            )
        if names.is_invoked and chart.done is not None:
            clear.append(TELL_END)
        recall = "~"
        if self.names.defers:
            recall = (
                "    for (uint8_t i = 0u; i < m->deferred_count; i++) {\n"
                "        if (!@_is_deferred(m, (uint16_t)m->deferred[i].event)) {\n"
                "            @_event recalled =\n"
                "                @_take_out(m->deferred, &m->deferred_count, %_QUEUE, i);\n"
                f"            (void)@_macrostep(m, &recalled, true{within});\n"
                "            return true;\n"
                "        }\n"
                "    }"
            )
        due = "~"
        if names.slots:
            due = DUE_WITHIN.strip("\n")
        elif names.has_deadlines:
            due = DUE.strip("\n")
        samples = any(
            t.trigger is Trigger.EVENTLESS and t.guard is not None and reads_input(t.guard)
            for t in chart.transitions
        )
        invoke = "~"
        if names.invoking:
            invoke = INVOKE.replace("$WAITING", self.invocation.waiting)
            invoke += RUN_INVOKED if names.slots else ""
        out.lines(
            fill(
                names,
                LOOP_END + ("" if names.is_invoked else HOST) + POST,
                LOOP="complete" if names.invoking else "settle",
                INVOKE=invoke,
                FORGET=FORGET if names.invoking else "~",
                IS_EXTERNAL=", bool is_external" if has_external else "",
                BEFORE="    if (is_external)\n        @_external(m, e);" if has_external else "~",
                EXTERNAL=", true" if has_external else "",
                IDLE="@_go_on(m)" if names.slots else "false",
                CLEAR="\n".join(clear) or "~",
                RECALL=recall,
                DEFERRED_PLUS=" + m->deferred_count" if self.names.defers else "",
                TRY_EVENTLESS="    (void)@_step_eventless(m);" if samples else "~",
                TIMER_DUE=due,
            )
        )
        out.line()

    def _fire(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        out.line(f"bool {p}_step_timer({p} *m)")
        with out.block("{"):
            if not names.has_deadlines:
                out.line("(void)m;")
                out.line("return false;")
            else:
                self._first_deadline(out)
            if names.has_timers or names.delays:
                out.line("fsm_timer timer = m->timers[0];")
                out.line("fsm_timers_remove(m->timers, &m->timer_count, 0u);")
                out.line("m->now = timer.deadline;")
                if self.names.delays:
                    self._deliver(out)
                self._timeouts(out)
                out.line("return true;")
        out.line()
        del chart

    def _first_deadline(self, out: Emitter) -> None:
        """Print that nothing is due, or not here but in a machine in a slot."""
        names = self.names
        if not names.slots:
            out.line("if (!m->running || m->timer_count == 0u)")
            with out.indented():
                out.line("return false;")
            return
        out.line("uint32_t deadline = 0u;")
        out.line(f"if (!m->running || !{names.prefix}_next_deadline(m, &deadline))")
        with out.indented():
            out.line("return false;")
        within = [f"{names.prefix}_step_timer_within(m, deadline);", "return true;"]
        if names.has_timers or names.delays:
            with out.block("if (m->timer_count == 0u || m->timers[0].deadline != deadline) {"):
                out.lines(within)
        else:
            out.lines(within)

    def _passing(self) -> str:
        """Return the branches for events that go to the invoker or to an invoked machine."""
        names = self.names
        go_on = "        (void)@_go_on(m);\n" if names.slots else ""
        text = ""
        if "to_invoker" in names.used:
            text += "    } else if (due.route == %_TO_INVOKER) {\n"
            text += f"        @_to_invoker(m, &due.e);\n{go_on}"
        for slots, number in names.reached.items():
            tests = [f"m->{names.slots[slot]}.running" for slot in slots]
            running = f" && ({' || '.join(tests)})" if len(tests) > 1 else f" && {tests[0]}"
            if slots:
                text += f"    }} else if (due.route == %_TO_INVOKED_{number}{running}) {{\n"
                text += f"        @_to_invoked_{number}(m, &due.e, due.peer);\n{go_on}"
        if names.reached:
            error = names.events[self.chart.event_index[COMMUNICATION]]
            within = ", false" if self.invocation.has_external else ""
            text += "    } else if (due.route >= %_TO_INVOKED_0) {\n"
            text += f"        @_event error = @_no_event;\n        error.event = {error};\n"
            text += f"        (void)@_macrostep(m, &error, false{within});\n"
        return text.rstrip("\n") or "~"

    def _deliver(self, out: Emitter) -> None:
        self.names.used.add("emit")
        within = ", false" if self.invocation.has_external else ""
        out.lines(
            fill(
                self.names,
                """
if (timer.what == FSM_TIMER_SEND) {
    const @_delayed due = @_undelay(m, 0u);
    if (due.route == %_TO_INTERNAL) {
        (void)@_macrostep(m, &due.e, false$WITHIN);
    } else if (due.route == %_TO_PORT) {
        @_emit(m, &due.e, due.peer);
$PASSING
    } else if (@_has_room(m)) {
        m->queue[m->queue_count] = due.e;
        m->queue_count++;
    } else {
        @_count(&m->rejected);
        FSM_HOOK_TEXT(m, FSM_FULL, "queue", 0);
    }
    return true;
}
""",
                WITHIN=within,
                PASSING=self._passing(),
            )
        )

    def _timeouts(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        timed = [t for t in chart.transitions if t.trigger in (Trigger.AFTER, Trigger.EVERY)]
        out.line(f"{p}_begin(m);")
        out.line("FSM_HOOK_BEGIN(m, FSM_TIMEOUT, timer.what);")
        if not timed:
            out.line(f"(void){p}_settle(m);")
            out.line("FSM_HOOK_END(m);")
            return
        out.line("uint16_t taken = 0u;")
        with out.block("switch (timer.what) {"):
            for t in timed:
                out.line(f"case {t.index}u: /* {self.selection.comment(t)} */")
                with out.indented():
                    if t.trigger is Trigger.EVERY:
                        names.used.add("arm")
                        out.line(f"{p}_arm(m, {t.index}u, {t.delay}u);")
                    if t.guard is None:
                        out.line(f"taken = {t.index + 1}u;")
                    else:
                        out.line(f"if ({self.selection.guard(self.guards, t)})")
                        with out.indented():
                            out.line(f"taken = {t.index + 1}u;")
                    out.line("break;")
            with default(out):
                pass
        if self.selection.remembered:
            count = len(self.selection.remembered)
            out.line(f"for (uint8_t i = 0u; i < {count}u; i++)")
            with out.indented():
                out.line("m->asked[i] = 0u;")
        if names.plan.is_single:
            out.line(f"{p}_take(m, taken);")
        else:
            out.line(f"{p}_selection found = {{{{0}}, 0, false}};")
            out.line(f"{p}_add(&found, taken);")
            out.line(f"{p}_take(m, &found);")
        out.line(f"(void){p}_settle(m);")
        out.line("FSM_HOOK_END(m);")

    def _start_function(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        p = names.prefix
        start = "start_given" if names.is_invoked else "start"
        out.line(f"void {p}_{start}({p} *m, uint32_t now)")
        with out.block("{"):
            if not names.is_invoked:
                self._begin_anew(out)
            out.line("m->now = now;")
            out.line("m->running = true;")
            out.line(f"{p}_begin(m);")
            out.line("FSM_HOOK_BEGIN(m, FSM_START, 0);")
            self.content.block(out, chart.script, (), "script")
            assert chart.root.initial is not None  # noqa: S101
            initial = chart.transitions[chart.root.initial]
            self.content.block(out, initial.content, (), "initial transition")
            out.line("m->budget--;")
            self.moves.ops(out, names.plan.start)
            out.line(f"(void){p}_settle(m);")
            out.line("FSM_HOOK_END(m);")
        out.line()
        if names.is_invoked:
            out.lines(fill(names, ABANDON))
            out.line()

    def _begin_anew(self, out: Emitter) -> None:
        """Print that all but the inputs is as it was made."""
        names, p = self.names, self.names.prefix
        out.line(f"const {p} before = *m;")
        out.line(f"{p}_init(m);")
        for variable in self.chart.inputs:
            name = names.variables[variable.name]
            if isinstance(variable.type, ArrayType):
                out.line(f"for (uint32_t i = 0u; i < {variable.type.length}u; i++)")
                with out.indented():
                    out.line(f"m->{name}[i] = before.{name}[i];")
            else:
                out.line(f"m->{name} = before.{name};")
        if not self.chart.inputs:
            out.line("(void)before;")
