"""The program of a Plan against the interpreter: what each step selects, leaves, does and enters.

The interpreter runs random scripts on random charts. Each selection and each microstep of it is
predicted by the Plan alone, from the configuration, the histories and the values of guards.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.loading import load
from fsmkit.document.document import Trigger
from fsmkit.plan import Branch, Content, Enter, Plan, Reaction, Restore, lower
from fsmkit.plan.exits import possible_below, recordable, recording_domains
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    DropInvoke,
    EndInvoked,
    Finish,
    Forget,
    IfFinal,
    Leave,
    LeaveBelow,
    LeaveRegion,
    Op,
    RaiseDone,
    Resume,
    Run,
    WantInvoke,
)
from fsmkit.plan.restoring import restored
from fsmkit.plan.selection import Concurrency, Defer
from fsmkit.runtime.interpreter import entry_exit, macrostep, timers
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.selection import atomic_states
from fsmkit.runtime.interpreter.structure import get_transition_domain
from fsmkit.runtime.script import run_script

CHARTS, SEED = 60, 23
Step = Callable[..., tuple[int, ...]]
Log = list[tuple[object, ...]]
History = dict[int, frozenset[int]]


PLANS: dict[int, Plan] = {}


def lowered(chart: Chart) -> Plan:
    if id(chart) not in PLANS:
        PLANS[id(chart)] = lower(chart)
    return PLANS[id(chart)]


@dataclass
class Machine:
    """The run-time state of a machine that executes its Plan."""

    plan: Plan
    active: set[int]
    held: History
    """The records of histories at the start of the step, which decide the entries."""
    history: History
    invoking: set[int]
    seen: Counter[str]
    log: Log = field(default_factory=list)

    def number(self, history: int, region: int) -> int:
        """Return what a history recorded in a region, as its deepest state; 0 for nothing."""
        kept = self.held.get(history, frozenset())
        inside = {s for state in kept for s in self.plan.chains[state]}
        return max((s for s in inside if self.plan.region_of[s] == region), default=0)

    def is_recorded(self, history: int) -> bool:
        return self.number(history, self.plan.recorded_regions[history][0]) != 0

    def reaction(self, transition: Transition) -> Reaction:
        return next(
            reaction
            for reaction in self.plan.reactions[transition.index]
            if all(
                each.first <= self.number(each.history, each.region) <= each.last
                for each in reaction.conditions
            )
        )

    # --- leaving ------------------------------------------------------------------------------

    def below(self, region: int, until: int) -> Iterator[int]:
        """Yield what is left of a region, innermost first, as generated code does it."""
        inside = [s for s in self.active if self.plan.region_of[s] == region]
        at = max(inside, default=0)
        while at > until:
            for inner in reversed(self.plan.inner[at]):
                yield from self.below(inner.index, 0)
            yield at
            at = self.plan.region_parents[at]

    def left(self, reaction: Reaction) -> list[int]:
        found: list[int] = []
        assert reaction.top in (None, reaction.domain, *self.active)
        for op in reaction.leave:
            self.seen[type(op).__name__] += 1
            match op:
                case Leave(state):
                    found.append(state)
                case LeaveRegion(region):
                    found += self.below(region, 0)
                case _:
                    assert reaction.domain is not None
                    found += self.below(self.plan.region_of[reaction.domain], reaction.domain)
        return found

    def record(self, reaction: Reaction) -> History:
        """Return what the reaction records, from what is active."""
        found: History = {}
        for record in reaction.record:
            self.seen["sure record" if record.is_sure else "record"] += 1
            assert not record.is_sure or record.state in self.active
            if record.state in self.active:
                found[record.history] = self.kept(record.history)
                assert record.kept is None or found[record.history] == {record.kept}
                self.seen["kept"] += record.kept is not None
                assert reaction.domain in recording_domains(self.plan, record.history)
        return found

    def kept(self, history: int) -> frozenset[int]:
        """Return what a history records, by its parts and as a set, which say the same."""
        whole = self.active.intersection(recordable(self.plan, history))
        for part in self.plan.kept[history]:
            number = max(s for s in self.active if self.plan.region_of[s] == part.region)
            if part.states is None:
                inside = {s for s in whole if part.region == self.plan.region_of[s]}
                is_leaf = self.plan.chart.states[number].is_leaf
                assert inside == ({number} if is_leaf else set())
            else:
                assert max(s for s in part.states if s <= number) in whole
        return frozenset(whole)

    # --- entering -----------------------------------------------------------------------------

    def ops(self, ops: Iterable[Op | Resume]) -> None:
        for op in ops:
            self.seen[type(op).__name__] += 1
            match op:
                case Enter(state, defaults):
                    self.active.add(state)
                    self.log.append(("enter", state))
                    final = [a for a in self.plan.entering[state] if is_final(a)]
                    self.actions(a for a in self.plan.entering[state] if not is_final(a))
                    self.log += [("content", transition) for transition in defaults]
                    self.actions(final)
                case Branch(history, recorded, unrecorded):
                    self.ops(recorded if self.is_recorded(history) else unrecorded)
                case Content(transition):
                    self.log.append(("content", transition))
                case Restore(history):
                    before = len(self.log)
                    self.ops(self.plan.resumed(op))
                    if history in self.held and self.plan.kept[history][0].states is None:
                        self.check_restored(op, self.log[before:])
                case Resume(history, region, cases):
                    wanted = self.number(history, region)
                    self.ops(next((ops for number, ops in cases if number == wanted), ()))

    def check_restored(self, op: Restore, log: Log) -> None:
        """Require that the sets of states say what the numbers say."""
        found = restored(self.plan, op)
        kept = self.held[op.history]
        between = {s for s, below in found.between if not kept.isdisjoint(below)}
        entered = {what[1] for what in log if what[0] == "enter"}
        assert kept.intersection(found.inside) | found.sure | between == entered

    def actions(self, actions: Iterable[Action]) -> None:
        for action in actions:
            self.seen[type(action).__name__] += 1
            match action:
                case Forget(history):
                    self.history.pop(history, None)
                case WantInvoke(state):
                    self.invoking.add(state)
                case DropInvoke(state):
                    self.invoking.discard(state)
                case Arm(transition) | Disarm(transition):
                    verb = "arm" if isinstance(action, Arm) else "disarm"
                    source = self.plan.chart.transitions[transition].source
                    if self.log[-1:] != [(verb, source)]:
                        self.log.append((verb, source))
                case Run(block):
                    self.log.append(("block", block))
                case EndInvoked(invocation):
                    self.log.append(("end", invocation))
                case RaiseDone(event):
                    self.log.append(("done", event))
                case IfFinal(_, finals, done):
                    if all(not self.active.isdisjoint(each) for each in finals):
                        self.actions([done])
                case Finish():
                    self.log.append(("finish",))


def is_final(action: Action) -> bool:
    return isinstance(action, RaiseDone | IfFinal | Finish)


@dataclass
class Watcher:
    """Predicts what the interpreter does, and compares."""

    seen: Counter[str] = field(default_factory=Counter)
    chosen: dict[int, Reaction] = field(default_factory=dict)
    log: Log = field(default_factory=list)

    def machine(self, g: Globals) -> Machine:
        active, history = set(g.configuration) - {0}, dict(g.history)
        invoking = set(g.states_to_invoke)
        return Machine(lowered(g.chart), active, history, dict(history), invoking, self.seen)

    def attach(self, patch: pytest.MonkeyPatch) -> None:
        """Watch the interpreter."""

        def logged(
            module: object, name: str, what: Callable[..., tuple[object, ...] | None]
        ) -> None:
            original = getattr(module, name)

            def run(g: Globals, *arguments: Any) -> object:
                before = len(self.log)
                entry = what(g, *arguments)
                result = original(g, *arguments)
                if name in ("cancel_invoked", "execute_block", "execute_content"):
                    del self.log[before:]  # what others do within is theirs
                if entry is not None:
                    self.log.insert(before, entry)
                return result

            patch.setattr(module, name, run)

        logged(entry_exit, "leave", lambda _, state: ("leave", state))
        logged(entry_exit, "execute_block", lambda _, block: ("block", block) if block else None)
        logged(entry_exit, "execute_content", _content)
        logged(entry_exit, "cancel_invoked", lambda _, slot: ("end", slot))
        logged(entry_exit, "_raise_done", _done)
        logged(entry_exit, "_enter_final", lambda _, state: None if state.parent else ("finish",))
        logged(timers, "arm", lambda _, state: ("arm", state))
        logged(timers, "disarm", lambda _, state: ("disarm", state))
        for module, name in (
            (macrostep, "exit_states"),
            (macrostep, "enter_states"),
            (macrostep, "select_transitions"),
            (macrostep, "select_eventless_transitions"),
        ):
            patch.setattr(module, name, getattr(self, name)(getattr(module, name)))

    # --- selection ----------------------------------------------------------------------------

    def selected(self, g: Globals, event: int | None) -> tuple[list[Transition], bool]:
        """Return what is selected before conflicts are removed, and whether a state defers."""
        plan = lowered(g.chart)
        found: dict[int, Transition] = {}
        defers, tried = False, set()
        for leaf in atomic_states(g):
            for candidate in plan.selection.candidates(leaf, event):
                if isinstance(candidate, Defer):
                    defers = True
                    break
                if candidate.guard is not None:
                    tried.add(candidate.index)
                    if not g.guards[candidate.index]:
                        continue
                found[candidate.index] = candidate
                break
        assert tried == set(g.guards)
        if event is not None:
            for state, answers in plan.selection.answers_instead(event):
                defers |= state in g.configuration and found.keys().isdisjoint(answers)
        return list(found.values()), defers

    def check_selection(
        self, g: Globals, event: int | None, enabled: tuple[Transition, ...], deferred: bool
    ) -> None:
        found, defers = self.selected(g, event)
        assert defers == deferred
        if deferred:
            return
        selection = lowered(g.chart).selection
        kind = selection.eventless if event is None else selection.concurrency(event)
        self.seen[kind.name] += bool(found)
        match kind:
            case Concurrency.NONE:
                assert found == []
            case Concurrency.SINGLE_REGION:
                assert [*enabled] == found
                assert len(found) < 2
            case Concurrency.INDEPENDENT:
                assert [*enabled] == found
            case Concurrency.PREEMPTING:
                assert {t.index for t in enabled} <= {t.index for t in found}
        sources = [t.source for t in selection.by_event.get(event, ())] if event is not None else []
        assert len(found) < 2 or event is None or not selection.is_one_answer(sources)

    # --- steps --------------------------------------------------------------------------------

    def exit_states(self, run: Step) -> Step:
        def exit_states(g: Globals, enabled: tuple[Transition, ...]) -> tuple[int, ...]:
            machine, left, recorded = self.machine(g), list[int](), dict(g.history)
            self.chosen = {t.index: machine.reaction(t) for t in enabled}
            for transition in enabled:
                reaction = self.chosen[transition.index]
                assert reaction.domain == get_transition_domain(g, transition)
                states = machine.left(reaction)
                assert states == sorted(states, reverse=True)
                left += states
                recorded |= machine.record(reaction)
                if reaction.domain is not None:
                    possible = possible_below(machine.plan, reaction)
                    assert set(states) == machine.active.intersection(possible)
            for state in sorted(left, reverse=True):
                machine.log.append(("leave", state))
                machine.actions(machine.plan.leaving[state])
            self.log.clear()
            exited = run(g, enabled)
            assert list(exited) == sorted(left, reverse=True)
            assert self.log == machine.log
            assert g.history == recorded
            assert g.states_to_invoke == machine.invoking
            return exited

        return exit_states

    def enter_states(self, run: Step) -> Step:
        def enter_states(g: Globals, enabled: tuple[Transition, ...]) -> tuple[int, ...]:
            machine = self.machine(g)
            for transition in enabled:
                is_start = transition.trigger is Trigger.INITIAL
                machine.ops(machine.plan.start if is_start else self.chosen[transition.index].enter)
            self.log.clear()
            entered = run(g, enabled)
            assert list(entered) == [what[1] for what in machine.log if what[0] == "enter"]
            assert self.log == [what for what in machine.log if what[0] != "enter"]
            assert g.configuration - {0} == machine.active
            assert g.history == machine.history
            assert g.states_to_invoke == machine.invoking
            return entered

        return enter_states

    def select_transitions(self, run: Callable[..., Any]) -> Callable[..., Any]:
        def select_transitions(g: Globals, event: int) -> tuple[tuple[Transition, ...], bool]:
            enabled, deferred = run(g, event)
            self.check_selection(g, event, enabled, deferred)
            return enabled, deferred

        return select_transitions

    def select_eventless_transitions(self, run: Callable[..., Any]) -> Callable[..., Any]:
        def select_eventless_transitions(g: Globals) -> tuple[Transition, ...]:
            enabled: tuple[Transition, ...] = run(g)
            self.check_selection(g, None, enabled, deferred=False)
            return enabled

        return select_eventless_transitions


def _content(_: Globals, transition: Transition) -> tuple[object, ...] | None:
    return ("content", transition.index) if transition.content else None


def _done(g: Globals, state: int, _: object) -> tuple[object, ...] | None:
    event = g.chart.event_index.get(f"done.state.{g.chart.states[state].id}")
    return None if event is None else ("done", event)


APART = """\
chart: Apart
initial: all
events: {in: [go]}
states:
  all:
    regions:
      left: {initial: a, states: {a: {on: {go: b}}, b: {on: {go: a}}}}
      right: {initial: c, states: {c: {on: {go: d}}, d: {}}}
"""
NESTED = """\
chart: Nested
initial: outer
events: {in: [go, back, out, end]}
states:
  outer:
    initial: inner
    states:
      inner:
        initial: deep
        on: {done.state.inner: beside}
        states:
          deep:
            initial: a
            states:
              a: {on: {go: b, out: rest}}
              b: {on: {end: ended}}
          ended: {final: true}
          recent: {history: shallow, default: deep}
      beside: {on: {back: whole}}
      whole: {history: deep, default: inner}
  rest: {on: {back: whole, go: recent}}
"""


def cases(tmp_path: Path) -> Iterator[tuple[Chart, Sequence[str]]]:
    for text, events in (
        (APART, "go go go"),
        (NESTED, "out go go end back go out back go end out back"),
    ):
        path = tmp_path / "chart.yaml"
        path.write_text(text, encoding="utf-8")
        yield load(path), ["start 0", *(f"dispatch {event}" for event in events.split())]
    for number in range(CHARTS):
        case = random_case(SEED, number)
        yield case.chart, case.script


@pytest.mark.slow
def test_the_program_is_what_the_interpreter_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    watcher = Watcher()
    watcher.attach(monkeypatch)
    for chart, script in cases(tmp_path):
        run_script(chart, script)
    kinds = (Enter, Branch, Restore, Resume, Leave, LeaveRegion, LeaveBelow)
    actions = (Arm, Disarm, Forget, Run, RaiseDone, IfFinal, Finish)
    invoking = (WantInvoke, DropInvoke, EndInvoked)
    wanted = {kind.__name__ for kind in (*kinds, *actions, *invoking)}
    wanted |= {"record", "sure record", "kept", *(each.name for each in Concurrency)} - {"NONE"}
    assert wanted - {what for what, count in watcher.seen.items() if count} == set()
