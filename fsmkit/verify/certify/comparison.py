"""Execute every reachable step of a chart in all executions, and compare them.

The interpreter, the C on this computer and the C in the emulator take the same steps. A chart is
explored breadth first, so the path to each state is a shortest one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.partition import partition_of
from fsmkit.verify.certify.emulator import Emulator, StepError
from fsmkit.verify.certify.host import MOST_REQUESTS, Answers, HostMachine
from fsmkit.verify.certify.layout import Translation
from fsmkit.verify.certify.program import Program
from fsmkit.verify.certify.steps import Batch, Step, Steps
from fsmkit.verify.statespace.closed_system import ClosedSystem, close

LIMIT = 20_000_000
"""The steps after which a certificate is partial, by default."""
MOST_DIFFERENCES = 10
"""Differences that are reported before the comparison ends."""
MOST_SAVED = 0x400000
"""The bytes of the saved machines of a packet (``host.c``)."""
MOST_STEPS = 20_000
"""The steps of a packet."""
MOST_CHOICES = 65_536
"""The sequences of inputs and results that are tried for one action at a state."""
INPUTS_CHANGED, INPUTS_MATTER = 1 << 30, 1 << 31
"""Flags of an answer (``driver.h``)."""
LIMIT_REACHED, TIME_OVER = "limit", "timeout"
Progress = Callable[[int, int, int], None]
"""Called now and then with states, states left, and steps."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request for a certificate.

    ``command``: the compiler with its flags; empty for the compiler of this computer. ``firmware``:
    an ELF file that contains the machine. ``form``: the value of ``--optimize``. ``timeout``:
    seconds, 0 for no limit.
    """

    command: tuple[str, ...] = ()
    firmware: Path | None = None
    limit: int = LIMIT
    timeout: float = 0
    form: str = ""
    prefix: str | None = None
    parameters: Mapping[str, str] = field(default_factory=dict)
    """The values of ``--set`` with which the chart was read."""
    seed: int = 1


@dataclass(frozen=True, slots=True)
class Difference:
    """A step whose executions differ."""

    step: str
    path: tuple[str, ...]
    what: str


@dataclass(frozen=True, slots=True)
class Packet:
    """Steps from one state with concrete deadlines, few enough for the memory of the driver."""

    saved: bytes
    now: int
    steps: list[Step]


@dataclass(slots=True)
class Maximum:
    """The greatest numbers of a kind of step, each with the state and the step that has it."""

    instructions: int = 0
    stack: int = 0
    cycles: int = 0
    state: int = 0


@dataclass(slots=True)
class Seconds:
    """The time spent in each execution."""

    interpreter: float = 0
    host: float = 0
    emulator: float = 0


@dataclass(slots=True)
class Comparison:
    """The result of a comparison."""

    program: Program
    closed: ClosedSystem
    steps: Steps
    states: list[snap.Snapshot]
    parents: list[tuple[int, str]]
    explored: int = 0
    taken: int = 0
    emulated: int = 0
    """The steps that the emulator took, repetitions included."""
    repeated: int = 0
    stopped: str = ""
    """The bound that ended the comparison before its end: ``limit``, ``timeout``, or empty."""
    is_complete: bool = False
    differences: list[Difference] = field(default_factory=list)
    maxima: dict[str, Maximum] = field(default_factory=dict)
    seconds: Seconds = field(default_factory=Seconds)

    def path(self, state: int) -> tuple[str, ...]:
        """Return the names of the steps of a shortest path to a state."""
        found: list[str] = []
        while state > 0:
            state, name = self.parents[state]
            found.append(name)
        return tuple(reversed(found))


@dataclass(frozen=True, slots=True)
class Executions:
    """The machine on this computer and, perhaps, in the emulator."""

    host: HostMachine
    emulator: Emulator | None
    to: Translation | None
    """Translates machines of this computer for the emulator."""
    back: Translation | None
    own: Translation | None
    """Clears what is no member in machines of this computer."""
    size: int
    saved: int


def compare(
    chart: Chart,
    program: Program,
    executions: Executions,
    request: Request,
    progress: Progress | None,
    absent: Sequence[str] = (),
) -> Comparison:
    """Explore a chart and compare all executions of each step.

    ``absent``: the functions of the machine that are not called.
    """
    found = exploration(chart, program, request, absent)
    for number, packet in packets(found, request, executions.saved, progress):
        _execute(found, executions, number, packet)
    is_whole = not found.stopped and not steps_left(found)
    found.is_complete = is_whole and not found.differences
    return found


def steps_left(found: Comparison) -> list[str]:
    """Return the names of steps that were not taken with all inputs and results."""
    return sorted(found.steps.truncated)


def reasons(found: Comparison, request: Request) -> list[str]:
    """Return why a comparison is partial, a sentence without its full stop each."""
    left = f"{len(found.states) - found.explored:,} of {len(found.states):,} states are left"
    said = []
    match found.stopped:
        case "limit":
            said.append(f"the limit of {request.limit:,} steps is reached, {left}")
        case "timeout":
            said.append(f"the time of {request.timeout:g} s is over, {left}")
    if names := steps_left(found):
        most = found.steps.most_choices
        listed = ", ".join(f"`{name}`" for name in names)
        said.append(
            f"one step reads more than {most:,} combinations of inputs and results: {listed}"
        )
    return said


def exploration(
    chart: Chart, program: Program, request: Request, absent: Sequence[str] = ()
) -> Comparison:
    """Return a comparison before its first step."""
    system = replace(system_of(chart), properties=())
    closed = close(system, untimed=True, keeps_dead=True)
    partition = partition_of(system)
    most_choices = min(request.limit, MOST_CHOICES)
    steps = Steps(chart, closed, program.names, partition, request.seed, most_choices, absent)
    return Comparison(program, closed, steps, [steps.initial()], [(0, "")])


def packets(
    found: Comparison, request: Request, saved: int, progress: Progress | None = None
) -> Iterator[tuple[int, Packet]]:
    """Explore breadth first; yield the number of a state and steps from it, which are then taken.

    Stops between two steps, whatever the state, as soon as a bound of the request is reached.
    ``saved``: the bytes that this computer saves for each step.
    """
    numbers = {found.states[0]: 0}
    bounds = _Bounds(found, request)
    for number, state in enumerate(found.states):
        steps = (
            packet
            for batch in found.steps.batches(state)
            for packet in _packets(batch, saved, bounds)
        )
        for packet in _timed(found, steps):
            yield number, packet
            for step in packet.steps:
                after = step.expected.after
                if after is not None and step.is_explored and after not in numbers:
                    numbers[after] = len(found.states)
                    found.states.append(after)
                    found.parents.append((number, step.name))
            if len(found.differences) >= MOST_DIFFERENCES:
                return
        if found.stopped:
            return
        found.explored = number + 1
        if progress is not None:
            progress(len(found.states), len(found.states) - number - 1, found.taken)


def _timed(found: Comparison, steps: Iterator[Packet]) -> Iterator[Packet]:
    """Yield packets, and note the time that the interpreter takes for them."""
    while True:
        start = time.perf_counter()
        packet = next(steps, None)
        found.seconds.interpreter += time.perf_counter() - start
        if packet is None:
            return
        yield packet


class _Bounds:
    """The bounds of a request: steps and time."""

    def __init__(self, found: Comparison, request: Request) -> None:
        """Start the time."""
        self._found = found
        self._limit = request.limit
        self._end = time.monotonic() + request.timeout if request.timeout else 0.0

    def is_reached(self, prepared: int) -> bool:
        """Return whether a bound is reached, with steps that are prepared and not taken yet."""
        found = self._found
        if found.taken + prepared >= self._limit:
            found.stopped = LIMIT_REACHED
        elif self._end and time.monotonic() > self._end:
            found.stopped = TIME_OVER
        return bool(found.stopped)


def _packets(batch: Batch, saved: int, bounds: _Bounds) -> Iterator[Packet]:
    """Divide a batch into parts that fit the memory of the driver, until a bound is reached."""
    most = min(MOST_STEPS, MOST_SAVED // saved)
    part: list[Step] = []
    size = explored = 0
    for step in batch.steps:
        is_end = bounds.is_reached(explored)
        if part and (is_end or len(part) >= most or size + len(step.request) > MOST_REQUESTS):
            yield Packet(batch.saved, batch.now, part)
            part, size, explored = [], 0, 0
        if is_end:
            return
        part.append(step)
        explored += step.count if step.is_explored else 0
        size += len(step.request)
    if part:
        yield Packet(batch.saved, batch.now, part)


def _execute(found: Comparison, executions: Executions, number: int, packet: Packet) -> None:
    """Take the steps of a packet in the C, and compare."""
    requests = b"".join(step.request for step in packet.steps)
    started = time.perf_counter()
    try:
        answers = executions.host.answer(packet.saved, packet.now, requests, executions.size)
    except FsmkitError as error:
        what = error.diagnostics[0].message
        found.differences.append(Difference(packet.steps[0].name, found.path(number), what))
        raise
    found.seconds.host += time.perf_counter() - started
    found.taken += sum(step.count for step in packet.steps if step.is_explored)
    found.repeated += sum(not step.is_explored for step in packet.steps)
    found.differences += (
        Difference(step.name, found.path(number), what)
        for step, what in against_interpreter(executions, packet, answers)
    )
    if executions.emulator is not None:
        _emulate(found, executions, number, packet, requests, answers)


def against_interpreter(
    executions: Executions, packet: Packet, answers: Answers
) -> Iterator[tuple[Step, str]]:
    """Yield the steps in which the C on this computer differs from the interpreter."""
    data, saved, each, at = answers.answers, answers.saved, executions.saved, 0
    for number, step in enumerate(packet.steps):
        expected = step.expected
        length = int.from_bytes(data[at : at + 4], "little")
        returned = int.from_bytes(data[at + 4 : at + 8], "little")
        kept = saved[number * each + 1 : (number + 1) * each - 4]
        what = ""
        if data[at + 8 : at + 8 + length] != expected.trace:
            what = "calls and outgoing events differ"
        elif returned & INPUTS_MATTER:
            what = "an input matters that the interpreter does not read"
        elif returned & INPUTS_CHANGED:
            what = "inputs are changed"
        elif returned != expected.returned:
            what = f"returned values differ: {returned} instead of {expected.returned}"
        elif kept != expected.saved:
            what = "configuration, data, queues or timers differ"
        elif saved[number * each]:
            what = "the machine cannot be saved"
        if what:
            yield step, f"interpreter and C on this computer: {what}"
        at += _answer_size(length, executions.size)


def _answer_size(trace: int, machine: int) -> int:
    return 8 + trace + -trace % 4 + machine + -machine % 4


def _emulate(
    found: Comparison,
    executions: Executions,
    number: int,
    packet: Packet,
    requests: bytes,
    answers: Answers,
) -> None:
    """Take the steps of a packet in the emulator, compare and note maxima."""
    emulator, to = executions.emulator, executions.to
    assert emulator is not None  # noqa: S101
    assert to is not None  # noqa: S101
    started = time.perf_counter()
    state = answers.state if to.is_same else to.translate(answers.state)
    try:
        other = emulator.answer(state, requests)
    except StepError as error:
        step = packet.steps[min(error.request, len(packet.steps) - 1)]
        found.differences.append(
            Difference(step.name, found.path(number), f"the emulated machine {error.why}")
        )
        found.seconds.emulator += time.perf_counter() - started
        return
    found.seconds.emulator += time.perf_counter() - started
    found.emulated += emulator.taken_steps
    if not (to.is_same and other == answers.answers):
        found.differences += (
            Difference(step.name, found.path(number), what)
            for step, what in _against_host(executions, packet, answers.answers, other)
        )
    records = emulator.records()
    for place, step in enumerate(packet.steps):
        if not step.is_measured:
            continue
        maximum = found.maxima.get(step.name)
        if maximum is None:
            maximum = found.maxima[step.name] = Maximum(state=number)
        instructions, cycles, stack = records[3 * place : 3 * place + 3]
        if instructions > maximum.instructions:
            maximum.instructions, maximum.state = instructions, number
        maximum.cycles = max(maximum.cycles, cycles)
        maximum.stack = max(maximum.stack, stack)


def _against_host(
    executions: Executions, packet: Packet, own: bytes, other: bytes
) -> Iterator[tuple[Step, str]]:
    """Yield the steps in which both binaries differ, members of the machine compared one by one."""
    back, same, to = executions.back, executions.own, executions.to
    assert back is not None  # noqa: S101
    assert same is not None  # noqa: S101
    assert to is not None  # noqa: S101
    at = there = 0
    for step in packet.steps:
        length, length_there = (
            int.from_bytes(data[place : place + 4], "little")
            for data, place in ((own, at), (other, there))
        )
        begin, begin_there = (8 + size + -size % 4 for size in (length, length_there))
        what = ""
        if own[at + 8 : at + 8 + length] != other[there + 8 : there + 8 + length_there]:
            what = "calls and outgoing events differ"
        elif own[at + 4 : at + 8] != other[there + 4 : there + 8]:
            what = "returned values differ"
        else:
            machine = own[at + begin : at + begin + executions.size]
            machine_there = other[there + begin_there : there + begin_there + to.target.size]
            if same.translate(machine) != back.translate(machine_there):
                what = "the bytes of the machine differ"
        if what:
            yield step, f"C on this computer and C in the emulator: {what}"
        at += _answer_size(length, executions.size)
        there += _answer_size(length_there, to.target.size)
