"""A machine as tables, and functions that read them: each thing is there once, whatever is active.

Every transition is selected by Appendix D; what it leaves and enters is looked up. That takes more
time than straight code, the more states lie above each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import accumulate
from typing import Any, ClassVar

from fsmkit.chart.analysis.effects import can_stop
from fsmkit.chart.chart import Transition
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.layout import WIDTH, narrowest
from fsmkit.codegen.c.names import NARROW, Names
from fsmkit.codegen.c.pieces import print_pieces
from fsmkit.codegen.c.reactions.entry_sets import Merged, MovePrinter
from fsmkit.codegen.c.reactions.forms import Form
from fsmkit.codegen.c.reactions.selection import SelectionPrinter
from fsmkit.codegen.c.small.alike import COPY, Alike
from fsmkit.codegen.c.small.differences import At, Fired, Handlers, handlers
from fsmkit.codegen.c.small.paths import Lines, Paths
from fsmkit.codegen.c.small.together import Together
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.plan import Content, Enter
from fsmkit.plan.instances import Instance
from fsmkit.plan.operations import Arm, Ops


class SmallPrinter(MovePrinter):
    """Prints the tables and the functions."""

    is_plain: ClassVar[bool] = False
    """Whether rows are by number of what is taken, and paths begin with what is left."""

    def __init__(self, names: Names, content: ContentPrinter, selection: SelectionPrinter) -> None:
        """Find all paths, so that they can be named before the tables are printed."""
        super().__init__(names, content, selection)
        if not self.plan.is_single:
            self._region(content.functions)
        self.alike = Alike(names, content.functions)
        self.paths = Paths(self)
        self._states = range(1, len(self.chart.states))
        self.taken = [t for t in self.chart.transitions if t.trigger is not Trigger.INITIAL]
        self._add_paths()

    def _add_paths(self) -> None:
        for transition in self.taken:
            for variant in self.plan.variants[transition.index]:
                self.paths.add(variant.entry)
        self.paths.add(self.plan.start)

    # --- calls ----------------------------------------------------------------------------

    def ops(self, out: Emitter, ops: Ops) -> None:
        """Print the call that goes a path, or what stands on it where that is one state at most."""
        if self.names.form is Form.GRID:
            for op in ops:
                if isinstance(op, Enter):
                    out.line(f"{self.own}_enter_place(m, {op.state}u);")
                elif isinstance(op, Content):
                    self.take_content(out, op.transition)
            return
        out.lines(self._path(ops))

    def _path(self, ops: Ops) -> Lines:
        return (f"{self.own}_enter_path(m, {self._path_at(ops)}u);",)

    def exit_call(self, state: int) -> list[str]:
        """Return the call of what is done when a state is left."""
        return [f"{self.own}_exit_of(m, {state}u);"]

    def leave_below(self, domain: int) -> str:
        """Return the call that leaves all states strictly below a domain."""
        return self._leave(domain, keep="false")

    def leave_machine(self) -> str:
        """Return the call that leaves everything, but lets the regions tell where it was."""
        return self._leave(0, keep="true")

    def _leave(self, domain: int, keep: str) -> str:
        last = ""
        if not self.plan.is_single:
            last = f"{self.plan.last_region(domain)}u, "
        return f"{self.own}_leave_until(m, {domain}u, {last}{keep});"

    # --- states ---------------------------------------------------------------------------

    def print_states(self, out: Unit) -> None:
        """Print how states are entered and left."""
        self.table(out, "place_above", self.plan.parents, "By state: the state around it.")
        if not self.plan.is_single:
            self.table(out, "region_of", self.plan.region_of, "By state: its region.")
        of_states = [self.plan.instances.state(state) for state in range(len(self.chart.states))]
        self.copies(out, "copy_of", of_states, "By state: the number of the copy it lies in.")
        tree = partial(handlers, self.plan, is_entry=True)
        self._over_states(out, "entry", self.names.hook("ENTER"), self.entry, tree)
        self._place(out, "enter_place")
        tree = partial(handlers, self.plan, is_entry=False)
        self._over_states(out, "exit", "FSM_HOOK_EXIT", self.leave_state, tree)
        self._place(out, "leave_until")
        if self.paths.restores:
            last = self.plan.last_below
            self.table(out, "place_last", last, "By state: the last one below it in its region.")
            self._place(out, "enter_recorded")
        self._walk(out)

    @property
    def _width(self) -> str:
        """The C type of a place."""
        return "uint8_t" if len(self._states) <= NARROW else "uint16_t"

    def copies(self, out: Unit, name: str, places: Sequence[Instance | None], note: str) -> None:
        """Print the table of the numbers of copies in which something stands."""
        if any(places):
            self.table(out, name, self.alike.copies(places), note)

    def print_copies(self, out: Unit) -> None:
        """Print the table by which one body does for the transitions of all copies."""
        of = [self.plan.instances.transition(t.index) for t in self.chart.transitions]
        self.copies(out, "copy_taking", of, "By transition: the number of the copy it lies in.")

    def _print_handlers(self, out: Emitter, names: Together, tree: Any) -> None:
        """Print what is done when a state of each copy is entered or left."""
        self.under(names).actions(out, tree.actions, tree.what)

    def _content_of(self, transition: int) -> At:
        """Return what a transition does, to be compared."""
        t = self.chart.transitions[transition]
        return At(t.events, t.content, f"{self.selection.comment(t)}, in each copy")

    def _print_content(self, out: Emitter, names: Together, tree: Any) -> None:
        self.content.under(names).block(out, tree.content, tree.events, tree.what)

    def guard_of(self, transition: int) -> At | None:
        """Return what a transition asks, to be compared; None for what is asked only once."""
        t = self.chart.transitions[transition]
        return None if self.selection.is_remembered(t) else At(t.events, t.guard, "", transition)

    def merge_timeouts(self, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return what timeouts do, with those that do it, and how it finds its copy."""
        places = {t: self.plan.instances.transition(t) for t in bodies}
        done, reads = self.alike.merge(bodies, places, self._fired, self._print_fired)
        return done, (self._copy_of("timer.what"),) if reads else ()

    def _copy_of(self, transition: str) -> str:
        return f"const uint8_t {COPY} = {self.own}_copy_taking[{transition}];"

    def _fired(self, transition: int) -> Fired | None:
        """Return what a timeout does, to be compared."""
        t = self.chart.transitions[transition]
        armed = Arm(transition, t.delay) if t.trigger is Trigger.EVERY else None
        guard = None if t.guard is None else At(t.events, t.guard, "", transition)
        return Fired(transition, armed, guard) if self.names.form is Form.TABLES else None

    def _print_fired(self, out: Emitter, names: Together, tree: Any) -> None:
        if tree.armed is not None:
            out.line(self.under(names).arm(tree.transition))
        verb = "take" if self.plan.is_single else "take_one"
        step = f"{self.own}_{verb}(m, {names.taken_by(tree.transition, self.number)});"
        if tree.guard is None:
            out.line(step)
            return
        asking = replace(self.chart.transitions[tree.transition], guard=tree.guard.content)
        test = self.selection.under(names).guard(asking)
        if can_stop(tree.guard.content):
            test += " && m->fsm.fault == FSM_NO_FAULT"
        with out.block(f"if ({test}) {{"):
            out.line(step)

    def print_guard(self, out: Emitter, names: Together, tree: Any) -> None:
        """Print what the transition of each copy asks."""
        asking = replace(self.chart.transitions[tree.of], guard=tree.content)
        out.line(f"return {self.selection.under(names).asked(asking)};")

    def _place(self, out: Unit, name: str) -> None:
        """Print a function that reads the tables."""
        count = len(self.chart.events)
        eventless = any(t.trigger is Trigger.EVENTLESS for t in self.taken)
        parallel = filter(self._is_parallel, self._states)
        parts = {
            "self_number": self._width,
            "self_within": self.names.number_type(0),
            "SELF_ACTIVE": f"m->{self.names.regions[0]}",
            "SELF_REGION_COUNT": f"{len(self.plan.regions)}u",
            "SELF_PLACES": f"{len(self._states)}u",
            "SELF_PATH_LENGTH": f"{len(self.paths.codes)}u",
            "self_step": self._step_type,
            "SELF_FORGET_HISTORIES": self._forget_all(),
            "SELF_ASKED": f"event <= {count}u ? event : 0u" if eventless else "event",
            "SELF_ASKED_EVENTLESS": f"{count + 1}u",
            "SELF_NOT_PARALLEL": "".join(
                f" && place != {self.names.number(state)}" for state in parallel
            ),
        }
        facts = {
            "PLAIN": self.is_plain,
            "SPECIAL_STEPS": bool(self.paths.specials),
        }
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
        body: Callable[[Emitter, int], None],
        tree: Callable[[int], Handlers],
    ) -> None:
        """Print a function that does what one state does when it is entered or left.

        States that do the same share a case, and those that do nothing have none.
        """
        p = self.own
        bodies: dict[int, Lines] = {}
        for state in self._states:
            each = Emitter()
            body(each, state)
            if lines := each.collected():
                bodies[state] = lines
        places = {state: self.plan.instances.state(state) for state in bodies}
        done, reads = self.alike.merge(bodies, places, tree, self._print_handlers)
        out.define(f"{verb}_of")
        out.line(f"static void {p}_{verb}_of({p} *m, {self._width} place)")
        with out.block("{"):
            out.line(f"{hook}(m, ({p}_state)place);")
            if reads:
                out.line(f"const uint8_t {COPY} = {p}_copy_of[place];")
            if done:
                with out.block("switch (place) {"):
                    for members, lines in done:
                        for state in members:
                            out.line(f"case {self.names.number(state)}:")
                        with out.indented():
                            out.lines((*lines, "break;"))
                    default(out)
        out.line()

    def _path_at(self, ops: Ops) -> int:
        return self.paths.at(ops)

    def _walk(self, out: Unit) -> None:
        p, specials = self.own, self.paths.specials
        self.table(
            out,
            "path_places",
            self.paths.codes,
            "States to enter; each path ends with 0.",
        )
        if not specials:
            self._place(out, "enter_path")
            return
        out.define("path_step")
        out.line("/* What is asked or done on a path; returns how much of it to skip. */")
        skipped = narrowest(len(self.paths.codes), least="uint16_t")
        out.line(f"static {skipped} {p}_path_step({p} *m, {self._step_type} code)")
        with out.block("{"), out.block("switch (code) {"):
            for lines, code in specials.items():
                out.line(f"case {code}u:")
                with out.indented():
                    out.lines(lines)
            out.lines(["default:", "    return 0u;"])
        out.line()
        self._place(out, "enter_path")

    @property
    def _step_type(self) -> str:
        return narrowest(len(self._states) + len(self.paths.specials), least="uint16_t")

    def _forget_all(self) -> Lines:
        """Return what makes histories hold nothing whose parents are active after a path."""
        out = Emitter()
        for state, histories in enumerate(self.plan.forgotten):
            if histories:
                test = self.names.in_state("m", state).text
                with out.block(f"if ({test}) {{"):
                    for history in histories:
                        self.forget(out, history)
        return out.collected()

    # --- transitions ----------------------------------------------------------------------

    def domain_taken(self, count: int) -> str:
        """Return the entry of ``taken`` in the table of domains, without a bound."""
        del count
        return f"{self.own}_domain_of[taken - 1u]"

    def merge_contents(self, out: Unit, bodies: dict[int, Lines]) -> tuple[Merged, Lines]:
        """Return what transitions do, with all that do it, and how it finds its copy."""
        self.print_copies(out)
        places = {t: self.plan.instances.transition(t) for t in bodies}
        done, reads = self.alike.merge(bodies, places, self._content_of, self._print_content)
        return done, (self._copy_of(self.transition_taken),) if reads else ()

    def print_leave(self, out: Unit) -> None:
        """Print how all is left below a domain, by its number plus one."""
        if not self.plan.is_single:
            super().print_leave(out)
            return
        out.define("leave")
        out.line(f"static void {self.own}_leave({self.own} *m, uint16_t domain)")
        with out.block("{"), out.block("if (domain != 0u) {"):
            out.line(f"{self.own}_leave_until(m, ({self._width})(domain - 1u), false);")
        out.line()

    def print_enter(self, out: Unit) -> None:
        """Print what each transition enters."""
        p, reactions = self.own, self.plan.reactions
        begins = [self.paths.at(own[-1].enter) if own else 0 for own in reactions]
        self.table(out, "path_of", begins, "By transition: where its path begins.")
        out.define("enter")
        out.line(f"static void {p}_enter({p} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            self.by_history(out, lambda each: [*self._path(each.enter), "return;"])
            out.line(f"{p}_enter_path(m, {p}_path_of[taken - 1u]);")
        out.line()

    # --- selection ------------------------------------------------------------------------

    def print_selection(self, out: Unit) -> None:
        """Print how transitions are selected."""
        rows = [self._rows(state) for state in self._states]
        flat = [row for own in rows for row in own] or [(0, 0, "none")]
        widest = max(max(event, taken) for event, taken, _ in flat)
        ctype = narrowest(widest + 1)
        defer = 2 ** (8 * WIDTH[ctype]) - 1
        p, upper = self.own, self.names.own_upper
        out.define("DEFER")
        out.line(f"#define {upper}_DEFER {defer}u")
        if not self.plan.is_single:
            out.define("REGIONS")
            out.line(f"#define {upper}_REGIONS {len(self.plan.regions)}u")
        out.line()
        self._holds(out)
        out.define("row_table")
        out.line("/* What is asked in each state: the event, the transition plus one. */")
        with out.block(f"static const {ctype} {p}_row_table[{len(flat)}][2] = {{", "};"):
            for event, taken, note in flat:
                answer = f"{upper}_DEFER" if taken < 0 else f"{taken}u"
                out.line(f"{{{event}u, {answer}}}, /* {note} */")
        out.line()
        first = [0, 0, *accumulate(map(len, rows))]
        self.table(out, "row_first", first, "By state: its first row; the last are not one's.")
        self._place(out, "select_at")

    def _holds(self, out: Unit) -> None:
        """Print the function that evaluates a guard."""
        guarded = [t for t in self.taken if t.guard is not None and _is_selected(t)]
        bodies = {t.index: (f"return {self.selection.asked(t)};",) for t in guarded}
        places = {t: self.plan.instances.transition(t) for t in bodies}
        done, reads = self.alike.merge(bodies, places, self.guard_of, self.print_guard)
        out.define("guard_of")
        out.line(f"static bool {self.own}_guard_of({self.own} *m, {self.names.taken_type} taken)")
        with out.block("{"):
            if not self.selection.reads_machine(guarded):
                out.line("(void)m;")
            if reads:
                if any(state.defer for state in self.chart.states):
                    with out.block(f"if (taken == {self.names.own_upper}_DEFER) {{"):
                        out.line("return true;")
                out.line(f"const uint8_t {COPY} = {self.own}_copy_taking[taken - 1u];")
            with out.block("switch (taken) {"):
                for members, lines in done:
                    for t in members:
                        comment = self.selection.comment(self.chart.transitions[t])
                        out.line(f"case {t + 1}u: /* {comment} */")
                    with out.indented():
                        out.lines(lines)
                out.lines(["default:", "    return true;"])
        out.line()

    def _rows(self, state: int) -> list[tuple[int, int, str]]:
        """Return event, transition plus one, and note of what a state asks; -1: it defers."""
        chart = self.chart
        found: list[tuple[int, int, str]] = []
        for trigger in (Trigger.EVENT, Trigger.EVENTLESS):
            for transition in self.selection.decisions.transitions_of(state, trigger):
                note = self.selection.comment(transition)
                is_event = trigger is Trigger.EVENT
                events = transition.events if is_event else (len(chart.events),)
                found += [(event + 1, transition.index + 1, note) for event in events]
        closed = {e for e, t, _ in found if chart.transitions[t - 1].guard is None}
        defers = comment(chart.states[state].id + " defers")
        kept = (event + 1 for event in self.selection.decisions.deferred_by(state))
        return found + [(event, -1, defers) for event in kept if event not in closed]

    def print_selectors(self, out: Unit) -> None:
        """Print the functions that the loop calls, after the type of what they find."""
        many = "" if self.plan.is_single else "_0"
        self._place(out, f"select_event{many}")
        self._place(out, f"select_eventless{many}")

    def _is_parallel(self, state: int) -> bool:
        return self.chart.states[state].kind is Kind.PARALLEL


def _is_selected(transition: Transition) -> bool:
    return transition.trigger in (Trigger.EVENT, Trigger.EVENTLESS)
