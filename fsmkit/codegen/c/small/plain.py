"""The tables of charts of one region without histories and deferral, which can be smaller.

What is taken is a number by the row in which it is asked, so that rows need not say it; guards have
numbers of their own; where a path begins stands what is left first.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.small.alike import COPY
from fsmkit.codegen.c.small.printing import SmallPrinter
from fsmkit.plan import Plan
from fsmkit.plan.instances import Instance
from fsmkit.plan.operations import Ops


def is_plain(plan: Plan) -> bool:
    """Whether a chart can have these tables."""
    return plan.is_single and not any(s.is_history or s.defer for s in plan.chart.states)


class PlainPrinter(SmallPrinter):
    """Prints the tables and the functions."""

    is_plain = True

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Find all paths and all rows."""
        super().__init__(names, content, selection)
        self._rows_of = [self._rows(state) for state in self._states]
        asked = [row for rows in self._rows_of for row in rows]
        self._asked = [(event, self.chart.transitions[taken - 1]) for event, taken, _ in asked]
        self._numbers: dict[int, list[int]] = {}
        for number, (_, transition) in enumerate(self._asked, 1):
            self._numbers.setdefault(transition.index, []).append(number)
        others = [t for t in self.taken if t.index not in self._numbers]
        for number, transition in enumerate(others, len(self._asked) + 1):
            self._numbers[transition.index] = [number]
        self._all = [*(t for _, t in self._asked), *others]
        """By number, from that of 1."""

    def _add_paths(self) -> None:
        self.paths.begin([0, 0])
        for transition in self.taken:
            (variant,) = self.plan.variants[transition.index]
            if variant.domain is not None:
                self.paths.add(variant.entry, variant.domain)
        self.paths.add(self.plan.start, 0)

    def number(self, transition: int) -> int:
        """Return the first number of a transition."""
        return self._numbers[transition][0]

    def print_general(self, out: Unit) -> None:
        """Print where the paths of all transitions begin, and what these do."""
        begins = []
        for transition in self._all:
            (variant,) = self.plan.variants[transition.index]
            domain = variant.domain
            begins.append(0 if domain is None else self.paths.at(variant.entry, domain))
        self.table(
            out,
            "path_of",
            begins or [0],
            "By number of what is taken: what it leaves, then its path; 0 for none.",
        )
        taken = [t.index for t in self._all] or [0]
        self.table(out, "transition_of", taken, "By number of what is taken: the transition.")
        self.print_act(out)

    @property
    def transition_taken(self) -> str:
        """The transition whose number is ``taken``."""
        return f"{self.own}_transition_of[taken - 1u]"

    def numbers(self, transition: int) -> Sequence[int]:
        """Return the numbers by which a transition is taken."""
        return self._numbers[transition]

    def print_selection(self, out: Unit) -> None:
        """Print how transitions are selected."""
        guards: dict[str, int] = {}
        places: dict[int, Instance | None] = {}
        asking: dict[int, int] = {}
        for _, transition in self._asked:
            if transition.guard is not None:
                number = guards.setdefault(self.selection.asked(transition), len(guards) + 1)
                place = self.plan.instances.transition(transition.index)
                places[number] = place if places.get(number, place) == place else None
                asking.setdefault(number, transition.index)
        bodies = {number: (f"return {text};",) for text, number in guards.items()}
        done, reads = self.alike.merge(
            bodies, places, lambda number: self.guard_of(asking[number]), self.print_guard
        )
        of = [None, *(places[number] for number in guards.values())]
        self.copies(out, "copy_asking", of, "By guard: the number of the copy it lies in.")
        p = self.own
        out.define("guard_of")
        out.line(f"static bool {p}_guard_of({p} *m, {self.names.taken_type} guard)")
        with out.block("{"):
            if not self.selection.reads_machine(t for _, t in self._asked):
                out.line("(void)m;")
            if reads:
                out.line(f"const uint8_t {COPY} = {p}_copy_asking[guard];")
            with out.block("switch (guard) {"):
                for numbers, lines in done:
                    out.lines(f"case {number}u:" for number in numbers)
                    with out.indented():
                        out.lines(lines)
                out.lines(["default:", "    return true;"])
        out.line()
        asked = [0 if t.guard is None else guards[self.selection.asked(t)] for _, t in self._asked]
        events = [event for event, _ in self._asked]
        self.table(out, "row_event", events or [0], "By row: the event that is asked for.")
        self.table(out, "row_guard", asked or [0], "By row: the guard; 0 for none.")
        first = [0, 0, *accumulate(map(len, self._rows_of))]
        self.table(out, "row_first", first, "By state: its first row; the last are not one's.")
        self._place(out, "select_at")

    def print_take(self, out: Unit) -> None:
        """Print the function that takes what was selected."""
        self._place(out, "take")

    def _path_at(self, ops: Ops) -> int:
        return self.paths.at(ops, 0)


def small_printer(
    names: Names, content: ContentPrinter, selection: SelectionPrinter
) -> SmallPrinter:
    """Return what prints the tables of a chart."""
    kind = PlainPrinter if is_plain(names.plan) else SmallPrinter
    return kind(names, content, selection)
