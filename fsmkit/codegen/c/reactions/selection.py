"""Selecting transitions in C (Appendix D, selectTransitions), decided when compiling.

For each state with transitions there is a function that tries them and then those of the next
ancestor that has any. Which functions are called for the active atomic states is a switch over the
number of each region.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy as copy_of
from dataclasses import dataclass

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.chart import Transition
from fsmkit.chart.forms import form
from fsmkit.codegen.c.expressions.cases import default
from fsmkit.codegen.c.expressions.content import ContentPrinter
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.forms import Form
from fsmkit.codegen.c.ir import Unit
from fsmkit.codegen.c.names import Names
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit import Emitter
from fsmkit.emit.c import comment
from fsmkit.language import Expr
from fsmkit.plan import Plan, Region
from fsmkit.plan.selection import Candidate, Candidates, Defer, Selection, is_sure


@dataclass(frozen=True, slots=True)
class Guard:
    """The text of a guard, and the variables that it needs: types and names."""

    text: str
    temporaries: tuple[tuple[str, str], ...]
    fails: bool
    reads_machine: bool


class SelectionPrinter:
    """Prints the functions that select."""

    def __init__(self, names: Names, content: ContentPrinter, functions: Unit) -> None:
        """Create a printer with these names; guards that are functions go to ``functions``."""
        self.functions = functions
        self._guards: dict[int, str] = {}
        self._texts: dict[tuple[int, tuple[int, ...]], Guard] | None = {}
        """By form and current events. Names that record their use are not cached."""
        self._reading: set[int] = set()
        """Transitions whose guards refer to the machine."""
        self._comments: dict[int, str] = {}
        self.names = names
        self.plan: Plan = names.plan
        self.chart = names.chart
        self.content = content
        self.own = names.own
        is_uniform = names.form is Form.TABLES
        self.decisions = Selection(self.plan, self.plan.variants, is_uniform)
        self.remembered = self.decisions.remembered
        self._memo_slots = {t: place for place, t in enumerate(self.remembered)}
        self._memo_functions: set[int] = set()
        self._interesting: frozenset[int] = frozenset()

    def under(self, names: Names) -> SelectionPrinter:
        """Return a printer with other names."""
        other = copy_of(self)
        other.names, other._guards, other._texts = names, {}, None  # noqa: SLF001  (its own)
        return other

    def is_memoized(self, transition: Transition) -> bool:
        """Whether a guard is evaluated only once although several states test it."""
        return transition.index in self._memo_slots

    # --- guards ---------------------------------------------------------------------------

    def memoized_guard(self, transition: Transition) -> str:
        """Return the condition of a guard that several states may test in one selection.

        Its value is kept in `m->fsm.asked` until the selection ends. Straight code tests a guard
        once and therefore uses `guard`.
        """
        place = self._memo_slots.get(transition.index)
        text = self.guard(transition)
        if place is None:
            return text
        name = f"{self.own}_ask_{transition.index}"
        if place not in self._memo_functions:
            self._memo_functions.add(place)
            out = self.functions
            out.define(name)
            out.line(f"static bool {name}({self.own} *m)")
            with out.block("{"):
                with out.block(f"if (m->fsm.asked[{place}] == 0u) {{"):
                    out.line(f"m->fsm.asked[{place}] = {text} ? 2u : 1u;")
                out.line(f"return m->fsm.asked[{place}] == 2u;")
            out.line()
        return f"{name}(m)"

    def guard(self, transition: Transition) -> str:
        """Return the condition of a guard; functions that it needs go to ``functions``."""
        if transition.index not in self._guards:
            self._guards[transition.index] = self._guard(self.functions, transition)
        return self._guards[transition.index]

    def _guard(self, out: Unit, transition: Transition) -> str:
        assert transition.guard is not None  # noqa: S101
        guard = self._text(transition.guard, transition.events)
        if guard.reads_machine or guard.temporaries or guard.fails:
            self._reading.add(transition.index)
        if not guard.temporaries and not guard.fails:
            return guard.text
        names = self.names
        name = f"{self.own}_guard_{transition.index}{'_of' if names.copy_parameter else ''}"
        out.define(name)
        out.line(f"static bool {name}({self.own} *m{names.copy_parameter})")
        with out.block("{"):
            for ctype, temporary in guard.temporaries:
                out.line(f"{ctype} {temporary};")
            out.line(f"bool holds = {guard.text};")
            if guard.fails:
                out.line(f"holds = {self.own}_guard_holds(m, holds);")
                self.names.used.add("guard_holds")
            out.line("return holds;")
        out.line()
        return f"{name}(m{names.copy_argument})"

    def _text(self, guard: Expr, events: tuple[int, ...]) -> Guard:
        """Print a guard; guards of equal form with equal current events share their text."""
        key = form(guard), events
        known = None if self._texts is None else self._texts.get(key)
        if known is not None:
            return known
        fails = can_fail(guard)
        printer = Printer(self.names, events, is_sound=not fails)
        text = printer.condition(guard)
        found = Guard(text, tuple(printer.temporaries), fails, printer.reads_machine)
        if self._texts is not None:
            self._texts[key] = found
        return found

    # --- by state -------------------------------------------------------------------------

    def finders(self, out: Unit, trigger: Trigger) -> list[str]:
        """Print the functions of one trigger; return for each state the call for it.

        Outer states come first, so that inner ones can go on with them.
        """
        is_event = trigger is Trigger.EVENT
        calls = {0: ""}
        chain = self.decisions.chain(trigger)
        for state, outer in chain.links:
            own = filter(self.decisions.may_preempt, self.decisions.transitions_of(state, trigger))
            name = f"{self.own}_{'state' if is_event else 'always'}_{state}"
            self._finder(out, name, state, list(own), trigger, calls[outer])
            calls[state] = f"{name}(m{', event' if is_event else ''})"
        return [calls[first] for first in chain.first]

    def _finder(
        self,
        out: Unit,
        name: str,
        state: int,
        own: list[Transition],
        trigger: Trigger,
        above: str,
    ) -> None:
        """Print the function of one state; ``above``: the call for its nearest ancestor."""
        guards = {t.index: self.memoized_guard(t) for t in own if t.guard is not None}
        is_event = trigger is Trigger.EVENT
        parameters = f"{self.own} *m{', uint16_t event' if is_event else ''}"
        head = f"static {self.names.taken_type} {name}({parameters})"
        out.define(name)
        out.line(f"{head} {self.names.note(state)}")
        with out.block("{"):
            if is_event:
                self._by_event(out, state, own, guards)
                if not above and not self.reads_machine(own):
                    out.line("(void)m;")
                out.line(f"return {above or '0u'};")
            else:
                is_closed = any(t.guard is None for t in own)
                if not (above and not is_closed) and not self.reads_machine(own):
                    out.line("(void)m;")
                self._in_order(out, own, guards)
                if not is_closed:
                    out.line(f"return {above or '0u'};")
        out.line()

    def reads_machine(self, transitions: Iterable[Transition]) -> bool:
        """Whether the printed guards refer to the machine."""
        return not self._reading.isdisjoint(t.index for t in transitions)

    def _in_order(self, out: Emitter, tried: Iterable[Candidate], guards: dict[int, str]) -> None:
        """Print candidates in order; only the last may be certain to be taken."""
        for candidate in tried:
            if isinstance(candidate, Defer):
                out.line(f"return {self.names.own_upper}_DEFER;")
                continue
            taken = f"return {candidate.index + 1}u; /* {self.comment(candidate)} */"
            if candidate.guard is None:
                out.line(taken)
                continue
            with out.block(f"if ({guards[candidate.index]}) {{"):
                out.line(taken)

    def _by_event(
        self, out: Emitter, state: int, own: list[Transition], guards: dict[int, str]
    ) -> None:
        wanted = self.decisions.preempting | self.decisions.deferred
        events = (*self.decisions.deferred_by(state), *(e for t in own for e in t.events))
        grouped: dict[tuple[int, ...], tuple[Candidates, list[int]]] = {}
        for event in dict.fromkeys(event for event in events if event in wanted):
            tried = self.decisions.candidates_of(state, event)
            key = tuple(-1 if isinstance(each, Defer) else each.index for each in tried)
            grouped.setdefault(key, (tried, []))[1].append(event)
        with out.block("switch (event) {"):
            for tried, alike in grouped.values():
                out.lines(f"case {self.names.events[event]}:" for event in alike)
                with out.indented():
                    self._in_order(out, tried, guards)
                    if not is_sure(tried[-1]):
                        out.line("break;")
            default(out)

    def comment(self, transition: Transition) -> str:
        """Return the location and the text of a transition."""
        known = self._comments.get(transition.index)
        if known is None:
            known = self._comments[transition.index] = self._comment(transition)
        return known

    def _comment(self, transition: Transition) -> str:
        states = self.chart.states
        targets = " ".join(states[t].id for t in transition.targets)
        arrow = f" -> {targets}" if targets else ""
        cause = " ".join(transition.descriptors)
        if transition.trigger in (Trigger.AFTER, Trigger.EVERY):
            cause = f"{transition.trigger.value} {transition.delay} ticks"
        on = f" on {cause}" if cause else ""
        text = f"{self.names.place(transition.span)}  " + states[transition.source].id + arrow + on
        return comment(text)

    # --- over regions ---------------------------------------------------------------------

    def over_regions(self, out: Unit, trigger: Trigger, calls: Sequence[str]) -> None:
        """Print the selection over the active atomic states, in document order."""
        is_event = trigger is Trigger.EVENT
        name = "select_event" if is_event else "select_eventless"
        more = ", uint16_t event" if is_event else ""
        if self.plan.is_single:
            region = self.plan.regions[0]
            out.define(name)
            out.line(f"static {self.names.taken_type} {self.own}_{name}({self.own} *m{more})")
            with out.block("{"):
                self._single(out, region, calls, is_event=is_event)
            out.line()
            return
        selection = f"{self.own}_selection *found"
        self._interesting = self._find_interesting(calls)
        for region in reversed(self.plan.regions):
            if region.index not in self._interesting:
                continue
            head = f"{self.own}_{name}_{region.index}({self.own} *m{more}, {selection})"
            out.define(f"{name}_{region.index}")
            out.line(f"static void {head}")
            with out.block("{"):
                self._collect(out, region, calls, name, is_event=is_event)
            out.line()

    def _find_interesting(self, calls: Sequence[str]) -> frozenset[int]:
        """Return the regions in which a transition can be selected, outer ones first."""
        found = {0}
        for region in reversed(self.plan.regions):
            if region.index in found or any(calls[state] for state in region.states):
                found.add(region.index)
                if region.owner is not None:
                    found.add(self.plan.region_of[region.owner])
        return frozenset(found)

    def _single(
        self, out: Emitter, region: Region, calls: Sequence[str], *, is_event: bool
    ) -> None:
        by_call: dict[str, list[int]] = {}
        for leaf in self.decisions.leaf_states(region):
            by_call.setdefault(calls[leaf], []).append(leaf)
        by_call.pop("", None)
        if not by_call:
            out.line("(void)m;")
            if is_event:
                out.line("(void)event;")
            out.line("return 0u;")
            return
        with out.block(f"switch (m->{self.names.regions[region.index]}) {{"):
            for call, leaves in by_call.items():
                for leaf in leaves:
                    out.line(f"case {self.names.number(leaf)}:")
                with out.indented():
                    out.line(f"return {call};")
            out.line("default:")
            with out.indented():
                out.line("return 0u;")

    def _collect(
        self, out: Emitter, region: Region, calls: Sequence[str], name: str, *, is_event: bool
    ) -> None:
        more = ", event" if is_event else ""
        printed = False
        with out.block(f"switch (m->{self.names.regions[region.index]}) {{"):
            for leaf in self.decisions.leaf_states(region):
                lines = []
                if self.chart.states[leaf].kind is Kind.PARALLEL:
                    lines = [
                        f"{self.own}_{name}_{inner.index}(m{more}, found);"
                        for inner in self.plan.inner[leaf]
                        if inner.index in self._interesting
                    ]
                elif calls[leaf]:
                    lines = [f"{self.own}_add(found, {calls[leaf]});"]
                if lines:
                    printed = True
                    out.line(f"case {self.names.number(leaf)}:")
                    with out.indented():
                        out.lines(lines)
                        out.line("break;")
            default(out)
        if not printed:
            out.line("(void)found;")
            if is_event:
                out.line("(void)event;")
        elif is_event and not any(calls):
            out.line("(void)event;")
