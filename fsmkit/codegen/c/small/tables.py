"""The form for size: the tables of the Plan, and functions that read them.

Every transition is selected by Appendix D; tables hold what it exits and enters. Deeper hierarchies
therefore take more time than in straight code.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import accumulate
from typing import Any, assert_never

from fsmkit.chart.analysis.effects import can_stop
from fsmkit.chart.chart import Transition
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.forms import Form
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import WIDTH, narrowest
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.actions import ActionPrinter
from fsmkit.codegen.c.reactions.form_printer import FormPrinter, Lines, Merged
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.small.copy_names import CopyNames
from fsmkit.codegen.c.small.differences import (
    ContentInContext,
    StateActions,
    TimeoutBody,
    state_actions,
)
from fsmkit.codegen.c.small.merging import COPY, BodyMerger
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan import Content, Enter, Reaction, Variant
from fsmkit.plan.instances import Instance
from fsmkit.plan.operations import Arm, Leave, Ops
from fsmkit.plan.tables import EnterRecorded, Row, Skip, SkipUnless, Special, tables_of


class TablePrinter(FormPrinter):
    """Prints the tables and the functions."""

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Compute the tables, so that paths can be named before they are printed."""
        super().__init__(names, content, selection)
        if not self.plan.is_single:
            self._region(content.functions)
        self._merger = BodyMerger(names, content.functions)
        self._states = range(1, len(self.chart.states))
        self._tables = tables_of(self.plan, selection.decisions)
        self._paths = self._tables.paths
        self._specials = {code: self._special(each) for each, code in self._paths.specials.items()}
        """The lines of each special step of a path, by its code."""

    def _special(self, step: Special) -> Lines:
        """Return the lines of a special step, which return how many codes to skip."""
        out, skip = Emitter(), 0
        match step:
            case Content(transition):
                self.actions.take_content(out, transition)
            case Skip(skip):
                pass
            case SkipUnless(history, region, state, skip):
                test = self.histories.is_recorded(history, region, state)
                out.lines([f"if ({test}) {{", "    return 0u;", "}"])
            case EnterRecorded(history, regions):
                for region, first in regions:
                    last = f"m->{self.names.histories[history, region]}"
                    out.line(f"{self.own}_enter_recorded(m, {first}u, {last});")
            case _:
                assert_never(step)
        return (*out.collected(), f"return {skip}u;")

    # --- calls ----------------------------------------------------------------------------

    def entry(self, out: Emitter, ops: Ops) -> None:
        """Print the call that enters a path; in a grid, the entry of one state."""
        if self.names.form is not Form.GRID:
            out.line(self._enter_path(ops, 0))
            return
        for op in ops:
            if isinstance(op, Enter):
                out.line(f"{self.own}_enter_place(m, {op.state}u);")
            elif isinstance(op, Content):
                self.actions.take_content(out, op.transition)

    def _enter_path(self, ops: Ops, domain: int | None) -> str:
        return f"{self.own}_enter_path(m, {self._tables.path_at(ops, domain)}u);"

    def exit_listed(self, out: Emitter, reaction: Reaction) -> None:
        """Print the exit of the one state of a grid."""
        out.lines(
            f"{self.own}_exit_of(m, {op.state}u);" for op in reaction.leave if isinstance(op, Leave)
        )

    def exit_below_call(self, domain: int) -> str:
        """Return the call that exits all active states strictly below a domain."""
        return self._leave_until(domain, keep="false")

    def exit_machine_call(self) -> str:
        """Return the call that exits all states; their regions keep the numbers."""
        return self._leave_until(0, keep="true")

    def _leave_until(self, domain: int, keep: str) -> str:
        last = "" if self.plan.is_single else f"{self.plan.last_region(domain)}u, "
        return f"{self.own}_leave_until(m, {domain}u, {last}{keep});"

    # --- states ---------------------------------------------------------------------------

    def print_states(self, out: Unit) -> None:
        """Print the functions that enter and exit states."""
        self.table(out, "place_above", self.plan.parents, "By state: the state around it.")
        if not self.plan.is_single:
            self.table(out, "region_of", self.plan.region_of, "By state: its region.")
        of_states = [self.plan.instances.state(state) for state in range(len(self.chart.states))]
        self._copies(out, "copy_of", of_states, "By state: the number of the copy it lies in.")
        tree = partial(state_actions, self.plan, is_entry=True)
        hook = self.names.hook("ENTER")
        self._over_states(out, "entry", hook, self.actions.entry_actions, tree)
        self._piece(out, "enter_place")
        tree = partial(state_actions, self.plan, is_entry=False)
        self._over_states(out, "exit", "FSM_HOOK_EXIT", self.actions.exit_actions, tree)
        self._piece(out, "leave_until")
        if any(isinstance(each, EnterRecorded) for each in self._paths.specials):
            last = self.plan.last_below
            self.table(out, "place_last", last, "By state: the last one below it in its region.")
            self._piece(out, "enter_recorded")
        self._walk(out)

    @property
    def _width(self) -> str:
        """The C type of a place."""
        return "uint8_t" if len(self._states) <= NARROW else "uint16_t"

    def _piece(self, out: Unit, name: str) -> None:
        """Print a function that reads the tables."""
        count = len(self.chart.events)
        eventless = any(t.trigger is Trigger.EVENTLESS for t in self.chart.transitions)
        parallel = (s for s in self._states if self.chart.states[s].kind is Kind.PARALLEL)
        parts = {
            "self_number": self._width,
            "self_within": self.names.number_type(0),
            "SELF_ACTIVE": f"m->{self.names.regions[0]}",
            "SELF_REGION_COUNT": f"{len(self.plan.regions)}u",
            "SELF_PLACES": f"{len(self._states)}u",
            "SELF_PATH_LENGTH": f"{len(self._paths.codes)}u",
            "self_step": self._step_type,
            "SELF_FORGET_HISTORIES": self._forget_all(),
            "SELF_ASKED": f"event <= {count}u ? event : 0u" if eventless else "event",
            "SELF_ASKED_EVENTLESS": f"{count + 1}u",
            "SELF_NOT_PARALLEL": "".join(
                f" && place != {self.names.number(state)}" for state in parallel
            ),
        }
        facts = {"PLAIN": self._tables.is_compact, "SPECIAL_STEPS": bool(self._specials)}
        print_pieces(out, self.names, "tables", name, parts=parts, facts=facts)

    def _region(self, out: Unit) -> None:
        number, region = self.names.number_type(0), self.names.region_type
        out.define("region_at")
        out.line(f"static {number} *{self.own}_region_at({self.own} *m, {region} region)")
        with out.block("{"), out.block("switch (region) {"):
            for index, name in enumerate(self.names.regions[1:], 1):
                out.lines([f"case {index}u:", f"    return &m->{name};"])
            out.lines(["default:", f"    return &m->{self.names.regions[0]};"])
        out.line()

    def _over_states(
        self,
        out: Unit,
        verb: str,
        hook: str,
        print_: Callable[[Emitter, int], None],
        tree: Callable[[int], StateActions],
    ) -> None:
        """Print a function with the actions of each state when it is entered or exited.

        States with equal actions share a case, and states without actions have none.
        """
        p = self.own
        bodies: dict[int, Lines] = {}
        for state in self._states:
            each = Emitter()
            print_(each, state)
            if lines := each.collected():
                bodies[state] = lines
        places = {state: self.plan.instances.state(state) for state in bodies}
        done, reads = self._merger.merge(bodies, places, tree, self._print_handlers)
        out.define(f"{verb}_of")
        out.line(f"static void {p}_{verb}_of({p} *m, {self._width} place)")
        with out.block("{"):
            out.line(f"{hook}(m, ({p}_state)place);")
            if reads:
                out.line(f"const uint8_t {COPY} = {p}_copy_of[place];")
            if done:
                with out.block("switch (place) {"):
                    for members, lines in done:
                        out.lines(f"case {self.names.number(state)}:" for state in members)
                        with out.indented():
                            out.lines((*lines, "break;"))
                    default(out)
        out.line()

    def _walk(self, out: Unit) -> None:
        """Print the paths, and the functions that enter them."""
        p, codes = self.own, self._paths.codes
        self.table(out, "path_places", codes, "States to enter; each path ends with 0.")
        if self._specials:
            out.define("path_step")
            out.line("/* Run a special step of a path; return how many codes to skip. */")
            skipped = narrowest(len(codes), least="uint16_t")
            out.line(f"static {skipped} {p}_path_step({p} *m, {self._step_type} code)")
            with out.block("{"), out.block("switch (code) {"):
                for code, lines in self._specials.items():
                    out.line(f"case {code}u:")
                    with out.indented():
                        out.lines(lines)
                out.lines(["default:", "    return 0u;"])
            out.line()
        self._piece(out, "enter_path")

    @property
    def _step_type(self) -> str:
        return narrowest(len(self._states) + len(self._specials), least="uint16_t")

    def _forget_all(self) -> Lines:
        """Return the statements that clear histories whose parents are active after a path."""
        out = Emitter()
        for state, histories in enumerate(self.plan.forgotten):
            if histories:
                test = self.names.in_state("m", state).text
                with out.block(f"if ({test}) {{"):
                    for history in histories:
                        self.actions.forget(out, history)
        return out.collected()

    # --- transitions ----------------------------------------------------------------------

    def print_general(self, out: Unit) -> None:
        """Print the effects of transitions, by the number that takes them."""
        if not self._tables.is_compact:
            super().print_general(out)
            return
        taken = self._tables.taken
        paths = [self._tables.path_of(t.index) for t in taken]
        note = "By number taken: the domain, then the path; 0 for none."
        self.table(out, "path_of", paths or [0], note)
        note = "By number taken: the transition."
        self.table(out, "transition_of", [t.index for t in taken] or [0], note)
        self.print_act(out)

    def print_take(self, out: Unit) -> None:
        """Print the function that takes the selected transition."""
        if self._tables.is_compact:
            self._piece(out, "take")
        else:
            super().print_take(out)

    def domain_taken(self, count: int) -> str:
        """Return the entry of ``taken`` in the table of domains, without a bound."""
        del count
        return f"{self.own}_domain_of[taken - 1u]"

    @property
    def transition_taken(self) -> str:
        """The transition whose number is ``taken``."""
        compact = f"{self.own}_transition_of[taken - 1u]"
        return compact if self._tables.is_compact else super().transition_taken

    def numbers(self, transition: int) -> Sequence[int]:
        """Return the numbers by which a transition is taken."""
        return self._tables.numbers[transition]

    def print_leave(self, out: Unit) -> None:
        """Print the function that exits all below a domain, by its number plus one."""
        if not self.plan.is_single:
            super().print_leave(out)
            return
        out.define("leave")
        out.line(f"static void {self.own}_leave({self.own} *m, uint16_t domain)")
        with out.block("{"), out.block("if (domain != 0u) {"):
            out.line(f"{self.own}_leave_until(m, ({self._width})(domain - 1u), false);")
        out.line()

    def print_enter(self, out: Unit) -> None:
        """Print the function that enters the entry set of a transition."""
        p, tables = self.own, self._tables

        def enter(variant: Variant) -> Lines:
            return self._enter_path(variant.entry, variant.domain), "return;"

        count = len(self.chart.transitions)
        starts = [tables.path_of(n) if n in self.variants else 0 for n in range(count)]
        self.table(out, "path_of", starts, "By transition: where its path starts.")
        out.define("enter")
        out.line(f"static void {p}_enter({p} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            self.by_history(out, enter)
            out.line(f"{p}_enter_path(m, {p}_path_of[taken - 1u]);")
        out.line()

    # --- selection ------------------------------------------------------------------------

    def print_selection(self, out: Unit) -> None:
        """Print the constants and tables of a selection."""
        rows = self._tables.rows
        flat = [row for own in rows for row in own]
        (self._compact_rows if self._tables.is_compact else self._rows)(out, flat)
        first = [0, 0, *accumulate(map(len, rows))]
        self.table(out, "row_first", first, "By state: its first row; the last are not one's.")
        self._piece(out, "select_at")

    def _rows(self, out: Unit, rows: Sequence[Row]) -> None:
        """Print the rows, each with its transition, and the guards by transition."""
        p, upper = self.own, self.names.own_upper
        most = max(
            (max(row.event, -1 if (t := row.transition) is None else t.index) for row in rows),
            default=-1,
        )
        ctype = narrowest(most + 2)
        out.define("DEFER")
        out.line(f"#define {upper}_DEFER {2 ** (8 * WIDTH[ctype]) - 1}u")
        if not self.plan.is_single:
            out.define("REGIONS")
            out.line(f"#define {upper}_REGIONS {len(self.plan.regions)}u")
        out.line()
        self._guards(out)
        out.define("row_table")
        out.line("/* The candidates of each state: the event, the transition plus one. */")
        with out.block(f"static const {ctype} {p}_row_table[{len(rows) or 1}][2] = {{", "};"):
            for row in rows:
                taken, note = f"{upper}_DEFER", comment(self.chart.states[row.state].id + " defers")
                if row.transition is not None:
                    taken = f"{row.transition.index + 1}u"
                    note = self.selection.comment(row.transition)
                out.line(f"{{{row.event + 1}u, {taken}}}, /* {note} */")
            if not rows:
                out.line("{0u, 0u}, /* none */")
        out.line()

    def _guards(self, out: Unit) -> None:
        """Print the function that evaluates the guard of a transition, by its number."""
        triggers = (Trigger.EVENT, Trigger.EVENTLESS)
        guarded = [
            t for t in self.chart.transitions if t.guard is not None and t.trigger in triggers
        ]
        bodies = {t.index: (f"return {self.selection.memoized_guard(t)};",) for t in guarded}
        places = {t: self.plan.instances.transition(t) for t in bodies}
        done, reads = self._merger.merge(bodies, places, self._guard, self._print_guard)
        before: list[str] = []
        if reads and any(state.defer for state in self.chart.states):
            before = [f"if (taken == {self.names.own_upper}_DEFER) {{", "    return true;", "}"]
        if reads:
            before.append(self._copy_of("taken - 1u"))
        notes = {t.index: f" /* {self.selection.comment(t)} */" for t in guarded}
        cases = [([f"case {t + 1}u:{notes[t]}" for t in members], body) for members, body in done]
        self._guard_function(out, "taken", guarded, before, cases)

    def _compact_rows(self, out: Unit, rows: Sequence[Row]) -> None:
        """Print the events and the guards of the rows, and the guards by numbers of their own."""
        tried = [row.transition for row in rows if row.transition is not None]
        numbers: dict[str, int] = {}
        places: dict[int, Instance | None] = {}
        first: dict[int, int] = {}
        for transition in tried:
            if transition.guard is not None:
                number = numbers.setdefault(
                    self.selection.memoized_guard(transition), len(numbers) + 1
                )
                place = self.plan.instances.transition(transition.index)
                places[number] = place if places.get(number, place) == place else None
                first.setdefault(number, transition.index)
        bodies = {number: (f"return {text};",) for text, number in numbers.items()}
        done, reads = self._merger.merge(
            bodies, places, lambda number: self._guard(first[number]), self._print_guard
        )
        of = [None, *(places[number] for number in numbers.values())]
        self._copies(out, "copy_asking", of, "By guard: the number of the copy it lies in.")
        before = [f"const uint8_t {COPY} = {self.own}_copy_asking[guard];"] if reads else []
        cases = [([f"case {number}u:" for number in members], body) for members, body in done]
        self._guard_function(out, "guard", tried, before, cases)
        guards = [
            0 if t.guard is None else numbers[self.selection.memoized_guard(t)] for t in tried
        ]
        events = [row.event + 1 for row in rows]
        self.table(out, "row_event", events or [0], "By row: the event.")
        self.table(out, "row_guard", guards or [0], "By row: the guard; 0 for none.")

    def _guard_function(
        self,
        out: Unit,
        number: str,
        guarded: Sequence[Transition],
        before: Sequence[str],
        cases: Sequence[tuple[Sequence[str], Lines]],
    ) -> None:
        """Print the function that evaluates a guard by a ``number``; cases: labels and bodies."""
        out.define("guard_of")
        out.line(
            f"static bool {self.own}_guard_of({self.own} *m, {self.names.taken_type} {number})"
        )
        with out.block("{"):
            if not self.selection.reads_machine(guarded):
                out.line("(void)m;")
            out.lines(before)
            with out.block(f"switch ({number}) {{"):
                for labels, lines in cases:
                    out.lines(labels)
                    with out.indented():
                        out.lines(lines)
                out.lines(["default:", "    return true;"])
        out.line()

    def print_selectors(self, out: Unit) -> None:
        """Print the functions that select, after the type of their results."""
        many = "" if self.plan.is_single else "_0"
        self._piece(out, f"select_event{many}")
        self._piece(out, f"select_eventless{many}")

    # --- copies of used charts ------------------------------------------------------------

    def _copies(self, out: Unit, name: str, places: Sequence[Instance | None], note: str) -> None:
        """Print the table of copy numbers of items; 0 outside of copies."""
        if any(places):
            numbers = [0 if place is None else place.copy for place in places]
            self.table(out, name, numbers, note)

    def _copy_of(self, transition: str) -> str:
        return f"const uint8_t {COPY} = {self.own}_copy_taking[{transition}];"

    def print_act(self, out: Unit) -> None:
        """Print the content of each transition, which runs between exit and entry."""
        of = [self.plan.instances.transition(t.index) for t in self.chart.transitions]
        self._copies(out, "copy_taking", of, "By transition: the number of the copy it lies in.")
        super().print_act(out)

    def _merge(
        self, bodies: dict[int, Lines], tree: Callable[[int], Any], print_: Any, taken: str
    ) -> tuple[Merged, Lines]:
        places = {t: self.plan.instances.transition(t) for t in bodies}
        done, reads = self._merger.merge(bodies, places, tree, print_)
        return done, (self._copy_of(taken),) if reads else ()

    def merge_contents(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return the distinct contents of transitions, and the declarations before them."""
        return self._merge(bodies, self._content, self._print_content, self.transition_taken)

    def merge_timeouts(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return the bodies of timeouts without duplicates, and the declarations before them."""
        return self._merge(bodies, self._fired, self._print_fired, "timer.what")

    def _print_handlers(self, out: Emitter, names: CopyNames, tree: Any) -> None:
        self._actions_of(names).print(out, tree.actions, tree.what)

    def _actions_of(self, names: CopyNames) -> ActionPrinter:
        return ActionPrinter(names, self.content.under(names))

    def _content(self, transition: int) -> ContentInContext:
        t = self.chart.transitions[transition]
        return ContentInContext(t.events, t.content, f"{self.selection.comment(t)}, in each copy")

    def _print_content(self, out: Emitter, names: CopyNames, tree: Any) -> None:
        self.content.under(names).block(out, tree.content, tree.events, tree.what)

    def _guard(self, transition: int) -> ContentInContext | None:
        """Return the guard of a transition, or None for one that is evaluated only once."""
        t = self.chart.transitions[transition]
        return (
            None
            if self.selection.is_memoized(t)
            else ContentInContext(t.events, t.guard, "", transition)
        )

    def _print_guard(self, out: Emitter, names: CopyNames, tree: Any) -> None:
        guarded = replace(self.chart.transitions[tree.transition], guard=tree.content)
        out.line(f"return {self.selection.under(names).memoized_guard(guarded)};")

    def _fired(self, transition: int) -> TimeoutBody | None:
        t = self.chart.transitions[transition]
        armed = Arm(transition, t.delay) if t.trigger is Trigger.EVERY else None
        guard = None if t.guard is None else ContentInContext(t.events, t.guard, "", transition)
        return TimeoutBody(transition, armed, guard) if self.names.form is Form.TABLES else None

    def _print_fired(self, out: Emitter, names: CopyNames, tree: Any) -> None:
        if tree.armed is not None:
            out.line(self._actions_of(names).arm(tree.transition))
        number = names.taken_by(tree.transition, lambda each: self.numbers(each)[0])
        step = f"{self.take_call(number)}"
        if tree.guard is None:
            out.line(step)
            return
        guarded = replace(self.chart.transitions[tree.transition], guard=tree.guard.content)
        test = self.selection.under(names).guard(guarded)
        if can_stop(tree.guard.content):
            test += " && m->fsm.fault == FSM_NO_FAULT"
        with out.block(f"if ({test}) {{"):
            out.line(step)
