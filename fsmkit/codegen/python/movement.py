"""Exiting and entering states, and the content between."""

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
"""The greatest number of simple statements in a handler that is printed inline."""


class Mover:
    """Prints the changes of the configuration, by state and by transition."""

    def __init__(self, out: Lines, plan: Plan, names: Names, content: ContentPrinter) -> None:
        self._out = out
        self._plan = plan
        self._chart = plan.chart
        self._names = names
        self._content = content
        self.is_entered_by_method: Callable[[int], bool] = lambda _: False
        """States with a method that enters their requested descendants."""

    def states(self) -> None:
        """Print `start`, and the methods that exit and enter states."""
        self.print_start()
        for state in self._chart.states[1:]:
            if not state.is_history:
                self.print_exit_method(state)
                self.print_entry_method(state)

    def transitions(self, indices: Collection[int]) -> None:
        """Print the methods of taking transitions, in phases."""
        for transition in self._chart.transitions:
            if transition.index in indices:
                self.print_transition(transition)
        if has_regions(self._chart) and any(len(each) > 1 for each in self._plan.reactions):
            print_clashes(self._out, self._plan, self._names)

    def print_start(self) -> None:
        """Print the method `start`."""
        initial = self._chart.root.initial
        assert initial is not None  # noqa: S101
        entry = self._chart.transitions[initial]
        with self._out.method("_begin", "Run the script and enter the initial states."):
            self._content.block(self._out, self._chart.script, None)
            self._content.block(self._out, entry.content, None)
            self.enter(self._plan.start)

    # --- states -----------------------------------------------------------------------------

    def print_exit_method(self, state: State) -> None:
        """Print the exit method of a state, if it has any effect."""
        if self.is_left_silently(state):
            return
        name = f"_exited_{self._names.bare[state.index]}"
        with self._out.method(name, "On leaving " + state.id + "."):
            self._exit_statements(state)

    def print_exit(self, state: State) -> None:
        """Print the exit of a state: its statements, or a call if they are many."""
        if is_short(state.on_exit):
            self._exit_statements(state)
        else:
            self._out.line(f"{ME}_exited_{self._names.bare[state.index]}()")

    def is_left_silently(self, state: State) -> bool:
        """Whether exiting a state changes nothing but the configuration."""
        return not self._plan.leaving[state.index]

    def _exit_statements(self, state: State) -> None:
        """Print the statements of exiting a state."""
        self._actions(self._plan.leaving[state.index])

    def _actions(self, actions: Iterable[Action]) -> None:
        """Print actions; consecutive blocks of content become one."""
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

    def print_entry_method(self, state: State) -> None:
        """Print the entry method of a state, if it has any effect."""
        defaults = self._plan.defaults[state.index]
        if self.is_entered_silently(state) and not defaults:
            return
        name = f"_entered_{self._names.bare[state.index]}"
        with self._out.method(name, "On entering " + state.id + ".", "defaults: int"):
            self._entry_statements(state)
            for transition in defaults:
                with self._out.suite(f"if defaults & {bit(transition)}:"):
                    self.default(transition)
            self.final(state)

    def print_entry(self, state: State, defaults: tuple[int, ...]) -> None:
        """Print the entry of a state: its statements, or a call if they are many."""
        if is_short(state.on_entry):
            self._entry_statements(state)
            for default in defaults:
                self.default(default)
            self.final(state)
        else:
            passed = bits(sum(1 << d for d in defaults)) if defaults else "0"
            self._out.line(f"{ME}_entered_{self._names.bare[state.index]}({passed})")

    def is_entered_silently(self, state: State) -> bool:
        """Whether entering a state changes nothing but the configuration.

        The content of its defaults does not count.
        """
        return not self._plan.entering[state.index] and state.kind is not Kind.FINAL

    def _entry_statements(self, state: State) -> None:
        """Print the statements of entering a state, before its defaults."""
        self._actions(a for a in self._plan.entering[state.index] if not isinstance(a, FINAL))

    def final(self, state: State) -> None:
        """Print the additional effects of entering a final state (Appendix D, enterStates)."""
        self._actions(a for a in self._plan.entering[state.index] if isinstance(a, FINAL))

    def default(self, transition: int) -> None:
        """Print the content of an initial transition, or of a history's default transition."""
        self._out.print_taken(transition)
        self._content.block(self._out, self._chart.transitions[transition].content, None)

    # --- transitions ------------------------------------------------------------------------

    def print_transition(self, transition: Transition) -> None:
        """Print the methods of taking a transition, for its three phases."""
        name, doc = self._names.transitions[transition.index], describe(self._chart, transition)
        reactions = self._plan.reactions[transition.index]
        if transition.targets:
            if len(reactions) > 1:
                doc_of_domain = "The domain, which a history decides."
                with self._out.method(f"_domain_{name}", doc_of_domain, result="int"):
                    self._print_first(
                        reactions, lambda each: self._out.line(f"return {each.domain}")
                    )
            with self._out.method(f"_leave_{name}", f"{doc}: leave."):
                self._print_first(reactions, self.leave)
        if transition.content:
            with self._out.method(f"_do_{name}", f"{doc}: content."):
                payload = payload_of(self._chart, transition)
                self._content.block(self._out, transition.content, payload)
        if transition.targets:
            with self._out.method(f"_enter_{name}", f"{doc}: enter."):
                self._print_first(reactions, lambda each: self.enter(each.enter))

    def _print_first(self, reactions: Sequence[Reaction], body: Callable[[Reaction], None]) -> None:
        """Print a body for each reaction, of which the first with true conditions runs."""
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
        """Print the exit of all active states below a domain."""
        self.print_exit_set(reaction)
        self._out.line(f"{ME}_exit(gone)")

    def print_exit_set(self, reaction: Reaction) -> None:
        """Print the exit set and the recording of histories, before any state is exited.

        See SCXML 3.10.
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
        """Print operations of the Plan; consecutive entries become one."""
        coming: list[Enter] = []
        for op in ops:
            if isinstance(op, Enter):
                coming.append(op)
                continue
            self._enter_all(coming)
            match op:
                case Branch(history, recorded, unrecorded):
                    self._print_held(history)
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

    def _print_held(self, history: int) -> None:
        """Print a local copy of a history's record, if entering its parent clears it."""
        if self._plan.is_forgotten(history):
            self._out.line(f"{self._held(history)} = {ME}_history_{self._names.bare[history]}")

    def _held(self, history: int) -> str:
        bare = self._names.bare[history]
        return f"held_{bare}" if self._plan.is_forgotten(history) else f"{ME}_history_{bare}"

    def _restore(self, restore: Restore) -> None:
        """Print the entry of the states that a history recorded strictly below a state."""
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
    """Whether handlers consist of few simple statements."""
    statements = [statement for block in blocks for statement in block]
    kinds = (Assign, Raise, Send, Cancel, Log, CallOperation)
    return len(statements) <= SHORT and not any(
        can_fail(s) or not isinstance(s, kinds) or (isinstance(s, Send) and s.delay is not None)
        for s in statements
    )
