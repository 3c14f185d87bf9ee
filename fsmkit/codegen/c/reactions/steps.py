"""The functions that make a machine run: the loop, the timers, the start."""

from __future__ import annotations

from fsmkit.analysis.effects import can_stop
from fsmkit.chart.content import reads_input
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.helpers import fill
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.deferral import is_kept
from fsmkit.codegen.c.reactions.entry_sets import MovePrinter
from fsmkit.codegen.c.reactions.invocation import InvocationPrinter
from fsmkit.codegen.c.reactions.loop import (
    ABANDON,
    DUE,
    DUE_WITHIN,
    FORGET,
    HOST,
    INVOKE,
    LOOP_END,
    POST,
    REACT,
    RUN_INVOKED,
    TELL_END,
    UNHANDLED,
)
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.reactions.shapes import Shape, Shapes
from fsmkit.codegen.c.reactions.timeouts import TimeoutPrinter
from fsmkit.codegen.c.reactions.transition_execution import (
    EVENTLESS_MANY,
    EVENTLESS_SINGLE,
    MAY_GO_ON,
    REACT_MANY,
    REACT_SINGLE,
    RESPOND_ANY,
    RESPOND_SINGLE,
    TAKE_MANY,
    TAKE_ONE,
)
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.texts.c import quoted

ANSWERS = "the functions that answer events, which are printed already"


class StepPrinter:
    """Prints the steps that the host calls."""

    def __init__(
        self,
        names: Names,
        content: ContentPrinter,
        selection: SelectionPrinter,
        moves: MovePrinter,
        reactions: ReactionPrinter,
        answers: Emitter,
        invocation: InvocationPrinter,
    ) -> None:
        """Print with these; ``answers``: the functions that answer events."""
        self.names = names
        self.chart = names.chart
        self.content = content
        self.selection = selection
        self.moves = moves
        self.reactions = reactions
        self.answers = answers
        self.invocation = invocation
        self.timeouts = TimeoutPrinter(names, selection, reactions, invocation)

    def print(self, out: Emitter) -> None:
        """Print the loop, the timers and the start."""
        # first, for what their content calls: what sends it on depends on the machines it goes to
        content, timeouts = Emitter(), Emitter()
        self._initial(content)
        self.timeouts.answers(timeouts)
        self.invocation.print_steps(out)
        if self.names.is_invoked and self.chart.done is not None:
            self.moves.tell_end(out, self.chart.done)
        self._loop(out)
        self.invocation.print_timers(out)
        self.timeouts.print(out, timeouts)
        self._start_function(out, content)

    def _loop(self, out: Emitter) -> None:
        names, chart = self.names, self.chart
        has_external = names.does.external
        within = ", false" if has_external else ""
        strict = "    (void)e; /* for the hook alone */"
        if not chart.lenient:
            errors = [e for e in chart.events if e.name.startswith("error.") and not e.directions]
            if names.does.raises:
                strict = "\n".join(
                    f"    if (e->event == {names.events[e.index]}) {{\n"
                    f"        @_stop(m, FSM_FAULT_UNHANDLED_ERROR, {quoted(e.name)});\n    }}"
                    for e in errors
                )
        out.lines(fill(names, UNHANDLED, STRICT=strict))
        out.line()
        self._taking(out)
        clear = []
        if self.names.does.defers:
            clear.append(
                "        while (m->fsm.deferred_count > 0u) {\n"
                "            (void)@_take_out(m->fsm.deferred, &m->fsm.deferred_count, "
                "%_QUEUE, 0u);\n        }"
            )
        if self.names.does.delays:
            clear.append(
                "        while (m->fsm.delayed_count > 0u) {\n"
                "            (void)@_undelay(m, 0u);\n        }"
            )
        if self.names.has_timers or self.names.does.delays:
            clear.append(
                "        while (m->fsm.timer_count > 0u) {\n"
                "            fsm_timers_remove(m->fsm.timers, &m->fsm.timer_count, 0u);\n        }"
            )
        if names.is_invoked and chart.done is not None:
            clear.append(TELL_END)
        empty = "m->fsm.queue_count == 0u"
        recall, has_nothing = "~", f"{empty} || {names.refuses}"
        if names.slots or names.does.defers:
            has_nothing = names.refuses
            idle = "@_go_on(m)" if names.slots else "false"
            recall = f"[queued]    if ({empty}) {{\n[queued]        return {idle};\n[queued]    }}"
        if self.names.does.defers:
            recall = (
                "    for (uint8_t i = 0u; i < m->fsm.deferred_count; i++) {\n"
                "        if (!@_is_deferred(m, (uint16_t)m->fsm.deferred[i].event)) {\n"
                "            @_event recalled =\n"
                "                @_take_out(m->fsm.deferred, &m->fsm.deferred_count, %_QUEUE, i);\n"
                f"            (void)@_macrostep(m, &recalled, true{within});\n"
                "            return true;\n"
                "        }\n"
                f"    }}\n{recall}"
            )
        due = "~"
        if names.slots:
            due = DUE_WITHIN.strip("\n")
        elif names.does.deadlines:
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
                BEFORE="    if (is_external) {\n        @_external(m, e);\n    }"
                if has_external
                else "~",
                EXTERNAL=", true" if has_external else "",
                CLEAR="\n".join(clear if names.does.ends else ()) or "~",
                RECALL=recall,
                DEFERRED_PLUS=" + m->fsm.deferred_count" if self.names.does.defers else "",
                TRY_EVENTLESS="    (void)@_step_eventless(m);" if samples else "~",
                TIMER_DUE=due,
                RUNNING=names.running,
                STOPPED=names.stopped,
                REFUSES=names.refuses,
                HAS_NOTHING=has_nothing,
                LEAVE=self.moves.leave_machine(),
                ACTED="acted" if names.does.loops else "false",
                MAY_DEFER=", bool may_defer" if names.does.defers else "",
                DEFER=", may_defer" if names.does.defers else "",
                ALWAYS=", true" if names.does.defers else "",
                NEVER=", false" if names.does.defers else "",
            )
        )
        out.line()

    def _taking(self, out: Emitter) -> None:
        """Print how transitions are taken that are not straight code, and who answers an event."""
        names, reactions = self.names, self.reactions
        single = names.plan.is_single
        remembered = len(self.selection.remembered)
        forget = (
            f"for (uint32_t i = 0u; i < {remembered}u; i++) {{\n"
            "        m->fsm.asked[i] = 0u;\n    }"
            if remembered
            else "~"
        )
        may_fault = any(t.guard is not None and can_stop(t.guard) for t in self.chart.transitions)
        preempts = Shapes(names.plan).is_general
        texts = [MAY_GO_ON] if names.does.eventless or names.does.raises else []
        if reactions.shapes.is_general:
            texts.append(self.moves.take_text if single else TAKE_MANY)
            if not single:
                texts.append(TAKE_ONE)
        if reactions.shapes.eventless is Shape.ANY:
            texts.append(EVENTLESS_SINGLE if single else EVENTLESS_MANY)
        if reactions.shapes.is_general and not names.does.defers:
            texts.append(RESPOND_SINGLE if single else RESPOND_ANY)
        texts.append(ANSWERS)
        if names.does.defers:
            texts.append(REACT_SINGLE if single else REACT_MANY)
        else:
            texts.append(REACT)
        for text in texts:
            if text is ANSWERS:
                out.lines(self.answers.collected())
                out.line()
                continue
            record = "@_record(m, domain);" if names.histories else "~"
            out.lines(
                fill(
                    names,
                    text,
                    RECORD=record,
                    FORGET=forget,
                    PREEMPT="@_remove_conflicts(m, &found);" if preempts else "~",
                    FAULTY=" || m->fsm.fault != FSM_NO_FAULT" if may_fault else "",
                    STRAIGHT=self._straight(),
                    KEPT=is_kept(names),
                    SOUND=" && m->fsm.fault == FSM_NO_FAULT" if may_fault else "",
                )
            )
            out.line()

    def _straight(self) -> str:
        """Return what sends events that nothing defers to straight code."""
        if not self.reactions.shapes.has_straight:
            return "~"
        shapes, names = self.reactions.shapes, self.names
        general = sorted(
            {e for e in shapes.by_event if shapes.shape(e) is Shape.ANY} | shapes.deferred
        )
        cases = "".join(f"        case {names.events[event]}:\n" for event in general)
        return (
            f"    switch (e->event) {{\n{cases}            break;\n        default:\n"
            "            return @_respond(m, e);\n    }"
        )

    def _initial(self, out: Emitter) -> None:
        """Print the script and what is entered first."""
        chart = self.chart
        self.content.block(out, chart.script, (), "script")
        assert chart.root.initial is not None  # noqa: S101
        initial = chart.transitions[chart.root.initial]
        self.content.block(out, initial.content, (), "initial transition")
        self.moves.ops(out, self.names.plan.start)

    def _start_function(self, out: Emitter, content: Emitter) -> None:
        names = self.names
        p = names.prefix
        start = "start_given" if names.is_invoked else "start"
        out.line(f"void {p}_{start}({p} *m, uint32_t now)")
        with out.block("{"):
            if not names.is_invoked:
                if names.does.guarded:
                    with out.block("if (m->fsm.busy) {"):
                        out.line("return;")
                self._begin_anew(out)
            out.line("m->fsm.now = now;" if names.does.now else "(void)now;")
            if names.does.running:
                out.line("m->fsm.running = true;")
            if names.does.begins:
                out.line(f"{p}_begin(m);")
            out.line("FSM_HOOK_BEGIN(m, FSM_START, 0);")
            if names.does.loops:
                out.line("m->fsm.budget--;")
            out.lines(content.collected())
            if names.does.settles:
                out.line(f"(void){p}_settle(m);")
            if names.does.rests:
                out.line(f"{p}_rest(m);")
            out.line("FSM_HOOK_END(m);")
        out.line()
        if names.is_invoked:
            out.lines(fill(names, ABANDON, LEAVE=self.moves.leave_machine()))
            out.line()

    def _begin_anew(self, out: Emitter) -> None:
        """Print that all but the inputs is as it was made."""
        p = self.names.prefix
        if self.chart.inputs:
            out.line(f"const {p} before = *m;")
        out.line(f"{p}_init(m);")
        if self.chart.inputs:
            out.line("m->in = before.in;")
