"""Follow a trace: replay the steps of a target in the interpreter, and compare them.

At level 2, a host call is replayed at its end with the recorded results of operations, so that all
data are known. At level 1, and after a loss up to the next snapshot or start, only transitions and
states are known. After a loss even the states are unknown up to the next sync.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.language import Value
from fsmkit.runtime import interpreter, snapshot_bytes
from fsmkit.runtime.interpreter import Macrostep, Occurrence, Snapshot
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.run import (
    at_time,
    max_steps_at_one_time,
    step_eventless,
    step_timer,
)
from fsmkit.runtime.interpreter.snapshot import Post
from fsmkit.runtime.interpreter.trace import active_leaves, value_text
from fsmkit.runtime.recording import LogEntry, log_entries_of
from fsmkit.runtime.tracing import shapes
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.records import (
    TELLS_ALL,
    End,
    EventRecord,
    Gap,
    InputRecord,
    Instance,
    Lost,
    Note,
    RestoreRecord,
    ResultRecord,
    SnapshotRecord,
    Spoilt,
    StartRecord,
    Sync,
    TimeRecord,
    TransitionRecord,
)
from fsmkit.runtime.tracing.stream import Timed

MOST_POSTED = 100_000
"""Maximum number of records of one call."""


@dataclass(frozen=True, slots=True)
class ReplayedStep:
    """A macrostep. ``is_known``: with all data, otherwise with its states only.

    ``machine``: 0, or the number of a machine in a slot if data are unknown.
    """

    at: int
    instance: int
    macrostep: Macrostep
    is_known: bool
    machine: int = 0


@dataclass(frozen=True, slots=True)
class CompleteState:
    """The state of a machine, from a sync or a snapshot instead of a step."""

    at: int
    instance: int
    snapshot: Snapshot
    is_known: bool
    invoked: tuple[Snapshot | None, ...] = ()
    """The machines in slots, by number less one, if data are unknown."""


@dataclass(frozen=True, slots=True)
class Posted:
    """The host posted an event; ``fits``: there was room."""

    at: int
    instance: int
    occurrence: Occurrence
    fits: bool
    snapshot: Snapshot | None


@dataclass(frozen=True, slots=True)
class Changed:
    """An input has another value."""

    at: int
    instance: int
    place: int
    value: Value
    snapshot: Snapshot | None


@dataclass(frozen=True, slots=True)
class Missing:
    """Something is not there; ``where``: ``ring`` (records), ``frame`` (frames) or ``bytes``."""

    at: int
    count: int
    where: str
    why: str = ""


@dataclass(frozen=True, slots=True)
class Divergence:
    """The interpreter and the target differ; the data are unknown from here on."""

    at: int
    instance: int
    message: str


@dataclass(frozen=True, slots=True)
class HostNote:
    """A number of the host."""

    at: int
    instance: int
    number: int


Followed = ReplayedStep | CompleteState | Posted | Changed | Missing | Divergence | HostNote
Item = TransitionRecord | ResultRecord | EventRecord | StartRecord


class _DivergenceError(Exception):
    """The interpreter and the target differ; the message names the difference."""


@dataclass
class _Host:
    """Operations with recorded results, and the events that they posted."""

    chart: Chart
    left: deque[ResultRecord | EventRecord]
    late: list[Occurrence] = field(default_factory=list)
    """Events that were posted after the last call of a step."""
    post: Post | None = None
    """Posts to the machine in the middle of a step; None between steps."""

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the next recorded result; None for an operation without one."""
        del arguments
        self.take_posts()
        found = self.left[0] if self.left else None
        if isinstance(found, ResultRecord) and found.operation == operation:
            self.left.popleft()
            return found.value
        if _has_result(self.chart, operation):
            then = f"`{found.operation}`" if isinstance(found, ResultRecord) else "no operation"
            raise _DivergenceError(f"the interpreter calls `{operation}`; the target called {then}")
        return None

    def accept_posts(self, chart: Chart, post: Post) -> None:
        """Store the function that posts to the machine; invoked machines have their own."""
        if chart is self.chart:
            self.post = post

    def end_step(self) -> list[Occurrence]:
        """Return the events that were posted after the last call of a step."""
        self.post = None
        self.take_posts()
        late, self.late = self.late, []
        return late

    def take_posts(self) -> None:
        """Take the events that were posted before the next result."""
        while self.left and isinstance(self.left[0], EventRecord):
            came = self.left.popleft()
            assert isinstance(came, EventRecord)  # noqa: S101  (checked above)
            occurrence = Occurrence(came.event, came.payload)
            if self.post is None:
                self.late.append(occurrence)
            else:
                self.post(occurrence)

    def delay(self, least: int, greatest: int) -> int:
        """Return the least delay: generated code has no other."""
        del greatest
        return least


def _has_result(chart: Chart, operation: str) -> bool:
    own = any(o.name == operation and o.result is not None for o in chart.operations)
    return own or any(_has_result(each.chart, operation) for each in chart.invocations)


class _Machine:
    """The known state of one machine, and the records of its unfinished host call."""

    def __init__(self, instance: int, numbering: Numbering) -> None:
        self.instance = instance
        self.numbering = numbering
        self.chart = numbering.chart
        self.snapshot: Snapshot | None = None
        """All, if ``is_known``; else the states, if there is one."""
        self.is_known = False
        self.invoked: list[Snapshot | None] = [None] * (len(numbering.machines) - 1)
        """The machines in slots, if data are unknown."""
        self.tells_all = False
        self.inputs: dict[int, Value] = {}
        self.items: list[Item] = []
        self.in_call = False
        """Whether a record of the present call has arrived."""
        self.is_cut = False
        """Whether records of the present call are missing."""

    # --- losses ---------------------------------------------------------------------------

    def lose(self) -> None:
        """Forget: something was lost."""
        self.snapshot, self.is_known = None, False
        self.items.clear()
        self.is_cut = True

    # --- whole states ---------------------------------------------------------------------

    def sync(self, sync: Sync, at: int) -> Iterator[Followed]:
        """Set the states of a sync, or compare them with the known states."""
        self.tells_all = bool(sync.status & TELLS_ALL)
        self.items.clear()  # a sync precedes a call
        self.is_cut = self.in_call = False
        found = self._sync_snapshots(sync, at)
        if found is None:
            self.lose()
            yield Divergence(at, self.instance, "the recorded states cannot be active together")
            return
        whole, invoked = found
        if self.snapshot is not None and self.snapshot.running and whole.running:
            here, there = (active_leaves(self.chart, each) for each in (self.snapshot, whole))
            if here == there:
                self.invoked = self.invoked if self.is_known else invoked
                return
            if self.is_known:
                text = f"the interpreter is in {' '.join(here)}; the target in {' '.join(there)}"
                yield Divergence(at, self.instance, text)
        elif self.is_known and self.snapshot is not None and not whole.running:
            if not self.snapshot.running:
                return
            yield Divergence(at, self.instance, "the target stopped; the interpreter did not")
        self.snapshot, self.invoked, self.is_known = whole, invoked, False
        yield CompleteState(at, self.instance, whole, is_known=False, invoked=tuple(invoked))

    def _sync_snapshots(self, sync: Sync, at: int) -> tuple[Snapshot, list[Snapshot | None]] | None:
        """Return the machines of a sync; None for states that cannot be."""
        found: list[Snapshot | None] = []
        place = 0
        for number, image in enumerate(self.numbering.images):
            count = len(image.plan.regions) + len(image.histories)
            numbers = sync.numbers[place : place + count]
            place += count
            status = sync.status if number == 0 else int(any(numbers))
            fault = sync.fault if number == 0 else 0
            try:
                own = shapes.snapshot_of_sync(image, numbers, status, fault, at)
            except (ValueError, IndexError, KeyError):
                return None
            found.append(own if number == 0 or any(numbers) else None)
        assert found[0] is not None  # noqa: S101  (the first is always there)
        return found[0], found[1:]

    def restore(self, saved: SnapshotRecord, at: int) -> Iterator[Followed]:
        """Set the state of a snapshot, or compare it with the interpreter's if that is known."""
        try:
            found = snapshot_bytes.unpack(self.chart, saved.data, at)
        except FsmkitError as error:
            yield Missing(at, len(saved.data), "bytes", error.diagnostics[0].message)
            return
        if self.is_known and self.snapshot is not None:
            different = self._difference(self.snapshot, found)
            if not different:
                return
            yield Divergence(at, self.instance, f"the target has other data: {different}")
        self.snapshot, self.is_known, self.is_cut = found, True, False
        self.inputs = dict(enumerate(found.inputs))
        yield CompleteState(at, self.instance, found, is_known=True)

    def _difference(self, here: Snapshot, there: Snapshot) -> str:
        """Return the differing variables; inputs are ignored, as they may have changed since."""
        variables = (*self.chart.data, *self.chart.outputs)
        each = zip(variables, here.data, there.data, strict=True)
        return ", ".join(
            f"`{variable.name}` is {value_text(other)}, not {value_text(own)}"
            for variable, own, other in each
            if value_text(own) != value_text(other)
        )

    # --- records of steps ---------------------------------------------------------------------

    def read(self, read: InputRecord, at: int) -> Iterator[Followed]:
        """Take an input."""
        self.in_call = True
        self.inputs[read.place] = read.value
        if self.snapshot is not None and self.is_known:
            inputs = self.snapshot.inputs
            inputs = (*inputs[: read.place], read.value, *inputs[read.place + 1 :])
            self.snapshot = replace(self.snapshot, inputs=inputs)
        known = self.snapshot if self.is_known else None
        yield Changed(at, self.instance, read.place, read.value, known)

    def take_event(self, came: EventRecord, at: int) -> Iterator[Followed]:
        """Post an event that arrived between two calls; otherwise store it for the replay."""
        occurrence = Occurrence(came.event, came.payload)
        if came.is_dispatched or self.in_call:
            self.in_call = True
            self._note(came)
            if not came.is_dispatched and not self.is_known:
                yield Posted(at, self.instance, occurrence, fits=True, snapshot=None)
            return
        fits = True
        if self.is_known and self.snapshot is not None:
            after = interpreter.post(self.chart, self.snapshot, occurrence)
            fits, self.snapshot = after is not None, after or self.snapshot
        known = self.snapshot if self.is_known else None
        yield Posted(at, self.instance, occurrence, fits, known)

    def take_transition(self, took: TransitionRecord, at: int) -> Iterator[Followed]:
        """Take a transition."""
        self.in_call = self.tells_all
        self._note(took)
        if not self.is_known and not self._is_starting:
            yield from self._move(took, at)

    def take_result(self, returned: ResultRecord) -> None:
        """Take a result."""
        self.in_call = True
        self._note(returned)

    def started(self, started: StartRecord, at: int) -> Iterator[Followed]:
        """Take a start."""
        self.in_call = self.tells_all
        if started.machine == 0 and self.tells_all:
            self.items = [started]
            self.is_cut = False
        elif not self.is_known and not self._is_starting:
            yield from self._start(started.machine, at)

    def _note(self, item: Item) -> None:
        if (self.is_known or self._is_starting) and len(self.items) < MOST_POSTED:
            self.items.append(item)

    @property
    def _is_starting(self) -> bool:
        return bool(self.items) and self.items[0] == StartRecord(0)

    def _start(self, machine: int, at: int) -> Iterator[Followed]:
        chart = self.numbering.machines[machine]
        done = shapes.started(chart, at)
        self._put(machine, done.after)
        yield ReplayedStep(at, self.instance, done, is_known=False, machine=machine)

    def _move(self, took: TransitionRecord, at: int) -> Iterator[Followed]:
        """Let a transition move the states, if those before it are known."""
        chart = self.numbering.machines[took.machine]
        held = self.snapshot if took.machine == 0 else self.invoked[took.machine - 1]
        if held is None or took.transition in shapes.default_transitions(chart):
            return
        if chart.transitions[took.transition].source not in held.configuration:
            self._put(took.machine, None)
            yield Divergence(
                at, self.instance, f"transition {took.transition} has an inactive source"
            )
            return
        done = shapes.step_of_transition(chart, held, took.transition, at)
        self._put(took.machine, done.after)
        yield ReplayedStep(at, self.instance, done, is_known=False, machine=took.machine)

    def _put(self, machine: int, snapshot: Snapshot | None) -> None:
        if machine == 0:
            self.snapshot = snapshot
        else:
            self.invoked[machine - 1] = snapshot

    # --- calls ----------------------------------------------------------------------------

    def end(self, at: int) -> Iterator[Followed]:
        """Do a call of the host again."""
        items, self.items = self.items, []
        is_cut, self.is_cut, self.in_call = self.is_cut, False, False
        is_start = bool(items) and items[0] == StartRecord(0)
        if is_cut or not (self.is_known or is_start):
            return
        before = self.snapshot
        try:
            steps = self._replay(items, at, is_start=is_start)
        except (_DivergenceError, FsmkitError) as error:
            told = error.diagnostics[0].message if isinstance(error, FsmkitError) else str(error)
            yield from self._diverge(before, items, at, told)
            return
        for done in steps:
            yield ReplayedStep(done.at, self.instance, done, is_known=True)
        after = steps[-1].after if steps else before
        self.snapshot, self.is_known = after and at_time(after, at), True

    def _diverge(
        self, before: Snapshot | None, items: Iterable[Item], at: int, message: str
    ) -> Iterator[Followed]:
        """Report a divergence and continue with the recorded states."""
        self.is_known = False
        self.snapshot = before and shapes.without_data(self.chart, before)
        self.invoked = [None] * len(self.invoked)
        yield Divergence(at, self.instance, message)
        for item in items:
            if item == StartRecord(0):
                yield from self._start(0, at)
            elif isinstance(item, TransitionRecord) and item.machine == 0:
                yield from self._move(item, at)

    def _replay(self, items: list[Item], at: int, *, is_start: bool) -> list[Macrostep]:
        """Return the macrosteps of a call; raises `_DivergenceError` if they differ.

        An event posted before a result enters the queue at the operation's call, or after the
        macrostep.
        """
        chart, steps = self.chart, list[Macrostep]()
        dispatched = [i for i in items if isinstance(i, EventRecord) and i.is_dispatched]
        left = (
            i for i in items if isinstance(i, ResultRecord | EventRecord) and i not in dispatched
        )
        host = _Host(chart, deque(left))
        if is_start:
            inputs = tuple(
                self.inputs.get(place, value)
                for place, value in enumerate(interpreter.initial(chart).inputs)
            )
            done: Iterable[Macrostep] = (interpreter.start(chart, at, host, inputs),)
        elif self.snapshot is None:
            done = ()
        elif dispatched:
            event = Occurrence(dispatched[0].event, dispatched[0].payload)
            running = self.snapshot.running
            dispatch = interpreter.dispatch(chart, self.snapshot, event, at, host)
            done = (dispatch[0],) if running else ()
        else:
            done = _run(chart, self.snapshot, at, host)
        for step in done:
            after = step.after
            for occurrence in host.end_step():
                after = interpreter.post(chart, after, occurrence) or after
            steps.append(step if after is step.after else replace(step, after=after))
        self._compare(items, steps)
        return steps

    def _compare(self, items: Iterable[Item], steps: Iterable[Macrostep]) -> None:
        """Stop at the first thing that the target did differently."""
        every = (each for step in steps for each in log_entries_of(self.chart, step))
        here = [each for each in every if each.operation is None or each.result is not None]
        there = [
            LogEntry(item.machine, transition=item.transition)
            if isinstance(item, TransitionRecord)
            else LogEntry(item.machine, item.operation, item.value)
            for item in items
            if isinstance(item, TransitionRecord | ResultRecord)
        ]
        for place in range(max(len(here), len(there))):
            one = here[place] if place < len(here) else None
            other = there[place] if place < len(there) else None
            if one != other:
                raise _DivergenceError(
                    f"the interpreter does: {one or 'nothing more'}; "
                    f"the target did: {other or 'nothing more'}"
                )


def _run(chart: Chart, snapshot: Snapshot, now: int, host: _Host) -> Iterator[Macrostep]:
    """Yield the macrosteps of `interpreter.run`, with the events that arrive during it."""
    current = at_time(snapshot, now)

    def late() -> Snapshot:
        host.post = None
        host.take_posts()
        found = current
        for occurrence in host.late:
            found = interpreter.post(chart, found, occurrence) or found
        return found

    if index_of(chart).samples_inputs:
        tried = step_eventless(chart, current, host)
        if tried is not None:
            current = tried.after
            current = late()
            yield tried
    allowance = len(current.queue) + len(current.deferred) + chart.capacities.microsteps
    at_once = 0
    while current.running and at_once <= max_steps_at_one_time(chart):
        following = interpreter.step_event(chart, current, host) if allowance > 0 else None
        if following is not None:
            allowance -= 1
        else:
            due = interpreter.next_deadline(current)
            if due is None or due > now:
                break
            following = step_timer(chart, current, host)
            allowance = chart.capacities.microsteps
            at_once += 1
        if following is None:
            break
        current = following.after
        current = late()
        yield following


class Follower:
    """Follows all machines of a trace."""

    def __init__(self) -> None:
        self.machines: dict[int, _Machine] = {}
        """The machines by instance, once a sync has identified their charts."""

    def follow(self, timed: Timed, numbering: Numbering | None) -> Iterator[Followed]:
        """Yield the meaning of a trace item; ``numbering``: of the machine's chart."""
        told, at, instance = timed.told, timed.at, timed.instance
        match told:
            case Lost(count):
                yield from self._lose(at, count, "ring")
            case Gap(frames):
                yield from self._lose(at, frames, "frame")
            case Spoilt(size, why):
                yield from self._lose(at, size, "bytes", why)
            case Note(number):
                yield HostNote(at, instance, number)
            case TimeRecord() | Instance():
                pass
            case _ if numbering is not None:
                yield from self._follow_machine(instance, numbering, timed)
            case _:
                pass

    def _lose(self, at: int, count: int, where: str, why: str = "") -> Iterator[Followed]:
        for machine in self.machines.values():
            machine.lose()
        yield Missing(at, count, where, why)

    def _follow_machine(
        self, instance: int, numbering: Numbering, timed: Timed
    ) -> Iterator[Followed]:
        machine = self.machines.get(instance)
        if machine is None or machine.numbering is not numbering:
            machine = self.machines[instance] = _Machine(instance, numbering)
        match timed.told:
            case Sync() as sync:
                yield from machine.sync(sync, timed.at)
            case SnapshotRecord() as saved:
                yield from machine.restore(saved, timed.at)
            case RestoreRecord():
                machine.lose()
            case InputRecord() as read:
                yield from machine.read(read, timed.at)
            case EventRecord() as came:
                yield from machine.take_event(came, timed.at)
            case TransitionRecord() as took:
                yield from machine.take_transition(took, timed.at)
            case ResultRecord() as returned:
                machine.take_result(returned)
            case StartRecord() as started:
                yield from machine.started(started, timed.at)
            case End():
                yield from machine.end(timed.at)
            case _:
                pass
