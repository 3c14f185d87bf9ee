"""Check whether a mutant takes every local step as the original does.

The local states of a machine in an exploration of the original, and all stimuli in each, are far
fewer than the states of the system. If the changed chart has the same effect in each of these
steps, then by induction no run of the system differs, and every property holds as before. Only
steps that involve the changed part need to be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind
from fsmkit.language.format import format_value
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.run import step_timer
from fsmkit.system.shared import has_data_trigger, resting_states
from fsmkit.verify.mutants.noted_steps import ObservedSteps, Seen
from fsmkit.verify.mutants.operators import NEEDED
from fsmkit.verify.mutants.subject import Mutant
from fsmkit.verify.statespace.actions import Action, Chooser, Mover, Outcome, Step, TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.local_steps import LocalSteps

LASTING = frozenset({Kind.ATOMIC, Kind.COMPOUND, Kind.PARALLEL})
"""The kinds of states of which it is known whether a step has to do with them."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A step of the original. ``taken``: transitions; ``passed``: states that were active."""

    before: snap.Snapshot
    what: Step
    outcomes: tuple[Outcome, ...]
    taken: frozenset[int]
    moved: frozenset[int]
    passed: frozenset[int]


class _Steps(ObservedSteps):
    """Local steps from states in the form of the core, with all of their effects."""

    def __init__(self, closed: ClosedSystem, seen: Seen) -> None:
        super().__init__(closed, seen)
        self._shown = seen
        self.taken: set[int] = set()
        self.moved: set[int] = set()

    def perform(
        self, machine: int, snapshot: snap.Snapshot, what: Step, chooser: Chooser
    ) -> snap.Macrostep | None:
        """Take a step; in zones a timer fires at its deadline, independent of the others."""
        if not self.closed.zones:
            return super().perform(machine, snapshot, what, chooser)
        marked = _marked(snapshot)
        if what.action is not Action.FIRE:
            return super().perform(machine, marked, what, chooser)
        timers = list(marked.timers)
        if what.argument >= len(timers):
            return None
        fired = replace(timers.pop(what.argument), deadline=0)
        chooser.start_step()
        return step_timer(self.charts[machine], replace(marked, timers=(fired, *timers)), chooser)

    def outcome(
        self, machine: int, before: snap.Snapshot, what: Step, mover: Mover, done: snap.Macrostep
    ) -> Outcome:
        """Return the outcome of a macrostep, with notes, effects, and the remaining timers."""
        found = LocalSteps.outcome(self, machine, before, what, mover, done)
        for small in done.microsteps:
            self.taken.update(small.transitions)
            self.moved.update(small.exited, small.entered)
        for effect in done.effects:
            match effect:
                case snap.Taken(transition) | snap.SpentTimeout(transition):
                    self.taken.add(transition)
                case snap.Entered(state) | snap.Exited(state):
                    self.moved.add(state)
                case _:
                    pass
        after, sources = found.after, tuple[int, ...]()
        if self.closed.zones:
            after, sources = _unmarked(after, before)
        effects = tuple(self.effects(machine, before, done))
        cause = None if isinstance(done.event, snap.Timeout) else done.event
        shown = self._shown.number((cause, sources, *effects))
        return replace(found, after=after, notes=(*found.notes, shown))


def _marked(snapshot: snap.Snapshot) -> snap.Snapshot:
    """Return a machine whose timers precede all times, in their order (``fsm_mark``)."""
    count = len(snapshot.timers)
    timers = tuple(snap.Timer(n - count, timer.what) for n, timer in enumerate(snapshot.timers))
    return replace(snapshot, timers=timers, now=0)


def _unmarked(after: snap.Snapshot, before: snap.Snapshot) -> tuple[snap.Snapshot, tuple[int, ...]]:
    """Return a machine with durations as deadlines, and each timer's previous number, or 0."""
    old = len(before.timers)
    sources = tuple(t.deadline + old + 1 if t.deadline < 0 else 0 for t in after.timers)
    timers = tuple(
        replace(timer, deadline=before.timers[source - 1].deadline) if source else timer
        for timer, source in zip(after.timers, sources, strict=True)
    )
    return replace(after, timers=timers, now=0), sources


class LocalBehaviour:
    """The steps of one machine of the original in each of its local states."""

    def __init__(self, closed: ClosedSystem, machine: int, states: Sequence[snap.Snapshot]) -> None:
        """Take the explored system, and the reached states of the machine."""
        self._closed = closed
        self._machine = machine
        self._states = states
        self._numbers = Seen()

    @cached_property
    def _steps(self) -> tuple[_Seen, ...]:
        steps = _Steps(self._closed, self._numbers)
        return tuple(self._seen(steps))

    def _seen(self, steps: _Steps) -> Iterator[_Seen]:
        for state in self._states:
            for what in self._possible(state):
                steps.taken, steps.moved = set(), set()
                outcomes = tuple(steps.explore(self._machine, state, what, Mover.INTERNAL))
                moved = frozenset(steps.moved)
                passed = moved | state.configuration
                yield _Seen(state, what, outcomes, frozenset(steps.taken), moved, passed)

    def _possible(self, state: snap.Snapshot) -> Iterator[Step]:
        """Yield all stimuli that can occur in a state, and perhaps more."""
        machine = self._machine
        if not state.running:
            if not state.finished and state.fault is None:
                yield Step(Action.START, machine)
            return
        if self._tries(self._closed):
            yield Step(Action.EVENTLESS, machine)
        if state.queue or state.deferred:
            yield Step(Action.TAKE, machine)
        for place in range(len(state.timers)):
            yield Step(Action.FIRE, machine, place)
        for number, possible in enumerate(self._closed.possible):
            if possible.machine == machine:
                yield Step(Action.OCCUR, machine, number)

    def _tries(self, closed: ClosedSystem) -> bool:
        return has_data_trigger(closed.system.machines[self._machine], closed.charts[self._machine])

    def difference(self, changed: ClosedSystem, mutant: Mutant) -> tuple[str, ...] | None:
        """Return the first step that differs with another chart for the machine.

        Its lines are the state and the stimulus, then the effects in the original and in the
        mutant. The lines are empty if the comparison is not possible: declarations differ, data is
        read that the original does not read, or a step has too many choices. None: all steps are
        the same.
        """
        own, other = self._closed.charts[self._machine], changed.charts[self._machine]
        if self._tries(changed) != self._tries(self._closed):
            return ()
        if not _is_comparable(self._closed, changed, self._machine):
            return ()
        timers = _timers(own, other)
        back = {theirs: ours for ours, theirs in timers.items()}
        steps = _Steps(replace(changed, mortal=self._closed.mortal), self._numbers)
        matters = _relevance(own, mutant)
        unseen: tuple[str, ...] | None = None
        try:
            for seen in filter(matters, self._steps):
                before = _with_timers(seen.before, timers)
                if before is None:
                    return unseen or ()
                found = tuple(steps.explore(self._machine, before, seen.what, Mover.INTERNAL))
                if _are_same(seen.outcomes, found, back):
                    continue
                lines = tuple(self._difference_lines(seen, found))
                if lines[1] != lines[2]:
                    return lines
                unseen = unseen or lines
        except TooManyChoices:
            return unseen or ()
        return unseen

    def _difference_lines(self, seen: _Seen, found: Sequence[Outcome]) -> Iterator[str]:
        """Yield the lines of a differing step."""
        chart = self._closed.charts[self._machine]
        data = ", ".join(
            f"{variable.name} = {format_value(value, variable.type)}"
            for variable, value in zip(chart.data, seen.before.data, strict=False)
            if value != variable.init.value
        )
        place = _leaves(chart, seen.before) + (f" ({data})" if data else "")
        yield f"in {place}: {self._cause(chart, seen)}"
        yield f"  original: {self._effects(chart, seen.outcomes)}"
        yield f"  mutant:   {self._effects(chart, found)}"

    def _cause(self, chart: Chart, seen: _Seen) -> str:
        match seen.what.action:
            case Action.TAKE if seen.before.queue:
                return chart.events[seen.before.queue[0].event].name
            case Action.OCCUR:
                return chart.events[self._closed.possible[seen.what.argument].event].name
            case Action.FIRE:
                return "timeout"
            case _:
                return str(seen.what.action.value)

    def _effects(self, chart: Chart, outcomes: Sequence[Outcome]) -> str:
        told: list[str] = []
        for outcome in outcomes:
            _, sources, *effects = self._numbers.shown(outcome.notes[-1])
            parts = [_effect(effect) for effect in effects]
            parts.append(f"then in {_leaves(chart, outcome.after)}")
            armed = zip(outcome.after.timers, sources, strict=False)  # type: ignore[call-overload]
            parts += [f"a timer of {t.deadline} ticks" for t, source in armed if not source]
            told.append(", ".join(parts))
        return " | ".join(told) or "nothing"


def _are_same(ours: Sequence[Outcome], theirs: Sequence[Outcome], back: Mapping[int, int]) -> bool:
    return len(ours) == len(theirs) and all(
        one.step.choices == other.step.choices
        and one.messages == other.messages
        and one.notes == other.notes
        and one.after == _with_timers(other.after, back)
        for one, other in zip(ours, theirs, strict=True)
    )


def _effect(effect: object) -> str:
    """Return an effect of `ObservedSteps.effects` in a few words, such as ``sends done(1)``."""
    if not isinstance(effect, tuple):
        return str(effect)
    word, what, *values = effect
    given = values[0] if values and isinstance(values[0], tuple) else tuple(values)
    return f"{word} {what}" + (f"({', '.join(map(str, given))})" if given else "")


def _leaves(chart: Chart, state: snap.Snapshot) -> str:
    leaves = [chart.states[s].id for s in sorted(state.configuration) if chart.states[s].is_leaf]
    return " ".join(leaves) or "no state"


def is_observable(closed: ClosedSystem, machine: int) -> bool:
    """Whether the local states of a machine are all of its behaviour."""
    chart = closed.charts[machine]
    has_intervals = any(t.least is not None for t in chart.transitions)
    return not (closed.is_open or closed.is_ordered or chart.invocations or has_intervals)


def _is_comparable(original: ClosedSystem, changed: ClosedSystem, machine: int) -> bool:
    """Whether two systems are equal except for one machine's steps."""
    one, other = original.system, changed.system
    parts = ("properties", "event_links", "input_links", "monitors")
    if any(getattr(one, part) != getattr(other, part) for part in parts):
        return False
    if (original.possible, original.free_inputs, original.results, original.kept_inputs) != (
        changed.possible, changed.free_inputs, changed.results, changed.kept_inputs
    ):  # fmt: skip
        return False
    for number, (ours, theirs) in enumerate(zip(original.charts, changed.charts, strict=True)):
        if number != machine and ours != theirs:
            return False
    ours, theirs = original.charts[machine], changed.charts[machine]
    declared = ("events", "data", "inputs", "outputs", "operations", "capacities", "types",
                "script", "lenient", "invocations", "done", "copies")  # fmt: skip
    if any(getattr(ours, part) != getattr(theirs, part) for part in declared):
        return False
    of_state = ("id", "kind", "parent", "children", "defer", "invariant", "rest", "done_data")
    if len(ours.states) != len(theirs.states) or any(
        getattr(a, part) != getattr(b, part)
        for a, b in zip(ours.states, theirs.states, strict=True)
        for part in of_state
    ):
        return False
    if resting_states(ours, one.machines[machine]) != resting_states(
        theirs, other.machines[machine]
    ):
        return False
    return _reads_no_more(original, changed, machine)


def _reads_no_more(original: ClosedSystem, changed: ClosedSystem, machine: int) -> bool:
    """Whether data that are dead in the original, and so reset, are dead in the other, too."""
    if bool(original.mortal) != bool(changed.mortal):
        return False
    live = {m.data: m.live for m in changed.mortal[machine]} if changed.mortal else {}
    return all(
        m.data in live and live[m.data] <= m.live
        for m in (original.mortal[machine] if original.mortal else ())
    )


def _timers(own: Chart, other: Chart) -> dict[int, int]:
    """Return for each transition with a delay the corresponding one of the other chart."""

    def places(chart: Chart) -> dict[object, int]:
        found: dict[object, int] = {}
        for t in chart.transitions:
            if t.has_timer:
                key = t.source, t.trigger, t.span.source.name, t.span.start
                found[key] = -1 if key in found else t.index
        return found

    theirs = places(other)
    return {
        ours: theirs[key]
        for key, ours in places(own).items()
        if ours >= 0 and theirs.get(key, -1) >= 0
    }


def _with_timers(state: snap.Snapshot, numbers: Mapping[int, int]) -> snap.Snapshot | None:
    """Return a machine whose timeouts are those of another chart; None if one is missing."""
    if not state.timers:
        return state
    timers: list[snap.Timer] = []
    for timer in state.timers:
        what = timer.what
        if isinstance(what, snap.Timeout):
            if what.transition not in numbers:
                return None
            what = snap.Timeout(numbers[what.transition])
        timers.append(snap.Timer(timer.deadline, what))
    return replace(state, timers=tuple(timers))


def _relevance(chart: Chart, mutant: Mutant) -> Callable[[_Seen], bool]:
    """Return the steps of the original that involve the changed part (see `NEEDED`)."""
    needed = NEEDED.get(mutant.operator)
    transitions = frozenset(t.index for t in chart.transitions if t.span == mutant.owner)
    states = frozenset(s.index for s in chart.states if s.span == mutant.owner)
    if needed is None or mutant.owner is None or not (transitions or states):
        return lambda _: True
    if needed == "handler":
        return lambda seen: bool(transitions & seen.taken or states & seen.moved)
    sources = states | {chart.transitions[t].source for t in transitions}
    if any(chart.states[s].kind not in LASTING for s in sources):
        return lambda _: True
    return lambda seen: not sources.isdisjoint(seen.passed)
