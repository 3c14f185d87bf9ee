"""Local steps by the reference interpreter: a machine's moves, and its messages to others.

`verify.statespace.closed_system` defines states and steps; ``core/system/local.c`` is the same over
generated C.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Self, assert_never

from fsmkit.chart.chart import OPEN_ENDED, Chart
from fsmkit.language import Value
from fsmkit.runtime.driving import driven
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.macrostep import initial, start, step
from fsmkit.runtime.interpreter.run import (
    has_room,
    is_deferred,
    post,
    step_event,
    step_timer,
)
from fsmkit.system.machine import OBSERVED, EventLink, InputLink, Machine, Possible
from fsmkit.system.properties.kinds.monitor import sampling_event
from fsmkit.system.shared import has_data_trigger, kept_at_start, resting_states, written_value
from fsmkit.verify.statespace.actions import (
    FAULT,
    FULL,
    MOST_RUNS,
    UNHANDLED,
    Action,
    Chooser,
    Message,
    Mover,
    Outcome,
    ReadChooser,
    Step,
    TooManyChoices,
    View,
    state_note,
    took,
    transition_note,
)
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.coverage import Coverage
from fsmkit.verify.statespace.dead_variables import with_dead_reset
from fsmkit.verify.statespace.sessions import (
    effects_within,
    invoked_elapsed,
    is_due,
    settled,
    timers_within,
    waiting_count,
    with_first,
)


class LocalSteps:
    """The local steps of the machines of a closed system."""

    def __init__(self, closed: ClosedSystem) -> None:
        """Precompute the constant facts."""
        self.closed = closed
        self.charts = closed.charts
        self.machines = closed.system.machines
        possible: list[list[tuple[int, Possible]]] = [[] for _ in self.charts]
        for number, each in enumerate(closed.possible):
            possible[each.machine].append((number, each))
        self._possible = tuple(map(tuple, possible))
        self.coverage = tuple(Coverage(set(), set()) for _ in self.charts)
        self._rests = tuple(map(resting_states, self.charts, self.machines))
        self._samples_inputs = tuple(map(has_data_trigger, self.machines, self.charts))
        self._ports = tuple(map(_ports, self.machines))
        self._asked: tuple[set[int], ...] = tuple(set() for _ in self.charts)
        for asking, event in closed.observed_events:
            self._asked[asking].add(event)
        self._wires: dict[int, list[InputLink]] = {}
        for wire in closed.system.input_links:
            self._wires.setdefault(wire.source, []).append(wire)
        self._links: dict[tuple[int, int], list[EventLink]] = {}
        for link in closed.system.event_links:
            self._links.setdefault((link.source, link.port), []).append(link)
        self._noted = tuple(
            {e.index for e in machine.chart.events if e.directions and not machine.is_monitor}
            for machine in closed.system.machines
        )

    def initial(self, machine: int) -> snap.Snapshot:
        """Return a machine before its start."""
        return initial(self.charts[machine])

    def settled(self, machine: int, snapshot: snap.Snapshot) -> snap.Snapshot:
        """Return a machine with everything cleared that is not state."""
        inputs = snapshot.inputs
        if self.closed.is_open:
            inputs = tuple(
                inputs[place] if place in self.closed.kept_inputs else value
                for place, value in enumerate(initial(self.charts[machine]).inputs)
            )
        chart, in_order = self.charts[machine], self.machines[machine].is_channel
        found = settled(chart, snapshot, untimed=self.closed.untimed, in_order=in_order)
        found = replace(found, inputs=inputs)
        return with_dead_reset(found, self.closed.mortal[machine]) if self.closed.mortal else found

    def view(self, machine: int, snapshot: snap.Snapshot) -> View:
        """Return the facts about a local state that the search uses."""
        chart = self.charts[machine]
        if not snapshot.running:
            return View(0, 0, False, False, snapshot.fault is not None, snapshot.finished)
        armed = timers_within(chart, snapshot)
        awaited = sum(not self.closed.never_fires(one, timer) for one, timer in armed)
        leaves = (s for s in snapshot.configuration if chart.states[s].is_leaf)
        return View(
            waiting_count(chart, snapshot),
            awaited,
            is_due(snapshot),
            True,
            False,
            all(leaf in self._rests[machine] for leaf in leaves),
        )

    def _is_early(self, machine: int, timer: snap.Timer) -> bool:
        """Whether a timer may fire before its deadline: its delay is an interval."""
        if not isinstance(timer.what, snap.Timeout):
            return False
        transition = self.charts[machine].transitions[timer.what.transition]
        least = transition.least
        return least is not None and timer.deadline <= transition.delay - least

    def elapsed(
        self, machine: int, snapshot: snap.Snapshot, ticks: Fraction = Fraction(0)
    ) -> snap.Snapshot:
        """Return a machine after some ticks, or a unit of time."""
        passed = self.closed.unit if not ticks else as_number(ticks)
        timers = tuple(
            snap.Timer(max(t.deadline - passed, self._end(machine, t)), t.what)
            for t in snapshot.timers
        )
        return replace(snapshot, timers=timers, invoked=invoked_elapsed(snapshot, passed))

    def _end(self, machine: int, timer: snap.Timer) -> int:
        """Return the least deadline of a timer that is relevant: one without an end stays away."""
        if not isinstance(timer.what, snap.Timeout):
            return -OPEN_ENDED
        transition = self.charts[machine].transitions[timer.what.transition]
        return OPEN_ENDED if transition.is_open_ended else -OPEN_ENDED

    def delivered(self, snapshot: snap.Snapshot, message: Message) -> tuple[snap.Snapshot, bool]:
        """Return a machine after a message has arrived, and whether its queue was full."""
        if message.event is None:
            target = self.machines[message.target]
            given = driven(target, snapshot, message.input, message.value)
            return self._with_look(message.target, given) if given != snapshot else given, False
        if not snapshot.running:
            return snapshot, False
        after = post(self.charts[message.target], snapshot, message.event)
        return (snapshot, True) if after is None else (after, False)

    def _with_look(self, machine: int, snapshot: snap.Snapshot) -> snap.Snapshot:
        """Return a monitor whose inputs have changed, about to sample them."""
        look = sampling_event(self.charts[machine])
        waits = any(occurrence.event == look for occurrence in snapshot.queue)
        if look is None or waits or not snapshot.running:
            return snapshot
        after = post(self.charts[machine], snapshot, snap.Occurrence(look))
        return snapshot if after is None else after

    # --- one step ------------------------------------------------------------------------------

    def perform(
        self, machine: int, snapshot: snap.Snapshot, what: Step, chooser: Chooser
    ) -> snap.Macrostep | None:
        """Take a step; None if there is no such step."""
        chart = self.charts[machine]
        chooser.start_step()
        if self.closed.is_open:
            snapshot = self.with_inputs(snapshot, chooser)
        match what.action:
            case Action.START:
                kept = kept_at_start(self.machines[machine], snapshot.data)
                return start(chart, 0, chooser, snapshot.inputs, given=kept)
            case Action.TAKE:
                return step_event(chart, snapshot, chooser)
            case Action.FIRE:
                return self._fire(machine, snapshot, what.argument, chooser)
            case Action.EVENTLESS:
                return step(chart, snapshot, None, chooser)
            case Action.OCCUR:
                possible = self.closed.possible[what.argument]
                occurrence = snap.Occurrence(possible.event, possible.payload)
                recalls = any(not is_deferred(chart, snapshot, o.event) for o in snapshot.deferred)
                keeps = has_room(chart, snapshot) and not recalls
                done = step(chart, snapshot, occurrence, chooser, may_defer=keeps)
                return done if not possible.spontaneous or took(done) else None
            case Action.ELAPSE:
                return None
            case _:
                assert_never(what.action)

    def with_inputs(self, snapshot: snap.Snapshot, chooser: Chooser) -> snap.Snapshot:
        """Return an open chart whose inputs are chosen, or will be when they are read."""
        inputs = list(snapshot.inputs)
        if isinstance(chooser, ReadChooser):
            for place, free in enumerate(self.closed.free_inputs):
                is_late = place in chooser.waiting
                inputs[free.input] = free.values[0 if is_late else chooser.choose_input(place)]
            return replace(snapshot, inputs=ReadInputs(inputs, self.closed, chooser))
        for free in self.closed.free_inputs:
            inputs[free.input] = free.values[chooser.choose(len(free.values))]
        return replace(snapshot, inputs=tuple(inputs))

    def _fire(
        self, machine: int, snapshot: snap.Snapshot, place: int, chooser: Chooser
    ) -> snap.Macrostep | None:
        chart, timers = self.charts[machine], list(snapshot.timers)
        if chart.invocations:
            return self._fire_within(chart, snapshot, place, chooser)
        if place >= len(timers):
            return None
        timer = timers.pop(place)
        if self.closed.untimed:
            if self.closed.never_fires(chart, timer):
                return None
        elif timer.deadline > 0 and not self._is_early(machine, timer):
            return None
        first = replace(timer, deadline=min(timer.deadline, 0))
        snapshot = replace(snapshot, timers=(first, *timers))
        done = step_timer(chart, snapshot, chooser)
        return done if took(done) or self._end(machine, timer) < 0 else None

    def _fire_within(
        self, chart: Chart, snapshot: snap.Snapshot, place: int, chooser: Chooser
    ) -> snap.Macrostep | None:
        """Fire a timer that may belong to an invoked machine."""
        if not self.closed.untimed:
            return step_timer(chart, snapshot, chooser) if is_due(snapshot) else None
        if self.closed.never_fires(*timers_within(chart, snapshot)[place]):
            return None
        return step_timer(chart, with_first(snapshot, place), chooser)

    def chooser(self, machine: int) -> Chooser:
        """Return the source of choices for a step."""
        closed = self.closed
        if not closed.read_inputs:
            return Chooser(closed.results[machine])
        counts = [len(free.values) for free in closed.free_inputs]
        return ReadChooser(closed.results[machine], counts, frozenset(closed.read_inputs.values()))

    def explore(
        self, machine: int, snapshot: snap.Snapshot, what: Step, mover: Mover
    ) -> list[Outcome]:
        """Take a step with every sequence of choices; the same effect counts once."""
        chooser = self.chooser(machine)
        found: dict[tuple[snap.Snapshot, tuple[Message, ...], tuple[int, ...]], Outcome] = {}
        runs = 0
        while True:
            runs += 1
            if runs > MOST_RUNS:
                raise TooManyChoices
            done = self.perform(machine, snapshot, what, chooser)
            if done is not None:
                self.coverage[machine].add(done)
            outcome = None if done is None else self.outcome(machine, snapshot, what, mover, done)
            if outcome is not None:
                idle = outcome.after == snapshot and not outcome.messages and not outcome.notes
                if not (idle and mover is Mover.ENVIRONMENT) and not (
                    what.action is Action.EVENTLESS and outcome.after == snapshot and not took(done)
                ):
                    step_ = replace(what, choices=chooser.sequence)
                    key = (outcome.after, outcome.messages, outcome.notes)
                    known = found.get(key)
                    if known is None or step_.choices < known.step.choices:
                        found[key] = replace(outcome, step=step_)
            if not chooser.advance():
                return sorted(found.values(), key=lambda outcome: outcome.step.choices)

    def outcome(
        self, machine: int, before: snap.Snapshot, what: Step, mover: Mover, done: snap.Macrostep
    ) -> Outcome:
        """Return the outcome of a macrostep."""
        after = self.settled(machine, done.after)
        return Outcome(
            what,
            mover,
            after,
            (*self._changed_outputs(machine, before, after), *self._sent(machine, done)),
            self._notes(machine, what, done),
        )

    def _changed_outputs(
        self, machine: int, before: snap.Snapshot, after: snap.Snapshot
    ) -> list[Message]:
        chart, instance = self.charts[machine], self.machines[machine]
        found = []
        for link in self._wires.get(machine, ()):
            value = written_value(instance, chart, after.data, link.output)
            if value != written_value(instance, chart, before.data, link.output):
                found.append(Message(link.target, input=link.input, value=value))
        return found

    def _sent(self, machine: int, done: snap.Macrostep) -> list[Message]:
        found: list[Message] = []
        if isinstance(done.event, snap.Occurrence):
            found += self._messages(machine, OBSERVED + done.event.event, done.event.payload)
        for effect in done.effects:
            match effect:
                case snap.Emitted(snap.Occurrence(event, payload)) if effect.is_leaving:
                    port, values = event, payload
                case snap.Called(operation, arguments):
                    port, values = self._ports[machine][operation], arguments
                case _:
                    continue
            found += self._messages(machine, port, values)
        return found

    def _messages(self, machine: int, port: int, values: tuple[Value, ...]) -> Iterator[Message]:
        for link in self._links.get((machine, port), ()):
            occurrence = snap.Occurrence(link.event, tuple(values[n] for n in link.arguments))
            yield Message(link.target, occurrence)

    def _notes(self, machine: int, what: Step, done: snap.Macrostep) -> tuple[int, ...]:
        found: dict[int, None] = {}
        own = self.closed.possible[what.argument].event if what.action is Action.OCCUR else None
        if isinstance(done.event, snap.Occurrence) and done.event.event in self._asked[machine]:
            found[UNHANDLED + len(self.charts[machine].events) + done.event.event] = None
        for path, _, effect in effects_within(self.charts[machine], done):
            match effect:
                case snap.Overflowed():
                    found[FULL] = None
                case snap.Faulted():
                    found[FAULT] = None
                case _ if path:
                    continue
                case snap.Unhandled(event) if event != own and event in self._noted[machine]:
                    found[UNHANDLED + event] = None
                case snap.Taken(transition) if self.closed.covers:
                    found[transition_note(self.charts[machine], transition)] = None
                case snap.Entered(state) if self.closed.covers:
                    found[state_note(self.charts[machine], state)] = None
        return tuple(found)

    # --- all steps -----------------------------------------------------------------------------

    def own(self, machine: int, snapshot: snap.Snapshot, view: View) -> list[Outcome]:
        """Return the steps that a machine can take without external events."""
        arbitrary = self.closed.is_open
        found: list[Outcome] = []
        if self._samples_inputs[machine]:
            mover = Mover.ENVIRONMENT if arbitrary else Mover.INTERNAL
            found = self.explore(machine, snapshot, Step(Action.EVENTLESS, machine), mover)
            if found and not arbitrary:
                return found
        if view.waiting:
            take = Step(Action.TAKE, machine)
            return found + self.explore(machine, snapshot, take, Mover.INTERNAL)
        if self.closed.untimed:
            places = range(len(timers_within(self.charts[machine], snapshot)))
            for place in places[:1] if self.machines[machine].is_channel else places:
                fire = Step(Action.FIRE, machine, place)
                found += self.explore(machine, snapshot, fire, Mover.TIME)
        else:
            if view.due:
                fire = Step(Action.FIRE, machine)
                found += self.explore(machine, snapshot, fire, Mover.INTERNAL)
            for place in range(int(view.due), len(snapshot.timers)):
                if self._is_early(machine, snapshot.timers[place]):
                    fire = Step(Action.FIRE, machine, place)
                    found += self.explore(machine, snapshot, fire, Mover.ENVIRONMENT)
        for number, possible in self._possible[machine]:
            if possible.spontaneous:
                occur = Step(Action.OCCUR, machine, number)
                found += self.explore(machine, snapshot, occur, Mover.ENVIRONMENT)
        return found

    def open(self, machine: int, snapshot: snap.Snapshot) -> list[Outcome]:
        """Return the external events that a machine may take."""
        return [
            outcome
            for number, possible in self._possible[machine]
            if not possible.spontaneous
            for outcome in self.explore(
                machine, snapshot, Step(Action.OCCUR, machine, number), Mover.ENVIRONMENT
            )
        ]


class ReadInputs(tuple[Value, ...]):  # noqa: SLOT001  (a tuple has no slots beside)
    """Inputs, some of which are chosen when they are read first."""

    _closed: ClosedSystem
    _chooser: ReadChooser

    def __new__(cls, values: Sequence[Value], closed: ClosedSystem, chooser: ReadChooser) -> Self:
        """Create inputs with given values, except for those to be chosen."""
        found = super().__new__(cls, values)
        found._closed, found._chooser = closed, chooser
        return found

    def __getitem__(self, number):  # type: ignore[no-untyped-def]
        """Read one; slices are not supported."""
        place = self._closed.read_inputs.get(number)
        if place is None:
            return super().__getitem__(number)
        return self._closed.free_inputs[place].values[self._chooser.choose_input(place)]

    def __iter__(self) -> Iterator[Value]:
        """Read all."""
        return (self[number] for number in range(len(self)))


def as_number(ticks: Fraction) -> int:
    """Return an instant in the form of deadlines: an integer, or an equivalent fraction.

    The interpreter only adds and compares deadlines, so it accepts fractions of a tick.
    """
    return ticks.numerator if ticks.denominator == 1 else ticks  # type: ignore[return-value]


def _ports(machine: Machine) -> dict[str, int]:
    """Return the port numbers of operations, which count the events of the source chart."""
    chart = machine.chart
    return {operation.name: n for n, operation in enumerate(chart.operations, len(chart.events))}
