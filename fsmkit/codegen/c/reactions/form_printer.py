"""The common part of all forms of a machine's C: transitions that are taken by their number.

A form prints how states are exited and entered. Where the transition is known only at run time,
each phase of a microstep has a function that looks up the actions of that transition.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence

from fsmkit.codegen.c.expressions.cases import case, default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import narrowest
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.actions import ActionPrinter
from fsmkit.codegen.c.reactions.histories import HistoryPrinter
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.document.document import Trigger
from fsmkit.emit import Emitter
from fsmkit.plan import Plan, Reaction, Variant
from fsmkit.plan.operations import Ops

Lines = tuple[str, ...]
Merged = list[tuple[list[int], Lines]]
"""Transitions or timers, and the body that they share."""


class FormPrinter(ABC):
    """Prints the functions that change the configuration."""

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Create a printer with these names."""
        self.names = names
        self.plan: Plan = names.plan
        self.chart = names.chart
        self.own = names.own
        self.content = content
        self.selection = selection
        self.actions = ActionPrinter(names, content)
        self.histories = HistoryPrinter(names)
        self.variants = {
            each.index: self.plan.variants[each.index]
            for each in self.chart.transitions
            if each.trigger is not Trigger.INITIAL
        }
        """The variants of each transition; initial and default transitions belong to paths."""

    # --- what each form prints in its own way ---------------------------------------------

    @abstractmethod
    def print_states(self, out: Unit) -> None:
        """Print the functions that enter and exit states."""

    @abstractmethod
    def print_selection(self, out: Unit) -> None:
        """Print the constants and tables of a selection."""

    @abstractmethod
    def print_selectors(self, out: Unit) -> None:
        """Print the functions that select, after the type of their results."""

    @abstractmethod
    def print_enter(self, out: Unit) -> None:
        """Print the function that enters the entry set of a transition."""

    @abstractmethod
    def entry(self, out: Emitter, ops: Ops) -> None:
        """Print the entry of states."""

    @abstractmethod
    def exit_listed(self, out: Emitter, reaction: Reaction) -> None:
        """Print the exit of the states of a reaction, one by one."""

    @abstractmethod
    def exit_below_call(self, domain: int) -> str:
        """Return the call that exits all active states strictly below a domain."""

    @abstractmethod
    def exit_machine_call(self) -> str:
        """Return the call that exits all states; their regions keep the numbers."""

    def merge_contents(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return the distinct contents of transitions, and the declarations before them."""
        found: dict[Lines, list[int]] = {}
        for transition, lines in bodies.items():
            found.setdefault(lines, []).append(transition)
        return [(members, lines) for lines, members in found.items()], ()

    def merge_timeouts(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return the bodies of timeouts without duplicates, and the declarations before them."""
        return self.merge_contents(bodies)

    # --- transitions by their numbers -----------------------------------------------------

    def print_take(self, out: Unit) -> None:
        """Print the function that takes the selected transition."""
        print_pieces(out, self.names, "selection", "take")

    def take_call(self, number: str) -> str:
        """Return the call that takes a transition by its number."""
        verb = "take" if self.plan.is_single else "take_one"
        return f"{self.own}_{verb}(m, {number});"

    def print_general(self, out: Unit) -> None:
        """Print the functions that record, exit, act and enter for a transition's number."""
        self.histories.print_record(out)
        self._domains(out)
        self.print_leave(out)
        self.print_act(out)
        self.print_enter(out)

    def _domains(self, out: Unit) -> None:
        domains = [_number(variants[-1].domain) for variants in self.plan.variants]
        what = "By transition: the state plus one below which it acts."
        self.table(out, "domain_of", domains, what)
        out.define("domain")
        head = f"{self.own}_domain(const {self.own} *m, {self.names.taken_type} taken)"
        out.line(f"static uint16_t {head}")
        with out.block("{"):
            if not self.by_history(out, lambda own: [f"return {_number(own.domain)}u;"]):
                out.line("(void)m;")
            out.line(f"return {self.domain_taken(len(domains))};")
        out.line()

    def domain_taken(self, count: int) -> str:
        """Return the entry of ``taken`` in the table of domains, in a form that shows its bound."""
        return f"taken - 1u < {count}u ? {self.own}_domain_of[taken - 1u] : 0u"

    def by_history(self, out: Emitter, answer: Callable[[Variant], Sequence[str]]) -> bool:
        """Print a switch over the variants of a history, with all answers but the last."""
        found = {index: own for index, own in self.variants.items() if len(own) > 1}
        if found:
            self.over_variants(out, {index: own[:-1] for index, own in found.items()}, answer)
        return bool(found)

    def over_variants(
        self,
        out: Emitter,
        variants: Mapping[int, Sequence[Variant]],
        answer: Callable[[Variant], Sequence[str]],
    ) -> None:
        """Print a switch over the number of the transition, with the answers of its variants."""
        with out.block("switch (taken) {"):
            for index, own in variants.items():
                note = self.selection.comment(self.chart.transitions[index])
                with case(out, f"{index + 1}u: /* {note} */"):
                    for variant in own:
                        if not variant.conditions:
                            out.lines(answer(variant))
                            continue
                        tests = " && ".join(map(self.histories.within, variant.conditions))
                        with out.block(f"if ({tests}) {{"):
                            out.lines(answer(variant))
            default(out)

    def print_leave(self, out: Unit) -> None:
        """Print the function that exits all states below a domain, by its number plus one."""
        found = {_number(each.domain) for own in self.variants.values() for each in own}
        out.define("leave")
        out.line(f"static void {self.own}_leave({self.own} *m, uint16_t domain)")
        with out.block("{"):
            if found <= {0}:
                out.line("(void)m;")
            with out.block("switch (domain) {"):
                for domain in sorted(found - {0}):
                    out.line(f"case {domain}u: {self.names.note(domain - 1)}")
                    out.lines([f"    {self.exit_below_call(domain - 1)}", "    break;"])
                default(out)
        out.line()

    def print_act(self, out: Unit) -> None:
        """Print the content of each transition, which runs between exit and entry."""
        bodies: dict[int, Lines] = {}
        for transition in self.chart.transitions:
            if transition.content and transition.trigger is not Trigger.INITIAL:
                each, what = Emitter(), self.selection.comment(transition)
                self.content.block(each, transition.content, transition.events, what)
                bodies[transition.index] = each.collected()
        done, before = self.merge_contents(bodies)
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

    @property
    def transition_taken(self) -> str:
        """The transition whose number is ``taken``."""
        return f"({self.names.taken_type})(taken - 1u)"

    def numbers(self, transition: int) -> Sequence[int]:
        """Return the numbers by which a transition is taken."""
        return [transition + 1]

    def set_active(self, state: int) -> str:
        """Return the statement that makes a state the deepest active one of its region."""
        region = self.plan.region_of[state]
        return f"m->{self.names.regions[region]} = {self.names.number(state)};"

    def table(self, out: Unit, name: str, values: Sequence[int], note: str) -> None:
        """Print a table of numbers."""
        ctype = narrowest(max(values))
        out.define(name)
        out.line(f"/* {note} */")
        with out.block(f"static const {ctype} {self.own}_{name}[{len(values)}] = {{", "};"):
            for at in range(0, len(values), 16):
                out.line(", ".join(f"{value}u" for value in values[at : at + 16]) + ",")
        out.line()


def _number(domain: int | None) -> int:
    """Return a domain as its number plus one, 0 for None."""
    return 0 if domain is None else domain + 1
