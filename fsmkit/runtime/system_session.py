"""Run a system on a simulated clock: one of the runs that `check` explores.

The schedule is fixed. The machines of the environment run first, then each machine in the order of
the file until it is quiet. When all are quiet, the clock advances to the next deadline.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from random import Random

from fsmkit.chart.chart import Chart, every_operation
from fsmkit.diagnostics import Text
from fsmkit.language import Value
from fsmkit.language.values import tokens
from fsmkit.runtime.driving import driven
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.globals import Guard
from fsmkit.runtime.interpreter.macrostep import initial, start
from fsmkit.runtime.interpreter.run import (
    at_time,
    dispatch,
    livelock_error,
    max_steps_at_one_time,
    next_deadline,
    post,
    run,
    step_eventless,
)
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.script import (
    SeededHost,
    is_received,
    read_event,
    read_results,
    unknown_name,
    wrong_line,
)
from fsmkit.runtime.session import occurrence_of, values_by_name
from fsmkit.system.schedule import time_unit
from fsmkit.system.shared import has_data_trigger, kept_at_start, written_value
from fsmkit.system.system import System

Answer = Callable[[tuple[Value, ...]], Value | None]


@dataclass(frozen=True, slots=True)
class Happening:
    """A macrostep of a machine of the system, by name."""

    machine: str
    macrostep: snap.Macrostep


class _Host:
    """Answers the operations of a machine."""

    def __init__(
        self,
        answers: Mapping[str, Answer],
        defaults: Mapping[str, Value | None],
        random: Random,
        watch: Guard | None,
        chart: Chart,
    ) -> None:
        self._chart = chart
        self.post: snap.Post | None = None
        """Posts to the machine in the middle of a step; None between steps."""
        self._random = random
        self._answers = answers
        self._defaults = defaults
        if watch is not None:
            self.guard = watch

    def accept_posts(self, chart: Chart, post: snap.Post) -> None:
        """Store the function that posts to the machine; invoked machines have their own."""
        if chart is self._chart:
            self.post = post

    def delay(self, least: int, greatest: int) -> int:
        """Return how long a delay takes that a chart gives as an interval."""
        return self._random.randint(least, greatest)

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the given result of an operation, or the operation's default."""
        if operation in self._answers:
            return self._answers[operation](arguments)
        return self._defaults[operation]


@contextmanager
def _step(host: snap.Host) -> Iterator[None]:
    """Let operations post to their machine during a step."""
    try:
        yield
    finally:
        if isinstance(host, _Host):
            host.post = None


class SystemSession:
    """All machines of a system, wired, on one simulated clock."""

    def __init__(
        self,
        system: System,
        answers: Mapping[str, Mapping[str, Answer]] | None = None,
        *,
        seed: int = 0,
        watch: Guard | None = None,
        hosts: Sequence[snap.Host] = (),
    ):
        """Create the machines; ``answers`` gives results by machine and operation.

        ``seed`` picks the delays that environment charts give as intervals. ``watch`` evaluates
        guards, to observe their decisions. ``hosts`` replaces the host of each machine, including
        delays and without ``watch``.
        """
        random = Random(seed)  # noqa: S311  (no secret)
        self.system = system
        self.now = 0
        """Ticks since the start."""
        self.observers: list[Callable[[int, tuple[snap.Macrostep, ...]], object]] = []
        """Called whenever a machine, by its place, changed, with the steps that it did."""
        self._charts = [machine.chart for machine in system.machines]
        self._names = [machine.name for machine in system.machines]
        self._snapshots = [initial(chart) for chart in self._charts]
        given = answers or {}
        self._hosts: Sequence[snap.Host] = hosts or [
            _Host(
                given.get(machine.name, {}),
                {name: one.default for name, one in every_operation(machine.chart).items()},
                random,
                watch,
                machine.chart,
            )
            for machine in system.machines
        ]
        self._order = sorted(
            range(len(self._charts)), key=lambda m: not system.machines[m].environment
        )

    # --- looking -------------------------------------------------------------------------------

    def snapshot(self, machine: str) -> snap.Snapshot:
        """Return a machine as it is."""
        return self._snapshots[self._names.index(machine)]

    def active(self, machine: str) -> tuple[str, ...]:
        """Return the active leaves of a machine, in document order."""
        index = self._names.index(machine)
        return tuple(active_leaves(self._charts[index], self._snapshots[index]))

    def is_in(self, machine: str, state: str) -> bool:
        """Whether a state of a machine is active."""
        index = self._names.index(machine)
        return self._charts[index].state_index[state] in self._snapshots[index].configuration

    def value(self, machine: str, name: str) -> object:
        """Return a variable of a machine, as a Python value."""
        index = self._names.index(machine)
        return values_by_name(self._charts[index], self._snapshots[index])[name]

    @property
    def snapshots(self) -> tuple[snap.Snapshot, ...]:
        """All machines as they are, in the order of the system."""
        return tuple(self._snapshots)

    # --- doing ---------------------------------------------------------------------------------

    def start(self) -> list[Happening]:
        """Start all machines and run them until they are quiet."""
        for index in self._order:
            self._drive(index, None)
        done: list[Happening] = []
        pending: list[tuple[int, snap.Macrostep]] = []
        for index in self._order:
            chart, host = self._charts[index], self._hosts[index]
            before = self._snapshots[index]
            kept = kept_at_start(self.system.machines[index], before.data)
            with _step(host):
                first = start(chart, self.now, host, before.inputs, given=kept)
            self._snapshots[index] = first.after
            self._drive(index, before)
            done.append(Happening(self._names[index], first))
            pending.append((index, first))
        for index, first in pending:
            self._deliver(index, first)
        for index, first in pending:
            self._notify(index, (first,))
        done += self._settle()
        return done

    def post(self, machine: str, event: str, **payload: object) -> bool:
        """Put an event in the queue of a machine; False if there is no room or it does not run."""
        chart = self._charts[self._names.index(machine)]
        return self.enqueue(machine, occurrence_of(chart, event, (), payload))

    def enqueue(self, machine: str, occurrence: snap.Occurrence) -> bool:
        """Put an event in the queue of a machine, as `post` does; an operation may, too."""
        index = self._names.index(machine)
        host = self._hosts[index]
        if isinstance(host, _Host) and host.post is not None:
            return host.post(occurrence)
        after = post(self._charts[index], self._snapshots[index], occurrence)
        if after is not None:
            self._snapshots[index] = after
            self._notify(index)
        return after is not None

    def dispatch(
        self, machine: str, occurrence: snap.Occurrence
    ) -> tuple[list[Happening], bool, Value | None]:
        """Let a machine process an event ahead of its queue; then run until all are quiet.

        Return the steps, whether the event enabled a transition, and the reply, if any.
        """
        index = self._names.index(machine)
        before = self._snapshots[index]
        if not before.running:
            return [], False, None
        host = self._hosts[index]
        with _step(host):
            one, is_handled, reply = dispatch(
                self._charts[index], before, occurrence, self.now, host
            )
        self._snapshots[index] = one.after
        self._deliver(index, one)
        self._drive(index, before)
        return [Happening(machine, one), *self._settle()], is_handled, reply

    def drive(self, machine: str, number: int, value: Value) -> None:
        """Set an external input of a machine; higher numbers select its shared variables."""
        index = self._names.index(machine)
        target = self.system.machines[index]
        self._snapshots[index] = driven(target, self._snapshots[index], number, value)
        self._notify(index)

    def run(self, until: int) -> list[Happening]:
        """Run the machines up to a time in ticks; return the steps in order."""
        done = self._settle()
        while (deadline := self._next_deadline()) is not None and deadline <= until:
            self.now = deadline
            done += self._settle()
        self.now = until
        return done

    def _next_deadline(self) -> int | None:
        deadlines = [next_deadline(s) for s in self._snapshots if s.running]
        return min((due for due in deadlines if due is not None), default=None)

    def _settle(self) -> list[Happening]:
        """Run machine after machine until none has anything to do."""
        done: list[Happening] = []
        moved = True
        most = sum(map(max_steps_at_one_time, self._charts))
        while moved:
            moved = False
            for index in self._order:
                happened = list(self._run_one(index))
                done += happened
                if len(done) > most:
                    raise livelock_error(self._charts[index], [h.macrostep for h in happened])
                moved = moved or bool(happened)
                if happened:
                    break  # the environment reacts before other machines continue
        return done

    def _run_one(self, index: int) -> Iterator[Happening]:
        before = self._snapshots[index]
        macrosteps = self._macrosteps(index)
        if not macrosteps:
            self._snapshots[index] = at_time(before, self.now)
            return
        self._snapshots[index] = macrosteps[-1].after
        for macrostep in macrosteps:
            self._deliver(index, macrostep)
            yield Happening(self._names[index], macrostep)
        self._drive(index, before)
        self._notify(index, macrosteps)

    def _notify(self, index: int, macrosteps: tuple[snap.Macrostep, ...] = ()) -> None:
        for observer in self.observers:
            observer(index, macrosteps)

    def _macrosteps(self, index: int) -> tuple[snap.Macrostep, ...]:
        chart, host = self._charts[index], self._hosts[index]
        machine, snapshot = self.system.machines[index], at_time(self._snapshots[index], self.now)
        with _step(host):
            if machine.shared and snapshot.running and has_data_trigger(machine, chart):
                tried = step_eventless(chart, snapshot, host)
                if tried is not None:
                    return (tried,)
            return run(chart, snapshot, self.now, host)

    def _drive(self, source: int, before: snap.Snapshot | None) -> None:
        """Copy changed outputs and shared variables of a machine to the machines that read them."""
        machine, chart = self.system.machines[source], self._charts[source]
        for link in self.system.input_links:
            if link.source != source:
                continue
            value = written_value(machine, chart, self._snapshots[source].data, link.output)
            if before is None or value != written_value(machine, chart, before.data, link.output):
                target = self._snapshots[link.target]
                self._snapshots[link.target] = driven(
                    self.system.machines[link.target], target, link.input, value
                )

    def _deliver(self, source: int, macrostep: snap.Macrostep) -> None:
        """Deliver the sent events and called operations of a macrostep."""
        chart = self._charts[source]
        operations = [o.name for o in chart.operations]
        for effect in macrostep.effects:
            match effect:
                case snap.Emitted(snap.Occurrence(event, payload)):
                    port, values = event, payload
                case snap.Called(operation, arguments):
                    port, values = len(chart.events) + operations.index(operation), arguments
                case _:
                    continue
            for link in self.system.event_links:
                if (link.source, link.port) == (source, port):
                    sent = snap.Occurrence(link.event, tuple(values[n] for n in link.arguments))
                    target: snap.Snapshot = self._snapshots[link.target]
                    after = post(self._charts[link.target], target, sent)
                    self._snapshots[link.target] = target if after is None else after


KNOWN = "use `start`, `post MACHINE.EVENT`, `returns MACHINE.OPERATION VALUE` or `run NOW`"


class SystemPlayer:
    """A system under a script.

    Its lines are ``start``, ``post MACHINE.EVENT``, ``returns MACHINE.OPERATION v1 v2`` and
    ``run NOW`` (in ticks).
    """

    def __init__(self, system: System, seed: int) -> None:
        """Create the machines; operations return pseudo-random values."""
        time_unit(system)  # raises unless all machines have the same tick
        self.system = system
        self.charts = {machine.name: machine.chart for machine in system.machines}
        self.tick = system.machines[0].chart.capacities.tick
        self._hosts = {name: SeededHost(chart, seed) for name, chart in self.charts.items()}
        self._session = SystemSession(system, hosts=[*self._hosts.values()])
        self._is_started = False

    @property
    def now(self) -> int:
        """Ticks since the start."""
        return self._session.now

    def snapshot(self, machine: str) -> snap.Snapshot:
        """Return a machine as it is."""
        return self._session.snapshot(machine)

    def play(self, line: Text) -> Iterator[tuple[str, snap.Macrostep | str]]:
        """Execute a line; yield its macrosteps and trace lines, each with its machine."""
        verb, _, rest = line.value.strip().partition(" ")
        words = iter(tokens(rest))
        done: list[Happening] = []
        match verb:
            case "start":
                if self._is_started:
                    raise wrong_line(line, "a system is started once", "remove the line")
                if next(words, "0") != "0":
                    raise wrong_line(line, "the time of a system starts at 0", "write `start`")
                self._is_started = True
                done = self._session.start()
            case "post":
                machine, occurrence = read_post(self.charts, line)
                words = iter(())
                if not self._session.enqueue(machine, occurrence):
                    yield machine, "full queue"
            case "returns":
                machine, operation, results = read_machine_results(self.charts, line)
                words = iter(())
                host = self._hosts[machine]
                host.given = {**host.given, operation: results}
            case "run":
                done = self._session.run(self._time(next(words, ""), line))
            case verb:
                raise wrong_line(line, f"`{verb}` is not a script line of a system", KNOWN)
        if next(words, None) is not None:
            raise wrong_line(line, "there are words left at the end of the line", KNOWN)
        yield from ((each.machine, each.macrostep) for each in done)

    def _time(self, word: str, line: Text) -> int:
        if not word.isdecimal():
            raise wrong_line(line, f"`{word}` is not a number", KNOWN)
        if int(word) < self.now:
            raise wrong_line(line, f"it is {self.now} already", "let time go on")
        return int(word)


def machine_of(names: Iterable[str], whole: str) -> str:
    """Return the machine of ``MACHINE.EVENT``: the longest name that is a prefix, or ""."""
    named = [name for name in names if whole.startswith(f"{name}.")]
    return max(named, key=len, default=whole.partition(".")[0])


def read_post(charts: Mapping[str, Chart], line: Text) -> tuple[str, snap.Occurrence]:
    """Read ``post MACHINE.EVENT`` and the fields of the event; `FsmkitError` for a wrong line."""
    machine, event, rest = _machine_part(charts, line, "event")
    known = [each.name for each in charts[machine].events if is_received(each)]
    if event not in known:
        raise unknown_name(line, f"event of `{machine}`", event, known)
    return machine, read_event(charts[machine], iter((event, *tokens(rest))), line)


def read_machine_results(
    charts: Mapping[str, Chart], line: Text
) -> tuple[str, str, tuple[Value, ...]]:
    """Read ``returns MACHINE.OPERATION`` and the results; `FsmkitError` for a wrong line."""
    machine, operation, rest = _machine_part(charts, line, "operation")
    words = iter((operation, *tokens(rest)))
    return machine, *read_results(charts[machine], words, line)


def _machine_part(charts: Mapping[str, Chart], line: Text, kind: str) -> tuple[str, str, str]:
    """Split ``VERB MACHINE.NAME REST``; return the machine, the name and the rest.

    The name of a machine may hold brackets and dots: ``m[0].in``, ``one.out>m[0].in.put``.
    """
    _, whole, *rest = [*line.value.split(maxsplit=2), ""]
    machine = machine_of(charts, whole)
    if machine == whole:
        help_ = f"write `machine.{kind}`; the machines are {', '.join(charts)}"
        raise wrong_line(line, f"`{whole}` names no {kind} of a machine", help_)
    if machine not in charts:
        raise unknown_name(line, "machine", machine, list(charts))
    return machine, whole[len(machine) + 1 :], " ".join(rest)
