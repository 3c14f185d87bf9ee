"""Straight code for the reactions to an event, where they are known at compile time.

If all transitions of an event lie in one region, at most one of them is taken. For each state that
can be the deepest active one there, the guards follow each other. Each is followed by what its
transition exits, does and enters.

If they lie in several independent regions, each region selects first. Then all exit, act and enter
in document order (Appendix D, microstep). The other transitions, which may preempt each other, are
left to `selection`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from fsmkit.chart.analysis.effects import can_stop, is_plain
from fsmkit.chart.chart import Transition
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.forms import Form
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.codegen.c.reactions.answers import print_answers
from fsmkit.codegen.c.reactions.form_printer import FormPrinter, Lines
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.plan import Enter, Plan, Reaction, Region
from fsmkit.plan.operations import Leave
from fsmkit.plan.selection import Candidate, Concurrency

HANDLED = "return FSM_HANDLED;"
FEW = 2
"""The number of states that are exited one by one; a loop exits more of them."""


@fast_init
@dataclass(frozen=True, slots=True)
class Step:
    """The effects of one transition."""

    record: Lines = ()
    leave: Lines = ()
    act: Lines = ()
    enter: Lines = ()

    @property
    def lines(self) -> Lines:
        """All lines, in order."""
        return (*self.record, *self.leave, *self.act, *self.enter)


@fast_init
@dataclass(frozen=True, slots=True)
class Answer:
    """The reaction of a state to an event; ``returns``: it always returns."""

    lines: Lines = ()
    returns: bool = False


PHASES: tuple[tuple[str, Callable[[Step], Lines], bool], ...] = (
    ("record", lambda step: step.record, False),
    ("leave", lambda step: step.leave, True),
    ("act", lambda step: step.act, False),
    ("enter", lambda step: step.enter, False),
)
"""The phases of a microstep in their order (Appendix D); true where the last region is first."""
MOST_TOGETHER = 64
"""The greatest number of regions in one function."""


class ReactionPrinter:
    """Prints a function for each event, or, in a chart of one region, for each state."""

    def __init__(
        self,
        names: Names,
        content: ContentPrinter,
        form: FormPrinter,
        selection: SelectionPrinter,
    ) -> None:
        """Create a printer that uses these printers."""
        self.names = names
        self.chart = names.chart
        self.plan: Plan = names.plan
        self.own = names.own
        self._ignored = f"return {names.own}_unhandled(m, cause);"
        self._content = content
        self.form = form
        self._selection = selection
        self._acts: dict[int, Lines] = {}
        self._stopping: dict[int, list[int]] = {}
        self._parts = 0
        self.decisions = selection.decisions
        self.by_event = self.decisions.by_event

    # --- what a transition does -----------------------------------------------------------

    def candidates(self, leaf: int, event: int | None) -> list[Transition]:
        """Return the transitions that an event, or none, tries while a state is the deepest."""
        return transitions(self.decisions.candidates(leaf, event))

    def comment(self, transition: Transition) -> str:
        """Return a comment that names the transition."""
        return f"/* {self._selection.comment(transition)} */"

    def guard(self, transition: Transition) -> str:
        """Return the condition of a guard."""
        return self._selection.guard(transition)

    def step(self, transition: Transition) -> Step:
        """Return the effects of a transition."""
        if self.names.form is Form.TABLES:
            number = self.form.numbers(transition.index)[0]
            return Step(act=(self.form.take_call(f"{number}u"),))
        *others, last = self.plan.reactions[transition.index]
        if not others:
            return self._step(transition, last)
        out = Emitter()
        word = "if"
        for reaction in others:
            tests = " && ".join(map(self.form.histories.within, reaction.conditions))
            with out.block(f"{word} ({tests}) {{"):
                out.lines(self._step(transition, reaction).lines)
            word = "else if"
        with out.block("else {"):
            out.lines(self._step(transition, last).lines)
        return Step(enter=out.collected())

    def _step(self, transition: Transition, reaction: Reaction) -> Step:
        act = self._act(transition)
        if reaction.domain is None:
            return Step(act=act)
        record, leave, enter = Emitter(), Emitter(), Emitter()
        states = [op.state for op in reaction.leave if isinstance(op, Leave)]
        is_loop = not 0 < len(states) <= FEW
        if not (is_loop and self.plan.is_single):  # the loop records what it leaves
            self.form.histories.record_all(record, reaction.record)
        if is_loop:
            leave.line(self.form.exit_below_call(reaction.domain))
        else:
            self.form.exit_listed(leave, reaction)
            first = reaction.enter[0] if reaction.enter else None
            if not is_plain(transition.content) or not isinstance(first, Enter):
                leave.line(self.form.set_active(reaction.domain))
        self.form.entry(enter, reaction.enter)
        return Step(record.collected(), leave.collected(), act, enter.collected())

    def _act(self, transition: Transition) -> Lines:
        if transition.index not in self._acts:
            out = Emitter()
            what = self._selection.comment(transition)
            out.line(f"{self.names.hook('TAKE')}(m, {transition.index}u);")
            self._content.block(out, transition.content, transition.events, what)
            self._acts[transition.index] = out.collected()
        return self._acts[transition.index]

    # --- one at most ----------------------------------------------------------------------

    def _answer(
        self,
        candidates: Sequence[Transition],
        before: Sequence[str] = (),
        *,
        may_stop: bool = False,
    ) -> Answer:
        """Return the code that takes the first enabled transition and returns.

        ``before``: the lines that every eventless transition starts with; ``may_stop``: whether an
        earlier guard can have stopped the machine.
        """
        done = "return true;" if before else HANDLED
        out = Emitter()
        for transition in candidates:
            guard = transition.guard
            may_stop = may_stop or (guard is not None and can_stop(guard))
            out.line(self.comment(transition))
            if guard is not None:
                out.open(f"if ({self.guard(transition)}) {{")
            out.lines(before)
            if may_stop and not before:
                out.lines(["if (m->fsm.fault != FSM_NO_FAULT) {", f"    {done}", "}"])
            out.lines(self.step(transition).lines)
            out.line(done)
            if guard is not None:
                out.close()
        is_open = not candidates or candidates[-1].guard is not None
        return Answer(out.collected(), returns=not is_open)

    def print_eventless(self, out: Unit) -> None:
        """Print the function that takes eventless transitions, if none can preempt another."""
        transitions = [t for t in self.chart.transitions if t.trigger is Trigger.EVENTLESS]
        if self.decisions.eventless is not Concurrency.SINGLE_REGION:
            return
        (region,) = self.decisions.regions(transitions)
        before = (f"if (!{self.own}_may_go_on(m)) {{", "    return true;", "}")
        out.define("take_eventless")
        out.line(f"static bool {self.own}_take_eventless({self.own} *m)")
        self._over_leaves(
            out,
            self.plan.regions[region],
            lambda leaf: self._answer(self.candidates(leaf, None), before),
            "return false;",
        )

    def _over_leaves(
        self, out: Emitter, region: Region, answer: Callable[[int], Answer], otherwise: str
    ) -> None:
        """Print the body of a function: a switch over the deepest active states of a region."""
        answers: dict[Answer, list[int]] = {}
        for leaf in self.decisions.leaf_states(region):
            answers.setdefault(answer(leaf), []).append(leaf)
        answers.pop(Answer(), None)
        region_number = f"m->{self.names.regions[region.index]}"
        with out.block("{"), out.block(f"switch ({region_number}) {{"):
            for what, leaves in answers.items():
                for leaf in leaves:
                    out.line(f"case {self.names.number(leaf)}:")
                with out.indented():
                    out.lines(what.lines)
                    if not what.returns:
                        out.line(otherwise)
            out.lines(["default:", f"    {otherwise}"])
        out.line()

    # --- by state: a chart of one region --------------------------------------------------

    def print_by_state(self, out: Unit) -> None:
        """Print the reactions of each state to each event."""
        p = self.own
        calls = self._calls(out)
        out.define("not_running")
        out.line(f"static fsm_result {p}_not_running({p} *m, const {p}_event *cause)")
        with out.block("{"):
            out.lines(["(void)m;", "(void)cause;", "return FSM_STOPPED;"])
        out.line()
        leaves = set(self.decisions.leaf_states(self.plan.regions[0]))
        rows = []
        for state in self.chart.states[: max(leaves, default=0) + 1]:
            name = calls.get(state.index, f"{p}_unhandled") if state.index in leaves else ""
            note = state.id if state.index else "not started, or finished"
            rows.append((name or f"{p}_not_running", note))
        index = f"m->{self.names.regions[0]}"
        print_answers(out, self.names, "By the deepest active state.", rows, index, "not_running")

    def _calls(self, out: Unit) -> dict[int, str]:
        """Print the function of each state with reactions; unhandled events go to an ancestor."""
        calls = {0: f"{self.own}_unhandled"}
        for state in self.plan.regions[0].states:
            above = calls[state] = calls[self.plan.region_parents[state]]
            answers: dict[Answer, list[int]] = {}
            for event in self.by_event:
                if event not in self.decisions.preempting:
                    found = transitions(self.decisions.candidates_of(state, event))
                    if found:
                        may_stop = self.decisions.can_stop_below(state, event)
                        answer = self._answer(found, may_stop=may_stop)
                        answers.setdefault(answer, []).append(event)
            if answers:
                calls[state] = self._state_function(out, state, answers, above)
        return calls

    def _state_function(
        self, out: Unit, state: int, answers: dict[Answer, list[int]], otherwise: str
    ) -> str:
        """Print the function of a state; return its name."""
        name, p = self.names.function("at", state), self.own
        out.define(name)
        out.line(f"static fsm_result {name}({p} *m, const {p}_event *cause) {self._where(state)}")
        with out.block("{"):
            self._over_events(out, answers, f"return {otherwise}(m, cause);")
        out.line()
        return name

    def _where(self, state: int) -> str:
        place = self.names.place(self.chart.states[state].span)
        ids = [self.chart.states[each].id for each in self.plan.chains[state]]
        return self.names.remark(f"{place}  " + " in ".join(ids))

    def _over_events(self, out: Emitter, answers: dict[Answer, list[int]], otherwise: str) -> None:
        if [len(events) for events in answers.values()] == [1]:
            ((answer, (event,)),) = answers.items()
            with out.block(f"if (cause->event == {self.names.events[event]}) {{"):
                out.lines(answer.lines)
            out.line(otherwise)
            return
        with out.block("switch (cause->event) {"):
            for what, events in answers.items():
                for event in events:
                    out.line(f"case {self.names.events[event]}:")
                with out.indented():
                    out.lines(what.lines)
                    if not what.returns:
                        out.line(otherwise)
            out.lines(["default:", f"    {otherwise}"])

    # --- by event: a chart of several regions ---------------------------------------------

    def print_by_event(self, out: Unit) -> None:
        """Print the reaction to each event, in all regions that handle it."""
        p = self.own
        calls: dict[int, str] = {}
        for event, transitions in self.by_event.items():
            shape = self.decisions.concurrency(event)
            if shape is Concurrency.PREEMPTING:
                continue
            name = f"{p}_on_{self.names.event_names[event]}"
            calls[event] = name
            if shape is Concurrency.INDEPENDENT:
                self._apart(out, name, transitions, event)
                continue
            out.define(name)
            out.line(f"static fsm_result {name}({p} *m, const {p}_event *cause)")
            (region,) = self.decisions.regions(transitions)

            def answer(leaf: int, event: int = event) -> Answer:
                return self._answer(self.candidates(leaf, event))

            self._over_leaves(out, self.plan.regions[region], answer, self._ignored)
        rows = [(f"{p}_unhandled", "no event")]
        for event in range(max(self.by_event, default=-1) + 1):
            name = calls.get(event, f"{p}_unhandled")
            if event in self.decisions.preempting and not self.names.does.defers:
                name = f"{p}_respond_any"
            rows.append((name, self.chart.events[event].name))
        print_answers(out, self.names, "By event.", rows, "cause->event", "unhandled")

    def _apart(self, out: Unit, name: str, transitions: Sequence[Transition], event: int) -> None:
        """Print a function for independent regions."""
        regions = [self.plan.regions[r] for r in self.decisions.regions(transitions)]
        head = f"static fsm_result {name}({self.own} *m, const {self.own}_event *cause)"
        if len(regions) > MOST_TOGETHER:
            self._apart_by_parts(out, name, head, regions, event)
            return
        ways = [f"way{place}" for place in range(len(regions))]
        out.define(name)
        out.line(head)
        with out.block("{"):
            chosen = []
            for region, way in zip(regions, ways, strict=True):
                choice = Emitter()
                steps = self._choose(choice, region, way, event)
                out.line(f"{'uint8_t' if len(steps) <= NARROW else 'uint16_t'} {way} = 0u;")
                out.lines(choice.collected())
                chosen.append(steps)
            out.lines([f"if (({' | '.join(ways)}) == 0u) {{", f"    {self._ignored}", "}"])
            for _, phase, is_reversed in PHASES:
                order = range(len(regions))
                for place in reversed(order) if is_reversed else order:
                    self._over_steps(out, ways[place], [phase(step) for step in chosen[place]])
            out.line(HANDLED)
        out.line()

    def _apart_by_parts(
        self, out: Unit, name: str, head: str, regions: Sequence[Region], event: int
    ) -> None:
        """Print the same in parts, since a compiler's time is not linear in a function's size."""
        p, count = self.own, len(regions)
        calls: list[str] = []
        chosen: list[list[Step]] = []
        parts = [range(count)[at : at + MOST_TOGETHER] for at in range(0, count, MOST_TOGETHER)]
        ctype = "uint16_t"

        def part(verb: str, body: Emitter) -> None:
            if not body.collected():
                return
            own = f"{p}_part_{self._parts}"
            self._parts += 1
            way = f"{'const ' if verb != 'choose' else ''}{ctype} *way"
            out.define(own)
            out.line(self.names.remark(f"{self.chart.events[event].name}: {verb}"))
            out.line(f"static void {own}({p} *m, {way})")
            with out.block("{"):
                out.lines(body.collected())
            out.line()
            calls.append(f"{own}(m, way);")

        for places in parts:
            body = Emitter()
            chosen += [self._choose(body, regions[at], f"way[{at}]", event) for at in places]
            part("choose", body)
        asked, calls = calls, []
        for verb, phase, is_reversed in PHASES:
            for places in parts[:: -1 if is_reversed else 1]:
                body = Emitter()
                for at in places[:: -1 if is_reversed else 1]:
                    self._over_steps(body, f"way[{at}]", [phase(step) for step in chosen[at]])
                part(verb, body)
        out.define(name)
        out.line(head)
        with out.block("{"):
            out.lines([f"{ctype} way[{count}] = {{0u}};", f"{ctype} any = 0u;", *asked])
            with out.block(f"for (uint32_t i = 0u; i < {count}u; i++) {{"):
                out.line(f"any = ({ctype})(any | way[i]);")
            out.lines(["if (any == 0u) {", f"    {self._ignored}", "}", *calls, HANDLED])
        out.line()

    def _choose(self, out: Emitter, region: Region, variable: str, event: int) -> list[Step]:
        """Print the choice of a region's step, 0 for none; return the steps numbered from 1."""
        steps: list[Step] = []
        with out.block(f"switch (m->{self.names.regions[region.index]}) {{"):
            for leaf in self.decisions.leaf_states(region):
                found = self.candidates(leaf, event)
                if not found:
                    continue
                out.line(f"case {self.names.number(leaf)}:")
                with out.indented():
                    for place, transition in enumerate(found):
                        steps.append(self.step(transition))
                        otherwise = "} else " if place else ""
                        if transition.guard is not None:
                            out.line(f"{otherwise}if ({self.guard(transition)}) {{")
                        elif place:
                            out.line("} else {")
                        inset = "    " if place or transition.guard is not None else ""
                        out.line(f"{inset}{variable} = {len(steps)}u; {self.comment(transition)}")
                    if len(found) > 1 or found[0].guard is not None:
                        out.line("}")
                    out.line("break;")
            default(out)
        return steps

    def _over_steps(self, out: Emitter, variable: str, parts: Sequence[Lines]) -> None:
        """Print a switch over the chosen step of a region, if any step has an effect here."""
        answers: dict[Lines, list[int]] = {}
        for number, lines in enumerate(parts, 1):
            if lines:
                answers.setdefault(lines, []).append(number)
        if not answers:
            return
        with out.block(f"switch ({variable}) {{"):
            for lines, numbers in answers.items():
                out.lines(f"case {number}u:" for number in numbers)
                with out.indented():
                    out.lines((*lines, "break;"))
            default(out)


def transitions(candidates: Iterable[Candidate]) -> list[Transition]:
    """Return the transitions among candidates of an event that nothing defers."""
    return [each for each in candidates if isinstance(each, Transition)]
