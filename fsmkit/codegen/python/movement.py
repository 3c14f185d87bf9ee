"""Leaving and entering states, and the content on the way."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from itertools import groupby
from typing import assert_never

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.chart import State, Transition
from fsmkit.chart.statements import Assign, CallOperation, Cancel, Log, Raise, Send
from fsmkit.codegen.python.clashes import print_clashes
from fsmkit.codegen.python.content import ContentPrinter
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.relations import describe
from fsmkit.codegen.python.selection import bit, bits, has_regions, mask
from fsmkit.document.document import Kind
from fsmkit.language import DurationType
from fsmkit.plan import Branch, Content, Enter, Op, Plan, Reaction, Restore, Within
from fsmkit.plan.entries import entry_by_default
from fsmkit.plan.exits import possible_below, recordable
from fsmkit.plan.features import payload_of
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    DropInvoke,
    EndInvoked,
    Finish,
    Forget,
    IfFinal,
    RaiseDone,
    Run,
    WantInvoke,
)
from fsmkit.plan.restoring import restored

FINAL = (RaiseDone, IfFinal, Finish)
"""Actions that follow the content of defaults."""
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
        if has_regions(self._chart) and any(len(each) > 1 for each in self._plan.reactions):
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
        return not self._plan.leaving[state.index]

    def leaving(self, state: State) -> None:
        """Print what is done when a state is left."""
        self._actions(self._plan.leaving[state.index])

    def _actions(self, actions: Iterable[Action]) -> None:
        """Print actions; blocks of content that follow each other as one."""
        for kind, group in groupby(actions, type):
            if kind is Run:
                blocks = tuple(each.block for each in group if isinstance(each, Run))
                self._content.blocks(self._out, blocks, None)
            else:
                for action in group:
                    self._action(action)

    def _action(self, action: Action) -> None:
        out, names = self._out, self._names
        match action:
            case Forget(history):
                out.line(f"{ME}_history_{names.bare[history]} = 0")
            case Arm(transition, delay):
                name = self._chart.transitions[transition].delay_name
                text = names.constant(name, delay, DurationType()) or delay
                out.line(f"{ME}_arm({names.timers[transition]}, {text})")
            case Disarm(transition):
                out.line(f"{ME}_disarm({names.timers[transition]})")
            case WantInvoke(state):
                out.line(f"{ME}_waiting |= {names.states[state]}")
            case DropInvoke(state):
                out.line(f"{ME}_waiting &= ~{names.states[state]}")
            case EndInvoked(invocation):
                out.line(f"{ME}_dismiss({invocation})")
            case Run(block):
                self._content.block(out, block, None)
            case Finish():
                out.line(f"{ME}_finish()")
            case RaiseDone(event, data):
                self._content.done(out, event, data)
            case IfFinal(_, finals, event) if all(finals):
                tests = (f"reached & {mask(names, each)}" for each in finals)
                out.line(f"reached = {ME}_active")
                with out.suite(f"if {' and '.join(tests)}:"):
                    self._action(event)
            case IfFinal():
                pass
            case _:
                assert_never(action)

    def entered(self, state: State) -> None:
        """Print what happens when a state is entered, if anything does."""
        defaults = self._plan.defaults[state.index]
        if self.is_entered_silently(state) and not defaults:
            return
        name = f"_entered_{self._names.bare[state.index]}"
        with self._out.method(name, "On entering " + state.id + ".", "defaults: int"):
            self.entering(state)
            for transition in defaults:
                with self._out.suite(f"if defaults & {bit(transition)}:"):
                    self.default(transition)
            self.final(state)

    def come(self, state: State, defaults: tuple[int, ...]) -> None:
        """Print what is done when a state is entered: there, or by a call if that is long."""
        if is_short(state.on_entry):
            self.entering(state)
            for default in defaults:
                self.default(default)
            self.final(state)
        else:
            passed = bits(sum(1 << d for d in defaults)) if defaults else "0"
            self._out.line(f"{ME}_entered_{self._names.bare[state.index]}({passed})")

    def is_entered_silently(self, state: State) -> bool:
        """Whether nothing but the configuration changes when a state is entered.

        Apart from the content of its defaults.
        """
        return not self._plan.entering[state.index] and state.kind is not Kind.FINAL

    def entering(self, state: State) -> None:
        """Print what is done when a state is entered, before its defaults."""
        self._actions(a for a in self._plan.entering[state.index] if not isinstance(a, FINAL))

    def final(self, state: State) -> None:
        """Print what entering a final state does besides (Appendix D, enterStates)."""
        self._actions(a for a in self._plan.entering[state.index] if isinstance(a, FINAL))

    def default(self, transition: int) -> None:
        """Print the content of the initial transition of a state, or of a default history."""
        self._out.took(transition)
        self._content.block(self._out, self._chart.transitions[transition].content, None)

    # --- transitions ------------------------------------------------------------------------

    def taken(self, transition: Transition) -> None:
        """Print what taking a transition does, in its three parts."""
        name, doc = self._names.transitions[transition.index], describe(self._chart, transition)
        reactions = self._plan.reactions[transition.index]
        if transition.targets:
            if len(reactions) > 1:
                doc_of_domain = "The domain, which a history decides."
                with self._out.method(f"_domain_{name}", doc_of_domain, result="int"):
                    self._each(reactions, lambda each: self._out.line(f"return {each.domain}"))
            with self._out.method(f"_leave_{name}", f"{doc}: leave."):
                self._each(reactions, self.leave)
        if transition.content:
            with self._out.method(f"_do_{name}", f"{doc}: content."):
                payload = payload_of(self._chart, transition)
                self._content.block(self._out, transition.content, payload)
        if transition.targets:
            with self._out.method(f"_enter_{name}", f"{doc}: enter."):
                self._each(reactions, lambda each: self.enter(each.enter))

    def _each(self, reactions: Sequence[Reaction], body: Callable[[Reaction], None]) -> None:
        """Print the first reaction whose conditions hold."""
        for place, reaction in enumerate(reactions):
            tests = " and ".join(self._within(condition) for condition in reaction.conditions)
            if len(reactions) == 1:
                body(reaction)
                continue
            word = "elif" if place else "if"
            with self._out.suite(f"{word} {tests}:" if tests else "else:"):
                body(reaction)

    def _within(self, condition: Within) -> str:
        held = f"{ME}_history_{self._names.bare[condition.history]}"
        if condition.first == 0:
            return f"not {held}"
        region, first, last = condition.region, condition.first, condition.last
        states = self._plan.numbers_within(region, first, last)
        inside = {s for state in states for s in (state, *self._plan.descendants(state))}
        return f"{held} & {mask(self._names, inside)}"

    def leave(self, reaction: Reaction) -> None:
        """Print how all is left that is active below a domain."""
        self.gone(reaction)
        self._out.line(f"{ME}_exit(gone)")

    def gone(self, reaction: Reaction) -> None:
        """Print what will be left, and how histories record it, before any state is left.

        That is SCXML 3.10.
        """
        below = possible_below(self._plan, reaction)
        self._out.line(f"gone = {ME}_active & {mask(self._names, below)}")
        for state in below:
            if not self._plan.histories[state]:
                continue
            with self._out.suite(f"if gone & {self._names.states[state]}:"):
                for history in self._plan.histories[state]:
                    kept = mask(self._names, recordable(self._plan, history))
                    self._out.line(f"{ME}_history_{self._names.bare[history]} = gone & {kept}")

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
                case Restore():
                    self._restore(op)
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
        if self._plan.is_forgotten(history):
            self._out.line(f"{self._held(history)} = {ME}_history_{self._names.bare[history]}")

    def _held(self, history: int) -> str:
        bare = self._names.bare[history]
        return f"held_{bare}" if self._plan.is_forgotten(history) else f"{ME}_history_{bare}"

    def _restore(self, restore: Restore) -> None:
        """Enter what a history recorded strictly below a state."""
        out, names, below = self._out, self._names, restore.below
        held = self._held(restore.history)
        if self._chart.states[restore.history].kind is Kind.DEEP_HISTORY:
            found = restored(self._plan, restore)
            always = f" | {mask(names, found.sure)}" if found.sure else ""
            out.line(f"coming = {held} & {mask(names, found.inside)}{always}")
            # and what lies between and the atomic states that were active
            for state, deeper in found.between:
                with out.suite(f"if {held} & {mask(names, deeper)}:"):
                    out.line(f"coming |= {names.states[state]}")
            if self.is_entered_by_method(below):
                out.line(f"{ME}_restore_{names.bare[below]}(coming)")
                out.line(f"{ME}_active |= coming")
            else:
                out.line(f"{ME}_enter(coming, 0)")
            return
        word = "if"
        for child in self._plan.substates[below]:
            with out.suite(f"{word} {held} & {names.states[child]}:"):
                self.enter(entry_by_default(self._chart, child))
            word = "elif"


def is_short(blocks: tuple[tuple[object, ...], ...]) -> bool:
    """Whether handlers are few simple statements."""
    statements = [statement for block in blocks for statement in block]
    kinds = (Assign, Raise, Send, Cancel, Log, CallOperation)
    return len(statements) <= SHORT and not any(
        can_fail(s) or not isinstance(s, kinds) or (isinstance(s, Send) and s.delay is not None)
        for s in statements
    )
