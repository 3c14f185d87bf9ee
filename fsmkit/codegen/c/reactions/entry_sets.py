"""Entering states in C, and what transitions do: what the Plan says, spelt out."""

from __future__ import annotations

from copy import copy as copy_of

from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.exit_sets import LeavePrinter
from fsmkit.codegen.c.reactions.sharing import RECORDED
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Move, Restore, Within
from fsmkit.plan.operations import Forget, Ops, Resume

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
        inside = self.plan.numbers_within(condition.region, first, last)
        if not inside:
            return f"{variable} == {self.names.number(0)}"
        if len(inside) == 1:
            return f"{variable} == {self.names.number(inside[0])}"
        ends = self.names.number(inside[0]), self.names.number(inside[-1])
        return f"{variable} >= {ends[0]} && {variable} <= {ends[1]}"


def _domain(domain: int | None) -> int:
    return 0 if domain is None else domain + 1
