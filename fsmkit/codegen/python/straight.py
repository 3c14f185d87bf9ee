"""Reactions to an event as straight code: selection and the whole step in one method.

If an event takes at most one transition, the states are tested from the inside out. The exits,
content and entries of the first enabled transition are printed inline. If transitions in several
regions can be taken, sets of them are selected instead (`selection`).
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass, field

from fsmkit.chart.analysis.effects import observes
from fsmkit.chart.chart import Chart, Transition
from fsmkit.codegen.python.content import ContentPrinter
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import LINK, ME
from fsmkit.codegen.python.movement import Mover
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.places import UNKNOWN, Place
from fsmkit.codegen.python.regions import independent
from fsmkit.codegen.python.relations import LONG, configuration, describe
from fsmkit.codegen.python.selection import (
    bits,
    guard_text,
    has_regions,
    is_needing_memo,
    print_selection,
)
from fsmkit.codegen.python.trees import Trees
from fsmkit.document.document import Kind, Trigger
from fsmkit.emit.python import docstring, quoted
from fsmkit.plan import Content, Enter, Plan, Reaction
from fsmkit.plan.features import payload_of
from fsmkit.plan.operations import Leave
from fsmkit.plan.selection import Candidates, Defer, Groups, Selection

FEW = 8
"""The greatest number of atomic states that are tested one by one; more are in a table."""


@dataclass
class Straight:
    """Prints the event methods; collects the transitions that need methods of their own."""

    out: Lines
    plan: Plan
    names: Names
    content: ContentPrinter
    mover: Mover
    trees: Trees
    selection: Selection
    is_ordered: bool
    """Whether the order of the effects of regions is observable."""
    apart: set[int] = field(default_factory=set)
    """Transitions that `_microstep` takes in phases."""
    answered: set[int] = field(default_factory=set)
    """Events that the chart handles."""
    shared: set[int] = field(default_factory=set)
    """Transitions in a method of their own, because several events take them."""

    is_local: bool = False
    """Whether the configuration is kept in ``active`` until the end of a method."""
    may_fault: bool = False
    """Whether an earlier guard of the current method can put the machine into a fault."""

    def __post_init__(self) -> None:
        """Collect the transitions that no event takes."""
        kinds = (Trigger.EVENTLESS, Trigger.AFTER, Trigger.EVERY)
        self.apart |= {t.index for t in self.chart.transitions if t.trigger in kinds}
        self.is_single = not has_regions(self.chart)
        self.mover.is_entered_by_method = self.trees.enter

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.plan.chart

    def events(self) -> None:
        """Print a method for each handled event."""
        for event in self.chart.events:
            self._event(event.index)
        for index in sorted(self.shared):
            transition = self.chart.transitions[index]
            name = f"_take_{self.names.transitions[index]}"
            with self.out.method(name, describe(self.chart, transition) + "."):
                if not self.is_single:
                    self.out.line(f"active = {ME}_active")
                self._take(transition)

    def _event(self, event: int) -> None:
        groups = self.selection.by_state(event)
        if not groups:
            return
        self.answered.add(event)
        name, told = self.names.events[event], self.chart.events[event].name
        doc = "Take what `" + told + "` enables; whether that is anything."
        kept = self.selection.answers_instead(event)
        if kept or not self.selection.is_one_answer([states[0] for states, _ in groups]):
            may_be_kept = event in self.selection.deferred
            is_apart = not (self.is_ordered or may_be_kept)
            regions = independent(self.plan, groups) if is_apart else None
            if regions is not None:
                with self.out.method(f"_on_{name}", doc, result="bool"):
                    self._regions(regions)
                return
            steps = (step for _, tried in groups for step in tried)
            self.apart |= {step.index for step in steps if isinstance(step, Transition)}
            print_selection(self.out, self.names, self.selection, f"_select_{name}", event)
            with self.out.method(f"_on_{name}", doc, result="bool"):
                self.out.line(f"chosen = {ME}_select_{name}()")
                for state, answers in kept:
                    found = bits(sum(1 << answer for answer in answers))
                    is_active = f"{ME}_active & {self.names.states[state]}"
                    with self.out.suite(f"if {is_active} and not {ME}_seen & {found}:"):
                        self.out.line(f"{ME}_is_deferred = True")
                if may_be_kept:
                    with self.out.suite(f"if {ME}_is_deferred:"):
                        self.out.line("return False")
                with self.out.suite(f"if chosen and {ME}_fault is None:"):
                    self.out.line(f"{ME}_microstep(chosen)")
                self.out.line("return chosen != 0")
            return
        self.may_fault = False
        leaves = [group for group in groups if self.chart.states[group[0][0]].is_leaf]
        is_deferring = any(isinstance(step, Defer) for _, tried in leaves for step in tried)
        is_split = self.is_single and len(leaves) > FEW and not is_deferring
        with self.out.method(f"_on_{name}", doc, result="bool"):
            if is_split:
                self.out.line(f"step = {ME}_FROM_{name}.get({ME}_active)")
                with self.out.suite("if step is not None and step(self):"):
                    self.out.line("return True")
                groups = [group for group in groups if not self.chart.states[group[0][0]].is_leaf]
            if groups:
                self.out.line(f"active = {ME}_active")
            self._print_state_tests(groups)
            self.out.line("return False")
        if is_split:
            self._print_leaf_table(event, leaves)

    def _print_state_tests(self, groups: Groups) -> None:
        """Print the tests of states one by one."""
        asked = {states[0] for states, _ in groups}
        for test, ((state,), steps) in zip(self._tests(groups), groups, strict=True):
            with self.out.suite(f"if {test}:"):
                is_sure = self._steps(steps)
                if not is_sure and asked.isdisjoint(self.plan.chains[state][1:]):
                    self.out.line("return False")

    def _print_leaf_table(self, event: int, leaves: Groups) -> None:
        """Print a method for each atomic state that handles an event, and their table."""
        name, told = self.names.events[event], self.chart.events[event].name
        entries = []
        for (state,), steps in leaves:
            method = f"_in_{state}_{self.names.bare[state]}_on_{name}"
            doc = "Take what `" + told + "` enables in " + self.chart.states[state].id + "."
            with self.out.method(method, doc, result="bool"):
                if not self._steps(steps):
                    self.out.line("return False")
            entries.append(f"{configuration(self.names, state)}: {LINK}{method},")
        self.out.piece(f"_FROM_{name}")
        self.out.line()
        with self.out.block(f"_FROM_{name}: ClassVar[dict[int, Callable[[Any], bool]]] = {{"):
            self.out.lines(entries)

    def _regions(self, regions: list[Groups]) -> None:
        """Print regions that are independent of each other, one after the other."""
        self.is_local = True
        self.out.line(f"active = {ME}_active")
        self.out.line("is_taken = False")
        for groups in regions:
            word = "if"
            for test, (_, steps) in zip(self._tests(groups), groups, strict=True):
                with self.out.suite(f"{word} {test}:"):
                    self._print_choice(steps)
                word = "elif"
        self.out.line(f"{ME}_active = active")
        self.out.line("return is_taken")
        self.is_local = False

    def _print_choice(self, steps: Candidates) -> None:
        """Print the selection among a state's transitions, each with its effects."""
        word = "if"
        for step in steps:
            assert isinstance(step, Transition)  # noqa: S101  (nothing is deferred)
            opening = f"{word} {guard_text(self.chart, self.names, step)}:"
            if step.guard is None:
                opening = "" if word == "if" else "else:"
            with self.out.suite(opening) if opening else nullcontext():
                self.out.line(f"# {docstring(describe(self.chart, step))}")
                self._take(step)
                self.out.line("is_taken = True")
            word = "elif"

    def _tests(self, groups: Groups) -> list[str]:
        """Return the tests whether states are active; a comparison costs less than a mask."""
        states = [states[0] for states, _ in groups]
        are_leaves = [self.chart.states[state].is_leaf for state in states]
        constants = [self.names.states[state] for state in states]
        if self.is_single:
            return [
                f"active == {configuration(self.names, state)}" if is_leaf else f"active & {bit}"
                for state, is_leaf, bit in zip(states, are_leaves, constants, strict=True)
            ]
        regions = {self.plan.region_of[state] for state in states}
        if len(states) > 1 and len(regions) == 1 and all(are_leaves):
            self.out.line(f"leaf = active & {bits(sum(1 << state for state in states))}")
            return [f"leaf == {constant}" for constant in constants]
        return [f"active & {constant}" for constant in constants]

    def _steps(self, steps: Candidates) -> bool:
        """Print the candidates of a state; return whether one of them is always taken."""
        for step in steps:
            if isinstance(step, Defer):
                self.out.line(f"{ME}_is_deferred = True")
                self.out.line("return False")
                return True
            if step.guard is None:
                self._taken(step)
                return True
            self.may_fault |= is_needing_memo(self.chart, step)
            with self.out.suite(f"if {guard_text(self.chart, self.names, step)}:"):
                self._taken(step)
        return False

    def _taken(self, transition: Transition) -> None:
        if self.may_fault:
            with self.out.suite(f"if {ME}_fault is not None:"):
                self.out.line("return True")
        if len(transition.events) > 1:
            self.shared.add(transition.index)
            self.out.line(f"{ME}_take_{self.names.transitions[transition.index]}()")
        else:
            self.out.line(f"# {docstring(describe(self.chart, transition))}")
            self._take(transition)
        self.out.line("return True")

    # --- one transition -----------------------------------------------------------------------

    def _take(self, transition: Transition) -> None:
        """Print the effects of a transition (Appendix D, microstep)."""
        payload = payload_of(self.chart, transition)
        if not transition.targets:
            self.out.print_taken(transition.index)
            self.content.block(self.out, transition.content, payload)
            return
        reaction, *others = self.plan.reactions[transition.index]
        if others:
            self._in_parts(transition)
            return
        place, known = self._leave(transition.source, reaction)
        self.out.print_taken(transition.index)
        if observes(transition.content) and known != place:
            known = self._store(place)
        self.content.block(self.out, transition.content, payload)
        is_listed = len(reaction.enter) <= LONG
        if is_listed and all(isinstance(op, Enter | Content) for op in reaction.enter):
            for op in reaction.enter:
                if isinstance(op, Content):
                    self.mover.default(op.transition)
                elif isinstance(op, Enter):
                    place, known = self._enter(op, place, known)
            if known != place:
                self._store(place)
            return
        if known != place:
            self._store(place)
        self.mover.enter(reaction.enter)

    def _in_parts(self, transition: Transition) -> None:
        """Print calls of the phases of a transition whose domain depends on a history."""
        self.apart.add(transition.index)
        name = self.names.transitions[transition.index]
        self.out.line(f"{ME}_leave_{name}()")
        self.out.print_taken(transition.index)
        if transition.content:
            self.out.line(f"{ME}_do_{name}()")
        self.out.line(f"{ME}_enter_{name}()")

    def _leave(self, source: int, reaction: Reaction) -> tuple[Place, Place]:
        """Print the exits; return the resulting configuration and the stored one."""
        if not reaction.is_listed:
            return self._leave_all(reaction)
        place = known = self._known(source) or Place(None)
        for record in reaction.record:
            assert record.kept is not None  # noqa: S101  (the exit set is known)
            held = f"{ME}_history_{self.names.bare[record.history]}"
            self.out.line(f"{held} = {self.names.states[record.kept]}")
        for op in reaction.leave:
            assert isinstance(op, Leave)  # noqa: S101
            state = self.chart.states[op.state]
            self.out.print_trace(quoted("- " + state.id))
            if observes(state.on_exit) and known != place:
                known = self._store(place)
            self.mover.print_exit(state)
            place = place.without(op.state)
        return place, known

    def _leave_all(self, reaction: Reaction) -> tuple[Place, Place]:
        """Print the exit of all active states below a domain; return as `_leave` does."""
        domain, top = reaction.domain, reaction.top
        assert domain is not None  # noqa: S101  (something is left)
        assert top is not None  # noqa: S101
        done = self._known(domain) or Place(None)
        if top != domain and self.trees.can_leave(top):
            self.mover.print_exit_set(reaction)
            self.out.line(f"{ME}_exit_{self.names.bare[top]}(gone)")
            self.trees.requested.add(top)
            if done.base is None:
                self.out.line(f"active = {ME}_active ^ gone")
            return done, UNKNOWN
        self.mover.leave(reaction)
        if done.base is None:
            self.out.line(f"active = {ME}_active")
        return done, done

    def _known(self, state: int) -> Place | None:
        """Return the configuration with a state as the innermost, if it is unique."""
        if self.plan.region_of[state] or self.chart.states[state].kind is Kind.PARALLEL:
            return None
        return Place(sum(1 << s for s in (0, *self.plan.chains[state])))

    def _enter(self, op: Enter, place: Place, known: Place) -> tuple[Place, Place]:
        """Print the entry of a state; return the configuration then, and the stored one."""
        state = self.chart.states[op.state]
        place = place.with_(state.index)
        self.out.print_entered(state.index, quoted("+ " + state.id))
        contents = [self.chart.transitions[d].content for d in op.defaults]
        is_final = state.kind is Kind.FINAL
        if (is_final or observes(state.on_entry) or any(map(observes, contents))) and (
            known != place
        ):
            known = self._store(place)
        self.mover.print_entry(state, op.defaults)
        return place, known

    def _store(self, place: Place) -> Place:
        if self.is_local:
            self.out.line(f"active ^= {bits(place.changed)}")
        else:
            self.out.line(f"{ME}_active = {self._spell(place)}")
        return place

    def _spell(self, place: Place) -> str:
        if place.base is None:
            return f"active ^ {bits(place.changed)}" if place.changed else "active"
        deepest = place.base.bit_length() - 1
        if self.is_single and self._known(deepest) == place:
            return configuration(self.names, deepest)
        return bits(place.base)
