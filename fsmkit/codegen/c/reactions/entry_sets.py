"""Entering states in C, and what transitions do: what the Plan says, spelt out."""

from __future__ import annotations

from copy import copy as copy_of

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.transfer import Place, copy, put_default
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.exit_sets import LeavePrinter
from fsmkit.codegen.c.reactions.sharing import RECORDED
from fsmkit.document.document import Kind
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Move, Op, Region, Restore, Within
from fsmkit.plan.entries import entry_by_default

Lines = tuple[str, ...]


class MovePrinter(LeavePrinter):
    """Prints the functions that change the configuration."""

    def __init__(self, names: Names, content: ContentPrinter) -> None:
        """Print with these names."""
        super().__init__(names, content)
        self._entries: dict[int, Lines] = {}

    def print_take(self, out: Unit) -> None:
        """Print the function that takes what was selected."""
        print_pieces(out, self.names, "selection", "take")

    def number(self, transition: int) -> int:
        """Return the number by which a transition is taken; 0 is for none."""
        return transition + 1

    def under(self, names: Names) -> MovePrinter:
        """Return what prints the same with other names."""
        other = copy_of(self)
        other.names, other.content = names, self.content.under(names)
        return other

    # --- what one state does --------------------------------------------------------------

    def enter_call(self, state: int) -> Lines:
        """Return how a state is entered: a call, or all of it where that is little."""
        lines = self.entries(state)
        return lines if len(lines) == 2 else (f"{self.names.function('enter', state)}(m);",)

    def entries(self, state: int) -> Lines:
        """Return the number, the timers and the entry handlers of a state."""
        if state not in self._entries:
            out = Emitter()
            out.line(self.set_active(state))
            for history in self.plan.forgotten[state]:
                self.forget(out, history)
            out.line(f"{self.names.hook('ENTER')}(m, {self.names.states[state]});")
            self.entry(out, state)
            self._entries[state] = out.collected()
        return self._entries[state]

    def entry(self, out: Emitter, state: int) -> None:
        """Print what is done when a state is entered, once it is active."""
        names = self.names
        for transition in self._timed(state):
            out.line(self.arm(transition))
        if self.chart.states[state].invokes:
            member, bit = names.to_invoke(state)
            out.line(f"{member} = (uint8_t)({member} | {bit}u);")
        what = "entry of " + self.chart.states[state].id
        for block in self.chart.states[state].on_entry:
            self.content.block(out, block, (), what)
        if self.chart.states[state].kind is Kind.FINAL:
            self.final(out, state)

    def final(self, out: Emitter, state: int) -> None:
        """SCXML 3.7: the end of the machine, or the done events of the parents."""
        chart = self.chart
        parent = chart.states[state].parent
        assert parent is not None  # noqa: S101
        if parent == 0:
            out.line("m->fsm.running = false;")
            out.line("m->fsm.finished = true;")
            return
        self._done(out, parent, state)
        above = chart.states[parent].parent
        if above is not None and chart.states[above].kind is Kind.PARALLEL:
            event = chart.event_index.get("done.state." + chart.states[above].id)
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
        tests = [self.names.in_state("m", final).text for final in finals]
        return f"({' || '.join(tests)})" if tests else "false"

    def _done(self, out: Emitter, state: int, final: int | None) -> None:
        chart = self.chart
        event = chart.event_index.get("done.state." + chart.states[state].id)
        if event is None:
            return
        self._done_event(out, event, final)
        out.line(f"{self.own}_raise(m, &e, false);")
        out.close()

    def tell_end(self, out: Unit, event: int) -> None:
        """Print the function that tells the invoker of the end, with the final state's data."""
        names = self.names
        names.used.add("to_invoker")
        finals = [s for s in self.chart.states[1:] if s.parent == 0 and s.kind is Kind.FINAL]
        out.define("tell_end")
        out.line(f"static void {self.own}_tell_end({self.own} *m)")
        with out.block("{"):
            for final in finals:
                test = names.in_state("m", final.index).text
                with out.block(f"if ({test}) {{ {names.note(final.index)}"):
                    self._done_event(out, event, final.index)
                    out.line(f"{self.own}_to_invoker(m, &e);")
                    out.close()
        out.line()

    def _done_event(self, out: Emitter, event: int, final: int | None) -> None:
        """Open a block in which ``e`` is the event with a final state's data (SCXML 5.5)."""
        chart, names = self.chart, self.names
        fields = chart.events[event].fields
        data = chart.states[final].done_data if final is not None else ()
        out.open("{")
        out.line(f"{self.own}_event e = {names.own_upper}_NO_EVENT;")
        out.line(f"e.event = {names.event(event)};")
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
                    with out.block("if (m->fsm.failed == FSM_FINE) {"):
                        out.line(f"{place} = value;")
                    out.line(f"{self.own}_end_block(m);")
                    names.used.add("end_block")
                else:
                    copy(out, Place(names, part.type, text), Place(names, part.type, place))
                out.close()

    # --- entering -------------------------------------------------------------------------

    def ops(self, out: Emitter, ops: tuple[Op, ...]) -> None:
        """Print what is entered."""
        for op in ops:
            match op:
                case Enter(state, defaults):
                    out.lines(self.enter_call(state))
                    for transition in defaults:
                        self.take_content(out, transition)
                case Content(transition):
                    self.take_content(out, transition)
                case Branch(history, recorded, unrecorded):
                    with out.block(f"if ({self.is_recorded(history)}) {{"):
                        if any(isinstance(op, Restore) for op in recorded):
                            self._keep(out, history)
                        self.ops(out, recorded)
                    with out.block("else {"):
                        self.ops(out, unrecorded)
                case Restore(history, below):
                    self._restore(out, history, below)

    def is_recorded(self, history: int) -> str:
        """Return the test whether a history holds something."""
        region = self.plan.recorded_regions[history][0]
        return f"m->{self.names.recorded(history, region)} != 0u"

    def forget(self, out: Emitter, history: int) -> None:
        """Print that a history holds nothing any more."""
        for region in self.plan.recorded_regions[history]:
            if (history, region) in self.names.histories:
                out.line(f"m->{self.names.histories[history, region]} = 0u;")

    def _keep(self, out: Emitter, history: int) -> None:
        """Print local copies of what a history holds, if entering its parent makes it forget."""
        for region in self.plan.recorded_regions[history]:
            member = f"m->{self.names.recorded(history, region)}"
            if (held := self._held(history, region)) != member:
                out.line(f"const {self._ctype(self.plan.regions[region])} {held} = {member};")

    def _held(self, history: int, region: int) -> str:
        """Return what a history recorded in a region, where that is entered."""
        name = self.names.recorded(history, region)
        is_forgotten = history in self.plan.forgotten[self.chart.states[history].parent or 0]
        is_overwritten = is_forgotten and self.names.shared.get(region) != history
        return f"was_{history}_{region}" if is_overwritten else f"m->{name}"

    def take_content(self, out: Emitter, transition: int) -> None:
        """Print the hook and the content of a default transition."""
        out.line(f"{self.names.hook('TAKE')}(m, {transition}u);")
        self.content.block(
            out, self.chart.transitions[transition].content, (), f"transition {transition}"
        )

    def _restore(self, out: Emitter, history: int, below: int) -> None:
        chart, plan = self.chart, self.plan
        if chart.states[history].kind is Kind.SHALLOW_HISTORY:
            region = plan.region_of[below]
            with out.block(f"switch ({self._held(history, region)}) {{"):
                for child in chart.states[below].children:
                    if chart.states[child].is_history:
                        continue
                    with case(out, f"{self.names.number(child)}:"):
                        self.ops(out, entry_by_default(chart, child))
                default(out)
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
        added = f" + {RECORDED}" if self.names.shared.get(region.index) == history else ""
        with out.block(f"switch ({self._held(history, region.index)}) {{"):
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
                with case(out, f"{self.names.number(leaf)}{added}:"):
                    for state in reversed(path):
                        out.lines(self.enter_call(state))
                    for inner in self._inner(leaf):
                        self._restore_region(out, history, inner, inner.top, include_top=True)
            default(out)

    # --- moves ----------------------------------------------------------------------------

    def variants(self, out: Emitter, move: Move, entering: bool) -> None:
        """Print what a transition enters, or whence it leaves, by its variants."""
        for variant in move.variants[:-1]:
            tests = " && ".join(self.within(condition) for condition in variant.conditions)
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

    def within(self, condition: Within) -> str:
        """Return the test of a condition on what a history recorded."""
        variable = f"m->{self.names.histories[condition.history, condition.region]}"
        first, last = condition.first, condition.last
        inside = [s for s in self.plan.regions[condition.region].states if first <= s <= last]
        if not inside:
            return f"{variable} == {self.names.number(0)}"
        if len(inside) == 1:
            return f"{variable} == {self.names.number(inside[0])}"
        ends = self.names.number(inside[0]), self.names.number(inside[-1])
        return f"{variable} >= {ends[0]} && {variable} <= {ends[1]}"


def _domain(domain: int | None) -> int:
    return 0 if domain is None else domain + 1


def _stored(names: Names, part: object) -> str:
    from fsmkit.codegen.c.storage import storage

    return storage(part.type, names.records).text  # type: ignore[attr-defined]
