"""The form for speed: straight code that enters and exits states."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.analysis.effects import is_plain
from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.exit_sets import ExitPrinter
from fsmkit.codegen.c.reactions.form_printer import FormPrinter, Lines
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.sharing import RECORDED
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.plan import Branch, Content, Enter, Reaction, Restore, Variant
from fsmkit.plan.entered import entered
from fsmkit.plan.operations import Action, EndInvoked, Forget, Leave, LeaveRegion, Ops, Resume, Run


class StraightPrinter(FormPrinter):
    """Prints the functions of single states, and calls of them."""

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Create a printer with these names."""
        super().__init__(names, content, selection)
        self._exits = ExitPrinter(self.actions, self.histories)
        self._entries: dict[int, Lines] = {}

    # --- exiting --------------------------------------------------------------------------

    def exit_listed(self, out: Emitter, reaction: Reaction) -> None:
        """Print the exit of the states of a reaction, one by one."""
        source = self.chart.transitions[reaction.transition].source
        for op in reaction.leave:
            if isinstance(op, LeaveRegion):
                out.line(self._exits.region_call(self.plan.regions[op.region]))
            elif isinstance(op, Leave):
                if op.state != source and _is_observed(self.plan.leaving[op.state]):
                    out.line(self.set_active(op.state))
                out.lines(self._exits.state_call(op.state))

    def exit_below_call(self, domain: int) -> str:
        """Return the call that exits all active states strictly below a domain."""
        return self._exits.below_call(domain)

    def exit_machine_call(self) -> str:
        """Return the call that exits all states; their regions keep the numbers."""
        return self._exits.region_call(self.plan.regions[0], 0, "true")

    # --- entering -------------------------------------------------------------------------

    def _entry_call(self, state: int) -> Lines:
        """Return the entry of a state: a call, or the statements themselves if they are few."""
        lines = self._entry_body(state)
        return lines if len(lines) == 2 else (f"{self.names.function('enter', state)}(m);",)

    def _entry_body(self, state: int) -> Lines:
        """Return the statements of entering a state: its number and its actions."""
        if state not in self._entries:
            out, what = Emitter(), "entry of " + self.chart.states[state].id
            out.line(self.set_active(state))
            self.actions.print(out, map(Forget, self.plan.forgotten[state]), what)
            out.line(f"{self.names.hook('ENTER')}(m, {self.names.states[state]});")
            self.actions.entry_actions(out, state)
            self._entries[state] = out.collected()
        return self._entries[state]

    def entry(self, out: Emitter, ops: Ops) -> None:
        """Print the entry of states."""
        for op in ops:
            match op:
                case Enter(state, defaults):
                    out.lines(self._entry_call(state))
                    for transition in defaults:
                        self.actions.take_content(out, transition)
                case Content(transition):
                    self.actions.take_content(out, transition)
                case Branch(history, recorded, unrecorded):
                    region = self.plan.recorded_regions[history][0]
                    with out.block(f"if ({self.histories.is_recorded(history, region)}) {{"):
                        if any(isinstance(op, Restore) for op in recorded):
                            self._keep(out, history)
                        self.entry(out, recorded)
                    with out.block("else {"):
                        self.entry(out, unrecorded)
                case Restore():
                    self.entry(out, self.plan.resumed(op))
                case Resume():
                    self._resume(out, op)

    def _keep(self, out: Emitter, history: int) -> None:
        """Print local copies of a history's record, if entering its parent clears it."""
        for region in self.plan.recorded_regions[history]:
            member = f"m->{self.names.recorded(history, region)}"
            if (held := self._held(history, region)) != member:
                out.line(f"const {self.names.number_type(region)} {held} = {member};")

    def _held(self, history: int, region: int) -> str:
        """Return the state that a history recorded in a region, at its entry."""
        name = self.names.recorded(history, region)
        is_shared = self.names.shared.get(region) == history
        is_overwritten = self.plan.is_forgotten(history) and not is_shared
        return f"was_{history}_{region}" if is_overwritten else f"m->{name}"

    def _resume(self, out: Emitter, resume: Resume) -> None:
        """Print the entry by the number that a history recorded in a region."""
        history, region = resume.history, resume.region
        added = f" + {RECORDED}" if self.names.shared.get(region) == history else ""
        with out.block(f"switch ({self._held(history, region)}) {{"):
            for number, ops in resume.cases:
                with case(out, f"{self.names.number(number)}{added}:"):
                    self.entry(out, ops)
            default(out)

    def print_states(self, out: Unit) -> None:
        """Print the functions that enter and exit states, and those that exit regions."""
        reached = entered(self.plan)
        for state in self.plan.descendants(0):
            entries = self._entry_body(state) if state in reached else ()
            # less stands where it is done
            for verb, lines, little in (
                ("exit", self._exits.body(state), 1),
                ("enter", entries, 2),
            ):
                if len(lines) > little:
                    name = self.names.function(verb, state)
                    out.define(name)
                    out.line(f"static void {name}({self.own} *m)")
                    with out.block("{"):
                        out.lines(lines)
                    out.line()
        for region in reversed(self.plan.regions):
            self._exits.print_region(out, region)

    def print_selection(self, out: Unit) -> None:
        """Print the constants of a selection."""
        defer = "0xFFFFu" if self.names.taken_type == "uint16_t" else "0xFFFFFFFFu"
        for name, value in (("DEFER", defer), ("REGIONS", len(self.plan.regions))):
            out.define(name)
            out.line(f"#define {self.names.own_upper}_{name} {value}")
        out.line()

    def print_selectors(self, out: Unit) -> None:
        """Print the functions that the loop calls, after the type of their results."""
        for trigger in (Trigger.EVENT, Trigger.EVENTLESS):
            calls = self.selection.finders(out, trigger)
            self.selection.over_regions(out, trigger, calls)

    def print_enter(self, out: Unit) -> None:
        """Print the function that enters the entry set of a transition."""
        moving = {n: own for n, own in self.variants.items() if own[0].domain is not None}

        def enter(variant: Variant) -> Lines:
            lines = Emitter()
            self.entry(lines, variant.entry)
            return (*lines.collected(), *(["break;"] if variant.conditions else []))

        out.define("enter")
        out.line(f"static void {self.own}_enter({self.own} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            if not moving:
                out.line("(void)m;")
            self.over_variants(out, moving, enter)
        out.line()


def _is_observed(actions: Iterable[Action]) -> bool:
    """Whether an action can observe which states are active."""
    return any(
        isinstance(each, EndInvoked) or (isinstance(each, Run) and not is_plain(each.block))
        for each in actions
    )
