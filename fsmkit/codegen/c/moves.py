"""Leaving, recording and entering states in C: what the Plan says, spelt out."""

from __future__ import annotations

from fsmkit.codegen.c.content import ContentPrinter
from fsmkit.codegen.c.effects import can_fail
from fsmkit.codegen.c.expressions import Printer
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.transfer import Place, copy, put_default
from fsmkit.emit import Emitter
from fsmkit.model.document import Kind, Trigger
from fsmkit.plan import Branch, Content, Enter, Move, Op, Plan, Region, Restore, Within
from fsmkit.plan.entries import entry_by_default


class MovePrinter:
    """Prints the functions that change the configuration."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Print with these names."""
        self.names = names
        self.plan: Plan = names.plan
        self.chart = names.chart
        self.content = content
        self.prefix = names.prefix

    # --- what one state does --------------------------------------------------------------

    def leave_state(self, out: Emitter, state: int) -> None:
        """Print the hook, the timers and the exit handlers of a state."""
        names = self.names
        out.line(f"FSM_HOOK_EXIT(m, {names.states[state]});")
        for transition in self._timed(state):
            out.line(f"fsm_timers_disarm(m->timers, &m->timer_count, {transition}u);")
        what = f"exit of {self.chart.states[state].id}"
        for block in self.chart.states[state].on_exit:
            self.content.block(out, block, (), what)
        if self.chart.states[state].invokes:
            member, bit = names.to_invoke(state)
            out.line(f"{member} = (uint8_t)({member} & {255 - bit}u);")
        for invocation in self.chart.invocations:
            if invocation.state == state:
                out.line(f"{self.prefix}_end_{invocation.index}(m);")

    def enter_state(self, out: Emitter, state: int) -> None:
        """Print the number, the timers and the entry handlers of a state."""
        names, plan = self.names, self.plan
        region = plan.region_of[state]
        out.line(f"m->{names.regions[region]} = {plan.number[state]}u;")
        out.line(f"FSM_HOOK_ENTER(m, {names.states[state]});")
        for transition in self._timed(state):
            delay = self.chart.transitions[transition].delay
            names.used.add("arm")
            out.line(f"{self.prefix}_arm(m, {transition}u, {delay}u);")
        if self.chart.states[state].invokes:
            member, bit = names.to_invoke(state)
            out.line(f"{member} = (uint8_t)({member} | {bit}u);")
        what = f"entry of {self.chart.states[state].id}"
        for block in self.chart.states[state].on_entry:
            self.content.block(out, block, (), what)
        if self.chart.states[state].kind is Kind.FINAL:
            self._final(out, state)

    def _timed(self, state: int) -> list[int]:
        return [
            t
            for t in self.chart.states[state].transitions
            if self.chart.transitions[t].trigger in (Trigger.AFTER, Trigger.EVERY)
        ]

    def _final(self, out: Emitter, state: int) -> None:
        """SCXML 3.7: the end of the machine, or the done events of the parents."""
        chart = self.chart
        parent = chart.states[state].parent
        assert parent is not None  # noqa: S101
        if parent == 0:
            out.line("m->running = false;")
            out.line("m->finished = true;")
            return
        self._done(out, parent, state)
        above = chart.states[parent].parent
        if above is not None and chart.states[above].kind is Kind.PARALLEL:
            event = chart.event_index.get(f"done.state.{chart.states[above].id}")
            if event is not None:
                out.open(f"if ({self._in_final(above)}) {{")
                self._done(out, above, None)
                out.close()

    def _in_final(self, state: int) -> str:
        """Return the condition of Appendix D, isInFinalState."""
        chart = self.chart
        children = [c for c in chart.states[state].children if not chart.states[c].is_history]
        if chart.states[state].kind is Kind.PARALLEL:
            return " && ".join(self._in_final(child) for child in children)
        finals = [c for c in children if chart.states[c].kind is Kind.FINAL]
        tests = [self.names.in_state("m", final) for final in finals]
        return f"({' || '.join(tests)})" if tests else "false"

    def _done(self, out: Emitter, state: int, final: int | None) -> None:
        chart, names = self.chart, self.names
        event = chart.event_index.get(f"done.state.{chart.states[state].id}")
        if event is None:
            return
        self._done_event(out, event, final)
        out.line(f"{self.prefix}_raise(m, &e, false);")
        names.used.add("raise")
        out.close()

    def tell_end(self, out: Emitter, event: int) -> None:
        """Print the function that tells the invoker of the end, with the final state's data."""
        names = self.names
        names.used.add("to_invoker")
        finals = [s for s in self.chart.states[1:] if s.parent == 0 and s.kind is Kind.FINAL]
        out.line(f"static void {self.prefix}_tell_end({self.prefix} *m)")
        with out.block("{"):
            for final in finals:
                test = names.in_state("m", final.index)
                with out.block(f"if ({ungrouped(test)}) {{ {names.note(final.index)}"):
                    self._done_event(out, event, final.index)
                    out.line(f"{self.prefix}_to_invoker(m, &e);")
                    out.close()
        out.line()

    def _done_event(self, out: Emitter, event: int, final: int | None) -> None:
        """Open a block in which ``e`` is the event with a final state's data (SCXML 5.5)."""
        chart, names = self.chart, self.names
        fields = chart.events[event].fields
        data = chart.states[final].done_data if final is not None else ()
        out.open("{")
        out.line(f"{self.prefix}_event e = {names.upper}_NO_EVENT;")
        out.line(f"e.event = {names.events[event]};")
        for number, part in enumerate(fields):
            printer = Printer(names)
            place = f"e.of.{names.payloads[event]}.{names.field(part.name)}"
            put_default(out, Place(names, part.type, place))
            if number < len(data):
                text = printer.value(data[number], part.type)
                out.open("{")
                for ctype, name in printer.temporaries:
                    out.line(f"{ctype} {name};")
                if can_fail(data[number]):
                    out.line(f"{_stored(names, part)} value = {text};")
                    out.line("if (m->failed == FSM_FINE)")
                    with out.indented():
                        out.line(f"{place} = value;")
                    out.line(f"{self.prefix}_end_block(m);")
                    names.used.add("end_block")
                else:
                    copy(out, Place(names, part.type, text), Place(names, part.type, place))
                out.close()

    # --- functions ------------------------------------------------------------------------

    def leave_region(self, out: Emitter, region: Region) -> None:
        """Print the function that leaves what is active in a region, innermost first."""
        names, plan = self.names, self.plan
        variable = f"m->{names.regions[region.index]}"
        number = self._ctype(region)
        name = self._leave_name(region)
        out.line(f"static void {name}({self.prefix} *m, {number} until, bool keep)")
        with out.block("{"):
            out.line(f"{number} at = {variable};")
            with out.block("while (at > until) {"):
                with out.block("switch (at) {"):
                    for state in region.states:
                        out.line(f"case {plan.number[state]}u: {self.names.note(state)}")
                        with out.indented():
                            for inner in reversed(self._inner(state)):
                                out.line(f"{self._leave_name(inner)}(m, 0u, keep);")
                            self.leave_state(out, state)
                            parent = self.chart.states[state].parent
                            assert parent is not None  # noqa: S101
                            same = plan.region_of[parent] == region.index
                            out.line(f"at = {plan.number[parent] if same else 0}u;")
                            out.line("break;")
                    out.line("default:")
                    with out.indented():
                        out.line("at = 0u;")
                        out.line("break;")
                out.line("if (!keep)")
                with out.indented():
                    out.line(f"{variable} = at;")
        out.line()

    def _inner(self, state: int) -> list[Region]:
        return self.plan.inner[state]

    def _leave_name(self, region: Region) -> str:
        return f"{self.prefix}_leave_{region.index}"

    def _ctype(self, region: Region) -> str:
        return "uint8_t" if len(region.states) < 256 else "uint16_t"

    def leave_below(self, domain: int) -> str:
        """Return the call that leaves all states strictly below a domain."""
        region = self.plan.regions[self.plan.region_of[domain]]
        return f"{self._leave_name(region)}(m, {self.plan.number[domain]}u, false);"

    def record(self, out: Emitter) -> None:
        """Print the function that records the histories of the states about to be left."""
        histories = [state for state in self.chart.states if state.is_history]
        if not histories:
            return
        out.line(f"static void {self.prefix}_record({self.prefix} *m, uint16_t domain)")
        with out.block("{"):
            for history in histories:
                parent = history.parent
                assert parent is not None  # noqa: S101
                above = [a for a in self.chart.ancestors(parent) if self._can_be_domain(a)]
                tests = " || ".join(f"domain == {a + 1}u" for a in above)
                active = self.names.in_state("m", parent)
                if not above:
                    continue
                with out.block(
                    f"if (({tests}) && {_grouped(active)}) {{ {self.names.note(history.index)}"
                ):
                    self._record_one(out, history.index, parent)
        out.line()

    def _can_be_domain(self, state: int) -> bool:
        return state == 0 or self.chart.states[state].kind is Kind.COMPOUND

    def _record_one(self, out: Emitter, history: int, parent: int) -> None:
        names, plan = self.names, self.plan
        is_deep = self.chart.states[history].kind is Kind.DEEP_HISTORY
        for region in plan.recorded_regions[history]:
            kept = f"m->{names.histories[history, region]}"
            variable = f"m->{names.regions[region]}"
            if is_deep:
                out.line(f"{kept} = {variable};")
            elif self.chart.states[parent].kind is Kind.PARALLEL:
                out.line(f"{kept} = 1u;")
            else:
                children = [
                    c
                    for c in self.chart.states[parent].children
                    if not self.chart.states[c].is_history
                ]
                text = f"{plan.number[children[0]]}u"
                for child in children[1:]:
                    text = f"{variable} >= {plan.number[child]}u ? {plan.number[child]}u : {text}"
                    text = f"({text})" if child != children[-1] else text
                ctype = self._ctype(plan.regions[region])
                out.line(f"{kept} = ({ctype})({text});")

    # --- entering -------------------------------------------------------------------------

    def ops(self, out: Emitter, ops: tuple[Op, ...]) -> None:
        """Print what is entered."""
        for op in ops:
            match op:
                case Enter(state, defaults):
                    out.line(f"{self.prefix}_enter_{state}(m);")
                    for transition in defaults:
                        self.take_content(out, transition)
                case Content(transition):
                    self.take_content(out, transition)
                case Branch(history, recorded, unrecorded):
                    with out.block(f"if ({self.is_recorded(history)}) {{"):
                        self.ops(out, recorded)
                    with out.block("else {"):
                        self.ops(out, unrecorded)
                case Restore(history, below):
                    self._restore(out, history, below)

    def is_recorded(self, history: int) -> str:
        """Return the test whether a history holds something."""
        region = self.plan.recorded_regions[history][0]
        return f"m->{self.names.histories[history, region]} != 0u"

    def take_content(self, out: Emitter, transition: int) -> None:
        """Print the hook and the content of a default transition."""
        out.line(f"FSM_HOOK_TAKE(m, {transition}u);")
        self.content.block(
            out, self.chart.transitions[transition].content, (), f"transition {transition}"
        )

    def _restore(self, out: Emitter, history: int, below: int) -> None:
        chart, plan = self.chart, self.plan
        if chart.states[history].kind is Kind.SHALLOW_HISTORY:
            region = plan.region_of[below]
            with out.block(f"switch (m->{self.names.histories[history, region]}) {{"):
                for child in chart.states[below].children:
                    if chart.states[child].is_history:
                        continue
                    with self._case(out, child):
                        self.ops(out, entry_by_default(chart, child))
                self._default_case(out)
            return
        if chart.states[below].kind is Kind.PARALLEL:
            for region_ in self._inner(below):
                self._restore_region(out, history, region_, region_.top, include_top=True)
            return
        region_ = plan.regions[plan.region_of[below]]
        self._restore_region(out, history, region_, below, include_top=False)

    def _restore_region(
        self, out: Emitter, history: int, region: Region, top: int, *, include_top: bool
    ) -> None:
        chart = self.chart
        with out.block(f"switch (m->{self.names.histories[history, region.index]}) {{"):
            for leaf in region.states:
                kind = chart.states[leaf].kind
                inside = leaf == top if include_top else False
                if not (inside or chart.is_descendant(leaf, top)) or kind is Kind.COMPOUND:
                    continue
                path = [leaf]
                for ancestor in chart.ancestors(leaf):
                    if ancestor == top and not include_top:
                        break
                    if leaf == top or not (ancestor == top or chart.is_descendant(ancestor, top)):
                        break
                    path.append(ancestor)
                with self._case(out, leaf):
                    for state in reversed(path):
                        out.line(f"{self.prefix}_enter_{state}(m);")
                    for inner in self._inner(leaf):
                        self._restore_region(out, history, inner, inner.top, include_top=True)
            self._default_case(out)

    def _case(self, out: Emitter, state: int):  # type: ignore[no-untyped-def]
        return _Case(out, f"case {self.plan.number[state]}u: {self.names.note(state)}")

    def _default_case(self, out: Emitter) -> None:
        with _Case(out, "default:"):
            pass

    # --- moves ----------------------------------------------------------------------------

    def variants(self, out: Emitter, move: Move, entering: bool) -> None:
        """Print what a transition enters, or whence it leaves, by its variants."""
        for variant in move.variants[:-1]:
            tests = " && ".join(self._within(condition) for condition in variant.conditions)
            with out.block(f"if ({tests}) {{"):
                if entering:
                    self.ops(out, variant.entry)
                else:
                    out.line(f"return {_domain(variant.domain)}u;")
                if entering:
                    out.line("break;")
        last = move.variants[-1]
        if entering:
            self.ops(out, last.entry)
        else:
            out.line(f"return {_domain(last.domain)}u;")

    def _within(self, condition: Within) -> str:
        variable = f"m->{self.names.histories[condition.history, condition.region]}"
        if condition.first == condition.last:
            return f"{variable} == {condition.first}u"
        return f"{variable} >= {condition.first}u && {variable} <= {condition.last}u"


class _Case:
    """One case of a switch, ending in ``break``."""

    def __init__(self, out: Emitter, label: str) -> None:
        self._out = out
        self._label = label

    def __enter__(self) -> None:
        self._out.open(self._label)

    def __exit__(self, *_: object) -> None:
        self._out.close("    break;")


def _domain(domain: int | None) -> int:
    return 0 if domain is None else domain + 1


def _grouped(text: str) -> str:
    return text if text.startswith("(") else f"({text})"


def ungrouped(text: str) -> str:
    """Return a condition to stand in parentheses."""
    return text[1:-1] if text.startswith("(") and text.endswith(")") else text


def _stored(names: Names, part: object) -> str:
    from fsmkit.codegen.c.types import storage

    return storage(part.type, names.records).text  # type: ignore[attr-defined]
