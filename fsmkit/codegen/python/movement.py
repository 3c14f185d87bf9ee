"""Leaving and entering states, and the content on the way."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from typing import assert_never

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.chart import State, Transition
from fsmkit.chart.statements import Assign, CallOperation, Cancel, Log, Raise, Send
from fsmkit.codegen.python.clashes import print_clashes
from fsmkit.codegen.python.content import ContentPrinter
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.relations import describe, is_dynamic, real_below, real_children
from fsmkit.codegen.python.selection import bit, bits, has_regions, mask
from fsmkit.document.document import Kind
from fsmkit.language import DurationType
from fsmkit.plan import Branch, Content, Enter, Move, Op, Plan, Restore, Variant, Within
from fsmkit.plan.entries import entry_by_default
from fsmkit.plan.features import payload_of

SHORT = 3
"""A handler of at most so many simple statements stands where it runs, not in a method."""


class Mover:
    """Prints what changes the configuration, state by state and transition by transition."""

    def __init__(self, out: Lines, plan: Plan, names: Names, content: ContentPrinter) -> None:
        self._out = out
        self._plan = plan
        self._chart = plan.chart
        self._names = names
        self._content = content
        self._timers: dict[int, list[Transition]] = {}
        for state in plan.chart.states:
            found = [plan.chart.transitions[index] for index in state.transitions]
            self._timers[state.index] = [t for t in found if t.has_timer]
        self.is_entered_by_method: Callable[[int], bool] = lambda _: False
        """Whether there is a method that enters what is to come inside of a state."""

    def states(self) -> None:
        """Print what `start` does, and what happens when states are left and entered."""
        self.begin()
        for state in self._chart.states[1:]:
            if not state.is_history:
                self.exited(state)
                self.entered(state)

    def transitions(self, wanted: Collection[int]) -> None:
        """Print what taking some transitions does, in parts."""
        for transition in self._chart.transitions:
            if transition.index in wanted:
                self.taken(transition)
        if has_regions(self._chart) and any(
            is_dynamic(self._plan, t) for t in self._chart.transitions
        ):
            print_clashes(self._out, self._plan, self._names)

    def begin(self) -> None:
        """Print what `start` does."""
        initial = self._chart.root.initial
        assert initial is not None  # noqa: S101
        entry = self._chart.transitions[initial]
        with self._out.method("_begin", "Run the script and enter the initial states."):
            self._content.block(self._out, self._chart.script, None)
            self._content.block(self._out, entry.content, None)
            self.enter(self._plan.start)

    # --- states -----------------------------------------------------------------------------

    def exited(self, state: State) -> None:
        """Print what happens when a state is left, if anything does."""
        if self.is_left_silently(state):
            return
        name = f"_exited_{self._names.bare[state.index]}"
        with self._out.method(name, "On leaving " + state.id + "."):
            self.leaving(state)

    def left(self, state: State) -> None:
        """Print what is done when a state is left: there, or by a call if that is long."""
        if is_short(state.on_exit):
            self.leaving(state)
        else:
            self._out.line(f"{ME}_exited_{self._names.bare[state.index]}()")

    def is_left_silently(self, state: State) -> bool:
        """Whether nothing but the configuration changes when a state is left."""
        is_invoking = state.invokes or any(i.state == state.index for i in self._chart.invocations)
        return not (self._timed(state) or any(state.on_exit) or is_invoking)

    def leaving(self, state: State) -> None:
        """Print what is done when a state is left."""
        for transition in self._timed(state):
            self._out.line(f"{ME}_disarm({self._names.timers[transition.index]})")
        self._content.blocks(self._out, tuple(block for block in state.on_exit if block), None)
        if state.invokes:
            self._out.line(f"{ME}_waiting &= ~{self._names.states[state.index]}")
        slots = [i.index for i in self._chart.invocations if i.state == state.index]
        self._out.lines(f"{ME}_dismiss({slot})" for slot in slots)

    def entered(self, state: State) -> None:
        """Print what happens when a state is entered, if anything does."""
        defaults = self._defaults(state)
        if self.is_entered_silently(state) and not defaults:
            return
        name = f"_entered_{self._names.bare[state.index]}"
        with self._out.method(name, "On entering " + state.id + ".", "defaults: int"):
            self.entering(state)
            for transition in defaults:
                with self._out.suite(f"if defaults & {bit(transition.index)}:"):
                    self.default(transition.index)
            if state.kind is Kind.FINAL:
                self.final(state)

    def come(self, state: State, defaults: tuple[int, ...]) -> None:
        """Print what is done when a state is entered: there, or by a call if that is long."""
        if is_short(state.on_entry):
            self.entering(state)
            for default in defaults:
                self.default(default)
            if state.kind is Kind.FINAL:
                self.final(state)
        else:
            passed = bits(sum(1 << d for d in defaults)) if defaults else "0"
            self._out.line(f"{ME}_entered_{self._names.bare[state.index]}({passed})")

    def is_entered_silently(self, state: State) -> bool:
        """Whether nothing but the configuration changes when a state is entered.

        Apart from the content of its defaults.
        """
        forgets = self._plan.forgotten[state.index]
        is_busy = self._timed(state) or any(state.on_entry) or state.invokes or forgets
        return not is_busy and state.kind is not Kind.FINAL

    def entering(self, state: State) -> None:
        """Print what is done when a state is entered, before its defaults."""
        for history in self._plan.forgotten[state.index]:
            self._out.line(f"{ME}_history_{self._names.bare[history]} = 0")
        for t in self._timed(state):
            delay = self._names.constant(t.delay_name, t.delay, DurationType()) or t.delay
            self._out.line(f"{ME}_arm({self._names.timers[t.index]}, {delay})")
        if state.invokes:
            self._out.line(f"{ME}_waiting |= {self._names.states[state.index]}")
        self._content.blocks(self._out, tuple(block for block in state.on_entry if block), None)

    def default(self, transition: int) -> None:
        """Print the content of the initial transition of a state, or of a default history."""
        self._out.took(transition)
        self._content.block(self._out, self._chart.transitions[transition].content, None)

    def _timed(self, state: State) -> list[Transition]:
        return self._timers[state.index]

    def _defaults(self, state: State) -> list[Transition]:
        """Return the initial transition and the defaults of the histories, those with content."""
        parts = [state, *(self._chart.states[c] for c in state.children)]
        numbers = [
            p.initial for p in parts if p.initial is not None and (p is state or p.is_history)
        ]
        found = [self._chart.transitions[number] for number in numbers]
        return [transition for transition in found if transition.content]

    def final(self, state: State) -> None:
        """Print what entering a final state does besides (Appendix D, enterStates)."""
        parent = state.parent
        if parent is None or parent == 0:
            self._out.line(f"{ME}_finish()")
            return
        self._done(parent, state)
        grandparent = self._chart.states[parent].parent
        if grandparent is not None and self._chart.states[grandparent].kind is Kind.PARALLEL:
            test = self._is_final(grandparent)
            if test is not None and self._event(grandparent) is not None:
                self._out.line(f"reached = {ME}_active")
                with self._out.suite(f"if {test}:"):
                    self._done(grandparent, None)

    def _event(self, state: int) -> int | None:
        return self._chart.event_index.get("done.state." + self._chart.states[state].id)

    def _done(self, state: int, final: State | None) -> None:
        """Raise ``done.state``, with the data of a final state (SCXML 5.5)."""
        event = self._event(state)
        if event is None:
            return
        self._content.done(self._out, event, final)

    def _is_final(self, state: int) -> str | None:
        """Return isInFinalState as text (Appendix D), None where it never is."""
        children = real_children(self._chart, state)
        match self._chart.states[state].kind:
            case Kind.COMPOUND:
                finals = [c for c in children if self._chart.states[c].kind is Kind.FINAL]
                return f"reached & {mask(self._names, finals)}" if finals else None
            case Kind.PARALLEL:
                tests = [self._is_final(child) for child in children]
                if None in tests:
                    return None
                return " and ".join(filter(None, tests))
            case _:
                return None

    # --- transitions ------------------------------------------------------------------------

    def taken(self, transition: Transition) -> None:
        """Print what taking a transition does, in its three parts."""
        name, doc = self._names.transitions[transition.index], describe(self._chart, transition)
        move = self._plan.moves[transition.index]
        if transition.targets:
            if not move.is_static:
                self._domain(move)
            with self._out.method(f"_leave_{name}", f"{doc}: leave."):
                self._each_variant(move, partial(self._leave, transition.source))
        if transition.content:
            with self._out.method(f"_do_{name}", f"{doc}: content."):
                payload = payload_of(self._chart, transition)
                self._content.block(self._out, transition.content, payload)
        if transition.targets:
            with self._out.method(f"_enter_{name}", f"{doc}: enter."):
                self._each_variant(move, lambda variant: self.enter(variant.entry))

    def _domain(self, move: Move) -> None:
        name = self._names.transitions[move.transition]
        doc = "The domain, which a history decides."
        with self._out.method(f"_domain_{name}", doc, result="int"):
            self._each_variant(move, lambda variant: self._out.line(f"return {variant.domain}"))

    def _each_variant(self, move: Move, body: Callable[[Variant], None]) -> None:
        """Print the first variant whose conditions hold."""
        for place, variant in enumerate(move.variants):
            tests = " and ".join(self._within(condition) for condition in variant.conditions)
            if move.is_static:
                body(variant)
                continue
            word = "elif" if place else "if"
            with self._out.suite(f"{word} {tests}:" if tests else "else:"):
                body(variant)

    def _within(self, condition: Within) -> str:
        held = f"{ME}_history_{self._names.bare[condition.history]}"
        if condition.first == 0:
            return f"not {held}"
        own = self._plan.regions[condition.region].states
        states = [state for state in own if condition.first <= state <= condition.last]
        inside = {s for state in states for s in (state, *real_below(self._chart, state))}
        return f"{held} & {mask(self._names, inside)}"

    def _leave(self, source: int, variant: Variant) -> None:
        if variant.domain is not None:
            self.leave(source, variant.domain)

    def leave(self, source: int, domain: int) -> None:
        """Print how all is left that is active below a domain, while a state below it is."""
        self.gone(source, domain)
        self._out.line(f"{ME}_exit(gone)")

    def gone(self, source: int, domain: int) -> None:
        """Print what will be left, and how histories record it."""
        below = self._active_with(source, domain)
        self._out.line(f"gone = {ME}_active & {mask(self._names, below)}")
        self._record(below)

    def _active_with(self, source: int, domain: int) -> list[int]:
        """Return the states below a domain that can be active while one of them is.

        Those on its path, those in other regions, and all below it.
        """
        chart = self._chart
        found, at = [*real_below(chart, source)], source
        while at != domain:
            found.append(at)
            parent = chart.states[at].parent or 0
            if chart.states[parent].kind is Kind.PARALLEL:
                for child in set(real_children(chart, parent)) - {at}:
                    found += (child, *real_below(chart, child))
            at = parent
        return sorted(found)

    def _record(self, gone: list[int]) -> None:
        """Record the histories of all states that are left, before any of them is (SCXML 3.10)."""
        states = self._chart.states
        for state in gone:
            histories = [child for child in states[state].children if states[child].is_history]
            if not histories:
                continue
            with self._out.suite(f"if gone & {self._names.states[state]}:"):
                for history in histories:
                    kept = real_children(self._chart, state)
                    if states[history].kind is Kind.DEEP_HISTORY:
                        below = real_below(self._chart, state)
                        kept = tuple(s for s in below if states[s].is_leaf)
                    held = f"{ME}_history_{self._names.bare[history]}"
                    self._out.line(f"{held} = gone & {mask(self._names, kept)}")

    def enter(self, ops: tuple[Op, ...]) -> None:
        """Print operations of the plan, entries that follow each other as one."""
        coming: list[Enter] = []
        for op in ops:
            if isinstance(op, Enter):
                coming.append(op)
                continue
            self._enter_all(coming)
            match op:
                case Branch(history, recorded, unrecorded):
                    self._ask(history)
                    with self._out.suite(f"if {self._held(history)}:"):
                        self.enter(recorded)
                    with self._out.suite("else:"):
                        self.enter(unrecorded)
                case Restore(history, below):
                    self._restore(history, below)
                case Content(transition):
                    self.default(transition)
                case _:
                    assert_never(op)
        self._enter_all(coming)

    def _enter_all(self, coming: list[Enter]) -> None:
        if coming:
            states = mask(self._names, [op.state for op in coming])
            defaults = sum(1 << number for op in coming for number in op.defaults)
            self._out.line(f"{ME}_enter({states}, {bits(defaults) if defaults else 0})")
            coming.clear()

    def _ask(self, history: int) -> None:
        """Keep what a history holds, if entering its parent makes it forget that."""
        if self._is_forgotten(history):
            self._out.line(f"{self._held(history)} = {ME}_history_{self._names.bare[history]}")

    def _held(self, history: int) -> str:
        bare = self._names.bare[history]
        return f"held_{bare}" if self._is_forgotten(history) else f"{ME}_history_{bare}"

    def _is_forgotten(self, history: int) -> bool:
        return history in self._plan.forgotten[self._chart.states[history].parent or 0]

    def _restore(self, history: int, below: int) -> None:
        """Enter what a history recorded strictly below a state."""
        held = self._held(history)
        if self._chart.states[history].kind is Kind.DEEP_HISTORY:
            inside = real_below(self._chart, below)
            sure = self._sure(history, below)
            always = f" | {mask(self._names, sure)}" if sure else ""
            self._out.line(f"coming = {held} & {mask(self._names, inside)}{always}")
            # and what lies between and the atomic states that were active
            for state in inside:
                deeper = real_below(self._chart, state)
                if deeper and state not in sure:
                    with self._out.suite(f"if {held} & {mask(self._names, deeper)}:"):
                        self._out.line(f"coming |= {self._names.states[state]}")
            if self.is_entered_by_method(below):
                self._out.line(f"{ME}_restore_{self._names.bare[below]}(coming)")
                self._out.line(f"{ME}_active |= coming")
            else:
                self._out.line(f"{ME}_enter(coming, 0)")
            return
        word = "if"
        for child in real_children(self._chart, below):
            with self._out.suite(f"{word} {held} & {self._names.states[child]}:"):
                self.enter(entry_by_default(self._chart, child))
            word = "elif"

    def _sure(self, history: int, below: int) -> set[int]:
        """Return the composite regions that were active if anything was recorded."""
        chart = self._chart
        if chart.states[history].parent != below:
            return set()
        found, todo = set(), [below]
        while todo:
            state = todo.pop()
            if chart.states[state].kind is Kind.PARALLEL:
                regions = real_children(chart, state)
                found |= {region for region in regions if real_below(chart, region)}
                todo += regions
        return found


def is_short(blocks: tuple[tuple[object, ...], ...]) -> bool:
    """Whether handlers are few simple statements."""
    statements = [statement for block in blocks for statement in block]
    kinds = (Assign, Raise, Send, Cancel, Log, CallOperation)
    return len(statements) <= SHORT and not any(
        can_fail(s) or not isinstance(s, kinds) or (isinstance(s, Send) and s.delay is not None)
        for s in statements
    )
