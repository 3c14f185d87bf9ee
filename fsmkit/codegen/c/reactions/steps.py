"""The functions that run a machine: the loop, the timers, the start."""

from __future__ import annotations

from functools import partial

from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.form_printer import FormPrinter
from fsmkit.codegen.c.reactions.invocation import InvocationPrinter
from fsmkit.codegen.c.reactions.reactions import ReactionPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.reactions.timeouts import TimeoutPrinter, print_macrostep
from fsmkit.emit import Emitter
from fsmkit.emit.c import quoted
from fsmkit.plan.selection import Concurrency


class StepPrinter:
    """Prints the steps that the host calls."""

    def __init__(
        self,
        names: Names,
        content: ContentPrinter,
        selection: SelectionPrinter,
        form: FormPrinter,
        reactions: ReactionPrinter,
        answers: Unit,
        invocation: InvocationPrinter,
    ) -> None:
        """Create a printer that uses these; ``answers``: the functions that handle events."""
        self.names = names
        self.chart = names.chart
        self.content = content
        self.selection = selection
        self.form = form
        self.reactions = reactions
        self.answers = answers
        self.invocation = invocation
        self.timeouts = TimeoutPrinter(names, selection, reactions, invocation)

    def print(self, out: Unit) -> None:
        """Print the loop, the timers and the start."""
        # first, for what their content calls: what sends it on depends on the machines it goes to
        content, timeouts = Emitter(), Emitter()
        self._initial(content)
        self.timeouts.answers(timeouts)
        self.invocation.print_steps(out)
        if self.names.is_invoked and self.chart.done is not None:
            self.form.actions.print_end_report(out, self.chart.done)
        self._loop(out)
        self.invocation.print_timers(out)
        self.timeouts.print(out, timeouts)
        self._start_function(out, content)

    def _loop(self, out: Unit) -> None:
        names, chart = self.names, self.chart
        strict = []
        if not chart.lenient and names.does.raises:
            for event in chart.events:
                if event.name.startswith("error.") and not event.directions:
                    stop = f"m, FSM_FAULT_UNHANDLED_ERROR, {quoted(event.name)}"
                    strict.append(f"if (e->event == {names.events[event.index]}) {{")
                    strict += [f"    {names.own}_stop({stop});", "}"]
        print_pieces(out, names, "loop", "unhandled", parts={"SELF_STRICT": strict})
        self._taking(out)
        defers, external = names.does.defers, names.does.external
        parts = {
            "SELF_MAY_DEFER": ", bool may_defer" if defers else "",
            "SELF_DEFERS": ", may_defer" if defers else "",
            "SELF_ALWAYS": ", true" if defers else "",
            "SELF_NEVER": ", false" if defers else "",
            "SELF_IS_EXTERNAL": ", bool is_external" if external else "",
            "SELF_FROM_OUTSIDE": ", true" if external else "",
            "SELF_WITHIN": ", false" if external else "",
            "SELF_RUNNING": names.running,
            "SELF_STOPPED": names.stopped,
            "SELF_REJECTS_POSTS": names.rejects_posts,
            "SELF_REFUSES": names.ignores_steps,
            "SELF_ACTED": "acted" if names.does.loops else "false",
            "SELF_LEAVE_MACHINE": [self.form.exit_machine_call()],
            "SELF_WAITING": self.invocation.waiting if names.invoking else "",
        }
        steps = [
            *(["complete"] if names.does.settles and names.invoking else []),
            *(["settle"] if names.does.settles else []),
            *(["rest"] if names.does.rests else []),
            *(["begin"] if names.does.begins else []),
            "macrostep",
            *(["step_event"] if names.does.queued else []),
        ]
        if not names.is_invoked:
            steps += ["step_eventless"] if names.does.polls else []
            steps += ["run"] if names.does.runs else []
            steps.append("dispatch")
        print_pieces(out, names, "loop", *steps, parts=parts)
        if names.does.queued:
            print_pieces(out, names, "queue", "post", parts=parts)

    def _taking(self, out: Unit) -> None:
        """Print the functions that take selected transitions and dispatch events."""
        names, decisions = self.names, self.reactions.decisions
        single = names.plan.is_single
        remembered = len(self.selection.remembered)
        forget = [
            f"for (uint32_t i = 0u; i < {remembered}u; i++) {{",
            "    m->fsm.asked[i] = 0u;",
            "}",
        ]
        parts = {
            "SELF_FORGET_ASKED": forget if remembered else [],
            "SELF_STRAIGHT": self._straight(),
        }
        pieces = partial(print_pieces, out, names, "selection", parts=parts)
        if names.does.eventless or names.does.raises:
            pieces("may_go_on")
        if decisions.is_general:
            self.form.print_take(out)
            if not single:
                pieces("take_one")
        if decisions.eventless is Concurrency.PREEMPTING:
            pieces("take_eventless")
        if decisions.is_general and not names.does.defers:
            pieces("respond_any")
        out.include(self.answers)
        out.line()
        pieces("react")

    def _straight(self) -> list[str]:
        """Return the statement that passes events that are never deferred to straight code."""
        decisions, names = self.reactions.decisions, self.names
        if not decisions.has_straight:
            return []
        general = sorted(decisions.preempting | decisions.deferred)
        return [
            "switch (e->event) {",
            *(f"    case {names.events[event]}:" for event in general),
            "        break;",
            "    default:",
            f"        return {names.own}_respond(m, e);",
            "}",
        ]

    def _initial(self, out: Emitter) -> None:
        """Print the initial script and the initial entry."""
        chart = self.chart
        self.content.block(out, chart.script, (), "script")
        assert chart.root.initial is not None  # noqa: S101
        initial = chart.transitions[chart.root.initial]
        self.content.block(out, initial.content, (), "initial transition")
        self.form.entry(out, self.names.plan.start)

    def _start_function(self, out: Unit, content: Emitter) -> None:
        names = self.names
        p = names.own
        start = "start_given" if names.is_invoked else "start"
        out.define()
        out.line(f"void {p}_{start}({p} *m, uint32_t now)")
        with out.block("{"):
            if not names.is_invoked:
                if names.does.guarded:
                    with out.block("if (m->fsm.busy) {"):
                        out.line("return;")
                self._reset(out)
            out.line("m->fsm.now = now;" if names.does.now else "(void)now;")
            if names.does.running:
                out.line("m->fsm.running = true;")
            print_macrostep(out, names, "FSM_START, 0", content.collected())
        out.line()
        if names.is_invoked:
            parts = {"SELF_LEAVE_MACHINE": [self.form.exit_machine_call()]}
            print_pieces(out, names, "invocation", "abandon", parts=parts)

    def _reset(self, out: Emitter) -> None:
        """Print the reset of everything but the inputs."""
        p = self.names.own
        if self.chart.inputs:
            out.line(f"const {p} before = *m;")
        out.line(f"{p}_init(m);")
        if self.chart.inputs:
            out.line("m->in = before.in;")
