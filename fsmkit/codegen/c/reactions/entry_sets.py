"""Entering states in C, and what transitions do: what the Plan says, spelt out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy as copy_of

from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.exit_sets import LeavePrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.reactions.sharing import RECORDED
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Reaction, Restore, Within
from fsmkit.plan.entered import entered
from fsmkit.plan.operations import Forget, Ops, Resume

Lines = tuple[str, ...]
Merged = list[tuple[list[int], Lines]]
"""Transitions, and what all of them do."""


class MovePrinter(LeavePrinter):
    """Prints the functions that change the configuration."""

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Print with these names."""
        super().__init__(names, content)
        self.selection = selection
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
        """Return the number and the actions of a state that is entered."""
        if state not in self._entries:
            out, what = Emitter(), "entry of " + self.chart.states[state].id
            out.line(self.set_active(state))
            self.actions(out, map(Forget, self.plan.forgotten[state]), what)
            out.line(f"{self.names.hook('ENTER')}(m, {self.names.states[state]});")
            self.entry(out, state)
            self._entries[state] = out.collected()
        return self._entries[state]

    def entry(self, out: Emitter, state: int) -> None:
        """Print what is done when a state is entered, once it is active."""
        actions = (each for each in self.plan.entering[state] if not isinstance(each, Forget))
        self.actions(out, actions, "entry of " + self.chart.states[state].id)

    # --- entering -------------------------------------------------------------------------

    def ops(self, out: Emitter, ops: Ops) -> None:
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
                case Restore():
                    self.ops(out, self.plan.resumed(op))
                case Resume():
                    self._resume(out, op)

    def is_recorded(self, history: int) -> str:
        """Return the test whether a history holds something."""
        region = self.plan.recorded_regions[history][0]
        return f"m->{self.names.recorded(history, region)} != 0u"

    def _keep(self, out: Emitter, history: int) -> None:
        """Print local copies of what a history holds, if entering its parent makes it forget."""
        for region in self.plan.recorded_regions[history]:
            member = f"m->{self.names.recorded(history, region)}"
            if (held := self._held(history, region)) != member:
                out.line(f"const {self._ctype(self.plan.regions[region])} {held} = {member};")

    def _held(self, history: int, region: int) -> str:
        """Return what a history recorded in a region, where that is entered."""
        name = self.names.recorded(history, region)
        is_shared = self.names.shared.get(region) == history
        is_overwritten = self.plan.is_forgotten(history) and not is_shared
        return f"was_{history}_{region}" if is_overwritten else f"m->{name}"

    def take_content(self, out: Emitter, transition: int) -> None:
        """Print the hook and the content of a default transition."""
        out.line(f"{self.names.hook('TAKE')}(m, {transition}u);")
        self.content.block(
            out, self.chart.transitions[transition].content, (), f"transition {transition}"
        )

    def _resume(self, out: Emitter, resume: Resume) -> None:
        """Print what is entered by the number that a history recorded in a region."""
        history, region = resume.history, resume.region
        added = f" + {RECORDED}" if self.names.shared.get(region) == history else ""
        with out.block(f"switch ({self._held(history, region)}) {{"):
            for number, ops in resume.cases:
                with case(out, f"{self.names.number(number)}{added}:"):
                    self.ops(out, ops)
            default(out)

    def print_states(self, out: Unit) -> None:
        """Print the functions that enter and leave states, and those that leave regions."""
        reached = entered(self.plan)
        for state in self.plan.descendants(0):
            entries = self.entries(state) if state in reached else ()
            # less stands where it is done
            for verb, lines, little in (("exit", self.exits(state), 1), ("enter", entries, 2)):
                if len(lines) > little:
                    name = self.names.function(verb, state)
                    out.define(name)
                    out.line(f"static void {name}({self.own} *m)")
                    with out.block("{"):
                        out.lines(lines)
                    out.line()
        for region in reversed(self.plan.regions):
            self.leave_region(out, region)

    def print_selection(self, out: Unit) -> None:
        """Print the constants of a selection."""
        defer = "0xFFFFu" if self.names.taken_type == "uint16_t" else "0xFFFFFFFFu"
        for name, value in (("DEFER", defer), ("REGIONS", len(self.plan.regions))):
            out.define(name)
            out.line(f"#define {self.names.own_upper}_{name} {value}")
        out.line()

    def print_selectors(self, out: Unit) -> None:
        """Print the functions that the loop calls, after the type of what they find."""
        for trigger in (Trigger.EVENT, Trigger.EVENTLESS):
            calls = self.selection.finders(out, trigger)
            self.selection.over_regions(out, trigger, calls)

    def merge_timeouts(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return what timeouts do, with those that do it, and what stands before that."""
        return [([timer], lines) for timer, lines in bodies.items()], ()

    # --- what is taken by its number ------------------------------------------------------

    def print_general(self, out: Unit) -> None:
        """Print what transitions record, leave, do and enter, by the number of what is taken."""
        self.record(out)
        self._domains(out)
        self.print_leave(out)
        self.print_act(out)
        self.print_enter(out)

    def _domains(self, out: Unit) -> None:
        domains = [_domain(variants[-1].domain) for variants in self.plan.variants]
        what = "By transition: the state plus one below which it acts."
        self.table(out, "domain_of", domains, what)
        out.define("domain")
        head = f"{self.own}_domain(const {self.own} *m, {self.names.taken_type} taken)"
        out.line(f"static uint16_t {head}")
        with out.block("{"):
            if not self.by_history(out, lambda each: [f"return {_domain(each.domain)}u;"]):
                out.line("(void)m;")
            out.line(f"return {self.domain_taken(len(domains))};")
        out.line()

    def domain_taken(self, count: int) -> str:
        """Return the entry of ``taken`` in the table of domains; an analysis sees its bound."""
        return f"taken - 1u < {count}u ? {self.own}_domain_of[taken - 1u] : 0u"

    def by_history(self, out: Emitter, answer: Callable[[Reaction], Sequence[str]]) -> bool:
        """Print the answer of transitions whose domain depends on a history, if there are any.

        That of the last of their reactions follows behind.
        """
        found = [own for own in self.plan.reactions if len(own) > 1]
        if found:
            with out.block("switch (taken) {"):
                for *others, last in found:
                    comment = self.selection.comment(self.chart.transitions[last.transition])
                    with case(out, f"{last.transition + 1}u: /* {comment} */"):
                        for reaction in others:
                            tests = " && ".join(map(self.within, reaction.conditions))
                            with out.block(f"if ({tests}) {{"):
                                out.lines(answer(reaction))
                default(out)
        return bool(found)

    def print_leave(self, out: Unit) -> None:
        """Print how all is left below a domain, by its number plus one."""
        found = {_domain(each.domain) for own in self.plan.reactions for each in own}
        out.define("leave")
        out.line(f"static void {self.own}_leave({self.own} *m, uint16_t domain)")
        with out.block("{"):
            if found <= {0}:
                out.line("(void)m;")
            with out.block("switch (domain) {"):
                for domain in sorted(found - {0}):
                    out.line(f"case {domain}u: {self.names.note(domain - 1)}")
                    out.lines([f"    {self.leave_below(domain - 1)}", "    break;"])
                default(out)
        out.line()

    def print_act(self, out: Unit) -> None:
        """Print what each transition does between leaving and entering."""
        bodies: dict[int, Lines] = {}
        for transition in self.chart.transitions:
            if transition.content and transition.trigger is not Trigger.INITIAL:
                each, what = Emitter(), self.selection.comment(transition)
                self.content.block(each, transition.content, transition.events, what)
                bodies[transition.index] = each.collected()
        done, before = self.merge_contents(out, bodies)
        out.define("act")
        out.line(f"static void {self.own}_act({self.own} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            out.line(f"{self.names.hook('TAKE')}(m, {self.transition_taken});")
            out.lines(before)
            with out.block("switch (taken) {"):
                for members, lines in done:
                    for t in members:
                        what = self.selection.comment(self.chart.transitions[t])
                        out.lines(f"case {number}u: /* {what} */" for number in self.numbers(t))
                    with out.indented():
                        out.lines((*lines, "break;"))
                default(out)
        out.line()

    def merge_contents(self, out: Unit, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return what transitions do, with all that do the same, and what stands before that."""
        del out  # nothing is needed for it
        found: dict[Lines, list[int]] = {}
        for transition, lines in bodies.items():
            found.setdefault(lines, []).append(transition)
        return [(members, lines) for lines, members in found.items()], ()

    def print_enter(self, out: Unit) -> None:
        """Print what each transition enters."""
        moving = [own for own in self.plan.reactions if own and own[0].domain is not None]
        out.define("enter")
        out.line(f"static void {self.own}_enter({self.own} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            if not moving:
                out.line("(void)m;")
            with out.block("switch (taken) {"):
                for *others, last in moving:
                    comment = self.selection.comment(self.chart.transitions[last.transition])
                    with case(out, f"{last.transition + 1}u: /* {comment} */"):
                        for reaction in others:
                            tests = " && ".join(map(self.within, reaction.conditions))
                            with out.block(f"if ({tests}) {{"):
                                self.ops(out, reaction.enter)
                                out.line("break;")
                        self.ops(out, last.enter)
                default(out)
        out.line()

    @property
    def transition_taken(self) -> str:
        """The transition whose number is ``taken``."""
        return f"({self.names.taken_type})(taken - 1u)"

    def numbers(self, transition: int) -> Sequence[int]:
        """Return the numbers by which a transition is taken."""
        return [transition + 1]

    def table(self, out: Unit, name: str, values: Sequence[int], note: str) -> None:
        """Print a table of numbers."""
        ctype = narrowest(max(values))
        out.define(name)
        out.line(f"/* {note} */")
        with out.block(f"static const {ctype} {self.own}_{name}[{len(values)}] = {{", "};"):
            for at in range(0, len(values), 16):
                out.line(", ".join(f"{value}u" for value in values[at : at + 16]) + ",")
        out.line()

    def within(self, condition: Within) -> str:
        """Return the test of a condition on what a history recorded."""
        variable = f"m->{self.names.histories[condition.history, condition.region]}"
        first, last = condition.first, condition.last
        inside = self.plan.numbers_within(condition.region, first, last)
        if not inside:
            return f"{variable} == {self.names.number(0)}"
        if len(inside) == 1:
            return f"{variable} == {self.names.number(inside[0])}"
        ends = self.names.number(inside[0]), self.names.number(inside[-1])
        return f"{variable} >= {ends[0]} && {variable} <= {ends[1]}"


def _domain(domain: int | None) -> int:
    return 0 if domain is None else domain + 1
