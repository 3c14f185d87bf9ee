"""The steps of a machine from a state, by the reference interpreter, and what they must lead to.

A state is a settled snapshot of an untimed exploration (`verify.statespace`): timers are armed or
not. Each step has concrete deadlines. Pending timers have their whole delay left (`FAR`), or expire
one tick later (`NEAR`). Each pending timer is also the first one to expire, once.
"""

from __future__ import annotations

import struct
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, product
from math import prod
from random import Random

import fsmkit.language as lang
import fsmkit.runtime.interpreter as interpreter
from fsmkit.chart.analysis.partition import Partition, Place
from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.codegen.c.names import Names
from fsmkit.plan.image import FAULTS, head, image_of, sealed
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.run import (
    next_deadline,
    step_event,
    step_eventless,
    step_timer,
)
from fsmkit.runtime.snapshot_bytes import pack_machine
from fsmkit.system.partition import field_of
from fsmkit.verify.certify.calls import (
    BUSY,
    FULL,
    LOOKING,
    NESTING,
    PLAIN,
    POSTING,
    CallingHost,
    Manner,
    Result,
    Sight,
    counted,
    packed,
    results_of,
)
from fsmkit.verify.certify.encoding import Machine, Values
from fsmkit.verify.certify.program import ALMOST_FULL, counts, looks, seen_data, single_steps
from fsmkit.verify.statespace.actions import Chooser, ReadChooser
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.coverage import Coverage
from fsmkit.verify.statespace.local_steps import LocalSteps
from fsmkit.verify.statespace.sessions import timers_within, waiting_count

START, DISPATCH, POST, RUN, OBSERVE, REBASE, STEP_EVENTLESS, STEP_EVENT, STEP_TIMER = range(9)
"""The actions of ``driver.h``."""
NOW = 5_000_000
"""The time of the states that steps start from, in ticks."""
WRAPS = 2**32
"""The clock of a machine wraps around after so many ticks."""
REPEATED = 64
"""One in so many steps is repeated with other values."""
MOST_POSTED = 30
"""The number of events that a step posts at most: their results are bits of one number."""
MOST_COUNTED = 65535
"""The greatest value of a counter of a machine."""
LATE = 2
"""The ticks from a state to a late call of `run`: its first timer has expired one tick before."""
FAR, NEAR = "far", "near"
BEYOND = 1_000
"""Ticks until a pending delayed send whose delay the chart computes."""
MOST_UNREAD = 64
"""At most so many combinations of inputs that the interpreter does not read."""
MOST_INPUT_BYTES = 0x4000
"""The bytes of all combinations of inputs in one request."""
MOST_VARYING = 31
"""Inputs from this number on share a bit (``driver.h``)."""
MOST_KEPT = 4096
"""The sets of inputs whose combinations are kept."""


@dataclass(frozen=True, slots=True)
class Expected:
    """The required result of a step."""

    trace: bytes
    returned: int
    saved: bytes
    """The saved machine without its checksum, with the inputs of the state."""
    after: snap.Snapshot | None
    """The settled state that follows; None for an observation."""


@dataclass(frozen=True, slots=True)
class Step:
    """One request: its bytes, what it must lead to, and what people call it."""

    request: bytes
    expected: Expected
    name: str
    """The kind of step, such as ``dispatch start``; maxima are per name."""
    is_explored: bool = True
    """False for a repetition with other values: its state counts as that of the first."""
    is_measured: bool = True
    """False if the host acts during calls, whose costs are its own, or for steps of tools."""
    count: int = 1
    """The combinations of inputs with which it is taken."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Steps from one state with concrete deadlines."""

    saved: bytes
    now: int
    steps: Iterator[Step]
    """Each is taken by the interpreter when it is requested."""


@dataclass(frozen=True, slots=True)
class _Action:
    """An action of the host at a state."""

    kind: int
    name: str
    now: int
    events: tuple[snap.Occurrence, ...] = ()
    manner: Manner = PLAIN


class Steps:
    """Enumerates the steps of a chart."""

    def __init__(
        self,
        chart: Chart,
        closed: ClosedSystem,
        names: Names,
        partition: Partition,
        seed: int,
        most_choices: int,
        absent: Sequence[str] = (),
    ) -> None:
        """Take the chart, its exploration, its names in C and its classes of values.

        ``most_choices``: the sequences of inputs and results that are tried for one action at a
        state. ``absent``: the functions of the machine that are not called.
        """
        self.most_choices = most_choices
        self.absent = tuple(absent)
        self._runs = names.does.runs and "run" not in absent
        self._posts = names.does.queued and self._runs and "post" not in absent
        self._partition = partition
        self._random = Random(seed)  # noqa: S311  (no secrets)
        self._picks: Random | _Bound = self._random
        """Chooses values of a class."""
        self._operations = {o.name: o for c in charts_within(chart) for o in c.operations}
        self.chart = chart
        self.closed = closed
        self.local = LocalSteps(closed)
        self.names = names
        self.machine = Machine(names, count())
        self.coverage = Coverage(set(), set())
        self.truncated: set[str] = set()
        """The names of steps with more choices than were tried."""
        self.interpreted = 0
        """The number of steps that the interpreter took, without repetitions."""
        self._inputs = Values([lang.Field(each.name, each.type) for each in chart.inputs], names)
        self._image = image_of(chart)
        self._head = head(chart)
        self._combined: dict[tuple[tuple[int, int], ...], list[tuple[int, bytes]]] = {}
        self._start = interpreter.initial(chart)
        self.events = [each for each in closed.possible if not each.spontaneous]
        self._numbers = {name: n for n, name in enumerate(FAULTS)}
        self._counts = counts(names)
        self._queued = names.does.queued
        seen = seen_data(names)
        self._data = Values(seen, names) if seen else None
        self._single = [each for each in single_steps(names) if each not in self.absent]
        self._nested = self._excluded()
        self._looks = looks(names)
        self._configurations: set[frozenset[int]] = set()
        """The configurations from which single steps were taken."""
        self._kinds: set[Hashable] = set()
        """The kinds of steps that were repeated."""

    def initial(self) -> snap.Snapshot:
        """Return the state before the start."""
        return self._start

    def batches(self, state: snap.Snapshot) -> Iterator[Batch]:
        """Yield all steps of a state."""
        armed = timers_within(self.chart, state)
        timed = self.timed(state, FAR)
        actions = [*self._actions(state, timed.now), *self._later(timed)]
        yield self._batch(timed, actions)
        if state.configuration not in self._configurations:
            self._configurations.add(state.configuration)
            yield self._single_batch(timed)
        if armed:
            near = self.timed(state, NEAR)
            yield self._batch(near, [*self._actions(state, near.now), *self._later(near)])
        for place in range(len(armed)) if state.running and self._runs else ():
            first = self.timed(state, FAR, first=place)
            name = f"timeout {_timer_name(*armed[place])}"
            yield self._batch(first, [_Action(RUN, name, first.now + LATE)])
        varied = self._varied(state, actions)
        if varied is not None:
            yield varied

    def timed(self, state: snap.Snapshot, how: str, first: int = -1) -> snap.Snapshot:
        """Return a state with deadlines; ``first``: the timer that expires next, after a tick."""
        left = [
            1 if number == first or how == NEAR else 1 + LATE + _delay(chart, timer)
            for number, (chart, timer) in enumerate(timers_within(self.chart, state))
        ]
        return with_deadlines(state, NOW, left)

    def _actions(self, state: snap.Snapshot, now: int) -> Iterator[_Action]:
        """Yield what a host can do at the time of a state."""
        yield _Action(OBSERVE, "observe", now)
        if "rebase" not in self.absent:
            yield _Action(REBASE, "rebase", now)
        yield _Action(START, "start", now)
        if self._runs:
            yield _Action(RUN, "run", now)
        if waiting_count(self.chart, state):
            return
        for possible in self.events:
            occurrence = snap.Occurrence(possible.event, possible.payload)
            name = self.chart.events[possible.event].name
            if "dispatch" not in self.absent:
                yield _Action(DISPATCH, f"dispatch {name}", now, (occurrence,))
            if self._posts:
                yield _Action(POST, f"post {name}", now, (occurrence,))

    def _later(self, timed: snap.Snapshot) -> Iterator[_Action]:
        """Yield what happens when time passes: nothing just before a deadline, then all timers."""
        due = next_deadline(timed)
        if due is None or not timed.running or not self._runs:
            return
        if due - 1 > timed.now:
            yield _Action(RUN, "run", due - 1)
        else:
            yield _Action(RUN, "timeouts", due)

    def _batch(self, state: snap.Snapshot, actions: Sequence[_Action]) -> Batch:
        steps = (step for action in actions for step in self.steps(state, action))
        return Batch(sealed(self._saved(state)), state.now, steps)

    def _single_batch(self, state: snap.Snapshot) -> Batch:
        """Take the single steps of `run` from a state, with events in its queue if it can."""
        before = state
        for event in self.events[-2:] if self._posts else ():
            occurrence = snap.Occurrence(event.event, event.payload)
            before = interpreter.post(self.chart, before, occurrence) or before
        steps = (
            replace(step, is_explored=False, is_measured=False)
            for number, name in enumerate(("step_eventless", "step_event", "step_timer"))
            if name in self._single
            for step in self.steps(before, _Action(STEP_EVENTLESS + number, name, before.now))
        )
        return Batch(sealed(self._saved(before)), before.now, steps)

    def _saved(self, state: snap.Snapshot) -> bytes:
        """Return a saved machine without its checksum."""
        return self._head + pack_machine(self._image, state)

    # --- repetitions with other values ----------------------------------------------------------

    def _varied(self, state: snap.Snapshot, actions: Sequence[_Action]) -> Batch | None:
        """Repeat 1 of `REPEATED` steps, at least one, with other values of the same classes.

        The times left are others, too, and the clock may wrap around.

        Besides, several events are posted at once, more than the queue holds in some steps.
        """
        chosen = [each for each in actions if self._random.random() * REPEATED < 1]
        does_post = self._posts and bool(self.events)
        if does_post and state.running:
            chosen.append(_Action(POST, "post several events", 0, self._several()))
        chosen = [each for each in chosen or [self._random.choice(actions)] if each.kind < OBSERVE]
        if not chosen:
            return None
        now = self._random.choice((NOW, 0, WRAPS - 1, WRAPS - 2, self._random.randrange(WRAPS)))
        longest = [1 + _delay(chart, timer) for chart, timer in timers_within(self.chart, state)]
        left = [self._random.choice((1, most, self._random.randint(1, most))) for most in longest]
        timed = with_deadlines(state, now, left)
        due = next_deadline(timed)
        steps = []
        for action in chosen:
            at = now if due is None or self._random.random() < 0.5 else due
            events = tuple(map(self._other_event, action.events))
            varied = replace(action, now=at, events=events)
            host = VariedHost(self)
            inputs = self._other_inputs(self._any_inputs())
            expected, results = self.perform(replace(timed, inputs=inputs), varied, host)
            one, rest = _combination(self._inputs.encode(inputs)), self._events(varied) + results
            step = _step(varied, expected, _head(varied), one, rest)
            steps.append(replace(step, is_explored=False))
        saved = self._saved(replace(timed, inputs=self._start.inputs))
        return Batch(sealed(saved), now, iter(steps))

    def _several(self) -> tuple[snap.Occurrence, ...]:
        """Return several events: two, more than the queue holds, or any number between."""
        most = min(self.chart.capacities.queue + 2, MOST_POSTED)
        count_ = self._random.choice((2, most, self._random.randint(1, most)))
        many = (self._random.choice(self.events) for _ in range(count_))
        return tuple(snap.Occurrence(each.event, each.payload) for each in many)

    def _any_inputs(self) -> list[lang.Value]:
        counts = (len(free.values) for free in self.closed.free_inputs)
        return self._chosen(tuple(self._random.randrange(count) for count in counts))

    def _other_inputs(self, values: Sequence[lang.Value]) -> tuple[lang.Value, ...]:
        return tuple(
            self._other(each.type, Place(0, "variable", each.name), value)
            for each, value in zip(self.chart.inputs, values, strict=True)
        )

    def _other_event(self, occurrence: snap.Occurrence) -> snap.Occurrence:
        fields = self.chart.events[occurrence.event].fields
        payload = tuple(
            self._other(each.type, field_of(0, occurrence.event, number), value)
            for number, (each, value) in enumerate(zip(fields, occurrence.payload, strict=True))
        )
        return snap.Occurrence(occurrence.event, payload)

    def _other(self, type_: lang.Type, place: Place, value: lang.Value) -> lang.Value:
        """Return another value of the class of a value: a bound of it, or any between."""
        bounds = self._partition.alike(type_, place, value)
        if bounds is None:
            return value
        first, last = bounds
        found = self._picks.choice((first, last, self._picks.randint(first, last)))
        return bool(found) if isinstance(type_, lang.BoolType) else found

    def result(self, operation: str) -> lang.Value | None:
        """Return a result of an operation, of any class."""
        values = self.closed.results[0].get(operation)
        if values is None:
            return None
        return self._other_result(operation, self._random.choice(values))

    def _other_result(self, operation: str, value: lang.Value | None) -> lang.Value | None:
        """Return another result of the class of a result."""
        declared = self._operations[operation]
        if value is None or operation not in self.closed.results[0]:
            return value
        if declared.tried or declared.result is None:
            return value
        return self._other(declared.result, Place(0, "result", operation), value)

    # --- one action ----------------------------------------------------------------------------

    def steps(self, state: snap.Snapshot, action: _Action) -> Iterator[Step]:
        """Yield an action with every choice of inputs and results."""
        head_, events = _head(action), self._events(action)
        if action.kind in (OBSERVE, REBASE):
            trace = self._observed(state) if action.kind == OBSERVE else b""
            trace += self._counters(0, 0, action)
            expected = Expected(trace, 0, self._saved(state), None)
            one = _combination(self._inputs.encode(self._chosen(())))
            step = _step(action, expected, head_, one, b"")
            yield replace(step, is_measured=action.kind == OBSERVE)
            return
        chooser = self.local.chooser(0)
        for _ in range(self.most_choices):
            self.interpreted += 1
            expected, results = self.perform(state, action, chooser)
            read = chooser.inputs_read if isinstance(chooser, ReadChooser) else {}
            for count_, inputs in self._combinations(read):
                yield _step(action, expected, head_, inputs, events + results, count_)
            yield from self._repetitions(state, action, read)
            if not chooser.advance():
                return
        if action.kind < OBSERVE:  # single steps are a sample
            self.truncated.add(action.name)

    def _repetitions(
        self, state: snap.Snapshot, action: _Action, read: dict[int, int]
    ) -> Iterator[Step]:
        """Repeat the latest step, unless one of its kind was repeated.

        It is taken later, with other values, and with hosts that act.

        Steps are of one kind if they have the same action, transitions, exits and entries.
        """
        done, unhandled, rejected = self._latest
        small = [each for macrostep in done for each in macrostep.microsteps]
        kind = (
            action.name,
            tuple((each.transitions, each.exited, each.entered) for each in small),
            unhandled,
            rejected,
        )
        if kind in self._kinds:
            return
        self._kinds.add(kind)
        results = tuple(results_of(done))
        inputs = self._chosen(next(self._rows(read)))
        yield self._repeated(state, replace(action, now=action.now + 1), inputs, results)
        for bound in (_Bound(0), _Bound(1)):
            yield from self._at_bound(bound, state, action, inputs, results)
        calls = any(
            isinstance(effect, snap.Called | snap.Emitted | snap.InvokedMacrostep)
            for each in small
            for effect in each.effects
        )
        if calls or unhandled or rejected:
            for manner in self._manners(calls=calls):
                yield self._repeated(state, replace(action, manner=manner), inputs, results)

    def _at_bound(
        self,
        bound: _Bound,
        state: snap.Snapshot,
        action: _Action,
        inputs: Sequence[lang.Value],
        results: Sequence[Result],
    ) -> Iterator[Step]:
        """Repeat a step with bounds of the classes of its values, unless they are its values."""
        self._picks = bound
        events = tuple(map(self._other_event, action.events))
        others = self._other_inputs(inputs)
        returned = tuple((name, self._other_result(name, value)) for name, value in results)
        self._picks = self._random
        if (events, others, returned) != (action.events, tuple(inputs), tuple(results)):
            yield self._repeated(state, replace(action, events=events), others, returned)

    def _repeated(
        self,
        state: snap.Snapshot,
        action: _Action,
        inputs: Sequence[lang.Value],
        results: Iterable[Result],
    ) -> Step:
        """Return a step with these inputs and results; its host acts in the action's manner."""
        looked = partial(self._looked, now=action.now, is_calling=True)
        sight = Sight(looked, self._nested, self._looks)
        host = CallingHost(self.chart, action.manner, sight, results, self.result)
        expected, given = self.perform(replace(state, inputs=tuple(inputs)), action, host)
        manner = self._manner(action.manner)
        one, rest = _combination(self._inputs.encode(inputs)), self._events(action) + given
        step = _step(action, expected, _head(action), one, manner + rest)
        return replace(step, is_explored=False, is_measured=action.manner is PLAIN)

    def _manners(self, *, calls: bool) -> Iterator[Manner]:
        """Yield what hosts do in the repetitions of a step."""
        if not calls or not self.events:
            yield Manner(FULL | LOOKING)
            return
        one, other, third = self._random.choices(self.events, k=3)
        yield Manner(FULL | LOOKING | NESTING, snap.Occurrence(one.event, one.payload))
        if self._posts:
            most = self.chart.capacities.queue + 2
            yield Manner(
                LOOKING | POSTING, snap.Occurrence(other.event, other.payload), 1, min(most, 255)
            )
            yield Manner(
                FULL | POSTING, snap.Occurrence(third.event, third.payload),
                min(most, 255), min(most, 255),
            )  # fmt: skip

    def _manner(self, manner: Manner) -> bytes:
        if manner.event is None:
            return b""
        return bytes([manner.posts, manner.most]) + self.machine.event(manner.event)

    def _events(self, action: _Action) -> bytes:
        count_ = bytes([len(action.events)]) if action.kind == POST else b""
        return count_ + b"".join(map(self.machine.event, action.events))

    def _chosen(self, inputs: tuple[int, ...]) -> list[lang.Value]:
        """Return the values of all inputs for choices of the free ones."""
        values = list(self._start.inputs)
        for free, choice in zip(self.closed.free_inputs, inputs, strict=False):
            values[free.input] = free.values[choice]
        return values

    def _combinations(self, read: dict[int, int]) -> list[tuple[int, bytes]]:
        """Return the combinations of inputs for a step that reads some, by requests.

        An item has the number of its combinations and their bytes (``driver.h``).
        """
        key = tuple(read.items())
        found = self._combined.get(key)
        if found is None:
            if len(self._combined) >= MOST_KEPT:
                self._combined.clear()
            numbers = (
                free.input
                for place, free in enumerate(self.closed.free_inputs)
                if place not in read
            )
            varying = 0
            for number in numbers:
                varying |= 1 << min(number, MOST_VARYING)
            rows = [self._inputs.encode(self._chosen(row)) for row in self._rows(read)]
            most = max(1, MOST_INPUT_BYTES // max(1, len(rows[0])))
            parts = [rows[at : at + most] for at in range(0, len(rows), most)]
            found = self._combined[key] = [
                (len(part), _combination(*part, varying=varying)) for part in parts
            ]
        return found

    def _rows(self, read: dict[int, int]) -> Iterator[tuple[int, ...]]:
        """Yield the choices of all inputs: those read are fixed, the others take all values.

        If there are many combinations, each value of each input occurs in one.
        """
        counts = [
            range(read[place], read[place] + 1) if place in read else range(len(free.values))
            for place, free in enumerate(self.closed.free_inputs)
        ]
        if prod(map(len, counts)) <= MOST_UNREAD:
            yield from product(*counts)
            return
        for row in range(max(map(len, counts))):
            yield tuple(each[row % len(each)] for each in counts)

    def perform(
        self, state: snap.Snapshot, action: _Action, chooser: Chooser | VariedHost | CallingHost
    ) -> tuple[Expected, bytes]:
        """Take a step in the interpreter; return what it leads to and the results of calls."""
        snapshot = state
        if isinstance(chooser, Chooser):
            chooser.start_step()
            snapshot = self.local.with_inputs(state, chooser)
        chart, reply, returned = self.chart, b"", 0
        done: Sequence[snap.Macrostep]
        match action.kind:
            case 0:  # START
                done = (interpreter.start(chart, action.now, chooser, snapshot.inputs),)
                after = done[0].after
            case 1:  # DISPATCH
                (event,) = action.events
                done, after = (), snapshot
                returned = STOPPED
                if snapshot.running:
                    one, is_handled, value = interpreter.dispatch(
                        chart, snapshot, event, action.now, chooser
                    )
                    done, after, returned = (one,), one.after, int(is_handled)
                    reply = self.machine.reply(value)
            case 2:  # POST
                for number, event in enumerate(action.events):
                    posted = interpreter.post(chart, snapshot, event)
                    if posted is not None:
                        snapshot, returned = posted, returned | 1 << number
                done, after = _run(chart, snapshot, action.now, chooser)
            case 6 | 7 | 8:
                done = self._single_step(action.kind, snapshot, chooser)
                after = done[-1].after if done else snapshot
                returned = int(any(map(_has_acted, done)) if action.kind == 6 else bool(done))
            case _:  # RUN
                done, after = _run(chart, snapshot, action.now, chooser)
        for macrostep in done:
            self.coverage.add(macrostep)
        after = replace(interpreter.at_time(after, action.now), inputs=self._start.inputs)
        unhandled, rejected = counted(done)
        if action.kind == POST:
            rejected += len(action.events) - returned.bit_count()
        self._latest = done, unhandled, rejected
        reports = chooser.reports if isinstance(chooser, CallingHost) else ()
        trace, results = self.machine.trace(done, reports)
        counters = self._counters(unhandled, rejected, action)
        saved = self._saved(after)
        settled = self.local.settled(0, after)
        if (
            settled.fault is not None and settled.fault not in FAULTS
        ):  # the C knows no kinds of them
            settled = replace(settled, fault="error.execution")
        return Expected(trace + reply + counters, returned, saved, settled), results

    def _single_step(
        self, kind: int, state: snap.Snapshot, host: snap.Host
    ) -> tuple[snap.Macrostep, ...]:
        """Return the macrostep of a single step; none if it has no effect."""
        if not state.running:
            return ()
        if kind == STEP_EVENTLESS:
            samples = index_of(self.chart).samples_inputs
            done = step_eventless(self.chart, state, host) if samples else None
        elif kind == STEP_EVENT:
            done = step_event(self.chart, state, host)
        else:
            done = step_timer(self.chart, state, host)
        return () if done is None else (done,)

    def _counters(self, unhandled: int, rejected: int, action: _Action) -> bytes:
        """Return the counters after a step, empty if they are not compared."""
        if not self._counts:
            return b""
        first = ALMOST_FULL if action.manner.bits & FULL and action.kind != START else 0
        numbers = (unhandled, rejected) if self._queued else (unhandled,)
        return packed([min(first + number, MOST_COUNTED) for number in numbers])

    def _observed(self, state: snap.Snapshot) -> bytes:
        """Return what the functions that look at a machine must report between steps."""
        armed = state if state.running else replace(state, timers=(), invoked=())
        return self._looked(armed, state.now)

    def _looked(self, state: snap.Snapshot, now: int, *, is_calling: bool = False) -> bytes:
        """Return what the functions that look at a machine must report.

        ``is_calling``: the machine calls its host. Then the root is not compared: between exit and
        entry its state depends on the generated code. With machines in slots, the next deadline is
        not compared either: their timers may have changed.
        """
        has_deadline = not (is_calling and self.chart.invocations)
        states = range(int(is_calling), len(self.chart.states))
        leaves = sorted(index_of(self.chart).leaves & state.configuration)
        within = sum(1 << each for each in states if self._is_in(state, each))
        fault = 0 if state.fault is None else self._numbers.get(state.fault, 4)
        due = next_deadline(state) if has_deadline else None
        left = 0 if due is None else (due - now) % WRAPS
        deadline = struct.pack("<BI", due is not None, left) if has_deadline else b""
        rooms = [leaves[:room] + [0] * len(leaves[room:]) for room in (0, 1, len(leaves))]
        parts = {
            "active": b"".join(packed([len(leaves), *seen]) for seen in rooms),
            "in": within.to_bytes(len(self.chart.states) + 7 >> 3, "little"),
            "finished": bytes([state.finished]),
            "fault": bytes([fault]),
            "next_deadline": deadline,
        }
        found = b"".join(part for name, part in parts.items() if name not in self.absent)
        return found + (b"" if self._data is None else self._data.encode(state.data))

    def _is_in(self, state: snap.Snapshot, number: int) -> bool:
        return state.running if number == 0 else number in state.configuration

    def _excluded(self) -> bytes:
        """Return the results of the functions that a step excludes, as the driver calls them."""
        found = bytes([BUSY]) if "dispatch" not in self.absent else b""
        return found + bytes(len(self._single))


STOPPED = 3
"""``FSM_STOPPED``."""


class VariedHost:
    """The host of a repeated step: operations return any values of their classes."""

    def __init__(self, steps: Steps) -> None:
        """Take the source of values."""
        self._steps = steps

    def call(self, operation: str, arguments: tuple[lang.Value, ...]) -> lang.Value | None:
        """Return the result of an operation (the `Host` of a step)."""
        del arguments
        return self._steps.result(operation)


@dataclass(frozen=True, slots=True)
class _Bound:
    """Chooses a bound of each class in place of a random value: 0 for the first, 1 for the last."""

    place: int

    def choice(self, values: tuple[int, int, int]) -> int:
        """Return one of first, last and any."""
        return values[self.place]

    def randint(self, first: int, last: int) -> int:
        """Return any value."""
        del last
        return first


def _has_acted(done: snap.Macrostep) -> bool:
    """Return whether a step without an event took a transition or an internal event."""
    return any(small.transitions or small.event is not None for small in done.microsteps)


def _head(action: _Action) -> bytes:
    return struct.pack("<BIB", action.kind, action.now % WRAPS, action.manner.bits)


def _combination(*inputs: bytes, varying: int = 0) -> bytes:
    return struct.pack("<HI", len(inputs), varying) + b"".join(inputs)


def _step(
    action: _Action, expected: Expected, start: bytes, inputs: bytes, rest: bytes, count_: int = 1
) -> Step:
    body = start + inputs + rest
    request = len(body).to_bytes(2, "little") + body
    return Step(request, expected, action.name, count=count_)


def _run(
    chart: Chart, snapshot: snap.Snapshot, now: int, chooser: snap.Host
) -> tuple[tuple[snap.Macrostep, ...], snap.Snapshot]:
    done = interpreter.run(chart, snapshot, now, chooser)
    return done, done[-1].after if done else snapshot


def _delay(chart: Chart, timer: snap.Timer) -> int:
    """Return the whole delay of a timer."""
    if isinstance(timer.what, snap.Timeout):
        return chart.transitions[timer.what.transition].delay
    return BEYOND


def _timer_name(chart: Chart, timer: snap.Timer) -> str:
    if isinstance(timer.what, snap.Timeout):
        source = chart.states[chart.transitions[timer.what.transition].source]
        return f"in {source.id}"
    return f"of {chart.events[timer.what.occurrence.event].name}"


def with_deadlines(state: snap.Snapshot, now: int, left: Iterable[int]) -> snap.Snapshot:
    """Return a state at a time, with the time left of its timers and those within."""
    return _with_deadlines(state, now, iter(left))


def _with_deadlines(state: snap.Snapshot, now: int, rest: Iterator[int]) -> snap.Snapshot:
    timers = [snap.Timer(now + next(rest), timer.what) for timer in state.timers]
    invoked = tuple(
        None if child is None else _with_deadlines(child, now, rest) for child in state.invoked
    )
    timers.sort(key=lambda timer: timer.deadline)
    return replace(state, timers=tuple(timers), now=now, invoked=invoked)
