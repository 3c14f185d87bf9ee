"""Read what a machine in C recorded: its ring of transitions and its log (see ``fsm_trace.h``).

The interpreter replays a log and compares its own steps with those of the C.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.language import Field, Value
from fsmkit.plan.image import Image, codes, head, image_of, size_of
from fsmkit.runtime.interpreter import Macrostep
from fsmkit.runtime.interpreter.snapshot import (
    Called,
    InvokedMacrostep,
    Occurrence,
    Post,
    Snapshot,
    Taken,
)
from fsmkit.runtime.interpreter.trace import trace_lines, value_text
from fsmkit.runtime.script import Player, read_line, script_texts
from fsmkit.runtime.snapshot_bytes import unpack_values

RING = b"FST\x01"
RECORD = struct.Struct("<IHHHH")
TIMEOUT = 0xFFFF
START, RUN, DISPATCH, POST, CALLED, TAKEN, END, RESTORE = range(1, 9)
"""``fsm_log_kind``."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """An entry of the log: a call of an operation with its result, or a transition taken."""

    machine: int
    """0, or the number of a machine in a slot (see `machines_of`)."""
    operation: str | None = None
    result: Value | None = None
    transition: int = 0

    def __str__(self) -> str:
        where = f"machine {self.machine}: " if self.machine else ""
        if self.operation is None:
            return f"{where}transition {self.transition} taken"
        tail = "" if self.result is None else f" = {value_text(self.result)}"
        return f"{where}{self.operation} called{tail}"


@dataclass(frozen=True, slots=True)
class Call:
    """A call by the host as lines of a script, with the log entries of its step in order."""

    lines: tuple[str, ...]
    at: int
    """Offset in the log, in bytes."""
    was_refused: bool = False
    """Whether the queue rejected the posted event."""
    happened: list[LogEntry] = field(default_factory=list)
    posted: list[tuple[int, str]] = field(default_factory=list)
    """Events that operations posted, each with the number of calls completed before it."""

    @property
    def operations(self) -> list[LogEntry]:
        """Return the calls of operations."""
        return [each for each in self.happened if each.operation is not None]


def machines_of(chart: Chart) -> tuple[Chart, ...]:
    """Return a chart and the charts of its slots, in depth-first order."""
    within = (machines_of(invocation.chart) for invocation in chart.invocations)
    return (chart, *(inner for charts in within for inner in charts))


# --- the ring ---------------------------------------------------------------------------------


def ring_lines(chart: Chart, data: bytes) -> Iterator[str]:
    """Yield a line for each transition of a dumped ring, preceded by the number of lost records."""
    if not data.startswith(RING) or (len(data) - 8) % RECORD.size:
        raise _unreadable("it is not a dump of a ring", len(data))
    (count,) = struct.unpack_from("<I", data, 4)
    records = list(RECORD.iter_unpack(data[8:]))
    if count > len(records):
        yield f"({count - len(records)} before these)"
    charts = machines_of(chart)
    for time, instance, machine, event, transition in records:
        if machine >= len(charts) or transition >= len(charts[machine].transitions):
            raise _unreadable(f"`{chart.name}` has no transition {transition}", 0)
        of = charts[machine]
        cause = "timeout" if event == TIMEOUT else "-"
        if 0 < event <= len(of.events):
            cause = of.events[event - 1].name
        source = of.states[of.transitions[transition].source].id
        targets = " ".join(of.states[state].id for state in of.transitions[transition].targets)
        where = f"{instance}.{machine}" if machine else f"{instance}"
        yield f"@{time} {where} {cause}: t {transition} {source} -> {targets or source}"


# --- the log ----------------------------------------------------------------------------------


def host_calls(chart: Chart, data: bytes, instance: int | None = None) -> Iterator[Call]:
    """Yield the host's calls of one machine: that of `instance`, or the first one of the chart.

    An incomplete record at the end of the log is ignored. Raises `FsmkitError` if `data` is not a
    log, or is the log of another chart.
    """
    begin = 0
    if instance is None:
        begin, instance = _first_machine(chart, data)
    reader = CallReader({instance: chart}, begin)
    yield from (call for _, call in reader.feed(data[begin:]))
    yield from (call for _, call in reader.unfinished())


def _first_machine(chart: Chart, data: bytes) -> tuple[int, int]:
    """Return the offset of the first machine of a chart in the log, and its instance."""
    for kind, body, at in _records(data):
        if kind in (START, RESTORE) and _is_machine_of(chart, kind, body):
            return at, int.from_bytes(body[:2], "little")
    raise fail(
        "foreign-log",
        f"the log contains neither a start nor a restoration of a `{chart.name}`",
        help="log from the start on, and replay with the chart that was compiled",
    )


class CallReader:
    """Read the host's calls from a log, in pieces of any size.

    Args:
        charts: Charts of the machines, by instance; other machines are skipped.
        at: Offset of the first piece in the log, for findings.

    """

    def __init__(self, charts: Mapping[int, Chart], at: int = 0) -> None:
        self._images = {
            number: tuple(map(image_of, machines_of(chart))) for number, chart in charts.items()
        }
        self._at = at
        self._left = b""
        self._open: list[tuple[int, Call | None]] = []

    def feed(self, data: bytes) -> Iterator[tuple[int, Call]]:
        """Yield each completed call with its instance; raises `FsmkitError` like `host_calls`.

        Exhaust the iterator before the next call.
        """
        data = self._left + data
        end = 0
        for kind, body, at in _records(data):
            end = at + 3 + len(body)
            yield from self._take(kind, body, self._at + at)
        self._at += end
        self._left = data[end:]

    def unfinished(self) -> Iterator[tuple[int, Call]]:
        """Yield the calls that have started and not ended."""
        yield from ((number, call) for number, call in self._open if call is not None)

    def _take(self, kind: int, body: bytes, at: int) -> Iterator[tuple[int, Call]]:
        if kind in (START, RUN, DISPATCH, POST, RESTORE):
            number = int.from_bytes(body[:2], "little")
            images = self._images.get(number)
            chart = images[0].chart if images else None
            if (
                chart is not None
                and kind in (START, RESTORE)
                and not _is_machine_of(chart, kind, body)
            ):
                raise fail(
                    "foreign-log",
                    f"the log is of another chart than `{chart.name}` as it is now",
                    help="replay it with the chart that the machine was compiled from",
                )
            call = _call(images[0], kind, body[2:], at) if images else None
            around = self._open[-1][1] if self._open and self._open[-1][0] == number else None
            if kind not in (POST, RESTORE):
                self._open.append((number, call))
            elif kind == POST and call is not None and around is not None:
                event = call.lines[0].removeprefix("post ")
                around.posted.append((len(around.operations), event))
            elif call is not None:
                yield number, call
        elif kind == END and self._open:
            number, ended = self._open.pop()
            if ended is not None:
                yield number, ended
        elif self._open:
            number, open_ = self._open[-1]
            if open_ is not None:
                open_.happened.append(_log_entry(self._images[number], kind, body, at))


def _is_machine_of(chart: Chart, kind: int, body: bytes) -> bool:
    """Return whether a record of a start or restoration is of a machine of `chart`."""
    start = head(chart)
    return body.endswith(start[4:]) if kind == START else body[6:].startswith(start)


def _records(data: bytes) -> Iterator[tuple[int, bytes, int]]:
    at = 0
    while at + 3 <= len(data):
        kind, size = struct.unpack_from("<BH", data, at)
        if not START <= kind <= RESTORE:
            raise _unreadable(f"records of kind {kind} do not exist", at)
        if at + 3 + size > len(data):
            return
        yield kind, data[at + 3 : at + 3 + size], at
        at += 3 + size


def _unreadable(why: str, at: int) -> FsmkitError:
    return fail(
        "unreadable-log", f"the log cannot be read at byte {at}: {why}",
        help="store all bytes passed to `fsm_log_write`, in order",
    )  # fmt: skip


def _call(image: Image, kind: int, body: bytes, at: int) -> Call:
    try:
        if kind == POST:
            return Call((f"post {_event(image, body[1:])}",), at, was_refused=body[0] == 0)
        (now,) = struct.unpack_from("<I", body)
        if kind == RESTORE:
            return Call((f"restore {now} {body[4:].hex()}",), at)
        inputs = tuple(Field(v.name, v.type) for v in image.chart.inputs)
        size = size_of(codes(inputs))
        values = unpack_values(image, inputs, body[4 : 4 + size])
        pairs = zip(inputs, values, strict=True)
        lines = [f"input {each.name} {value_text(value)}" for each, value in pairs]
        if kind == DISPATCH:
            lines.append(f"at {now}")
            lines.append(f"dispatch {_event(image, body[4 + size :])}")
        else:
            lines.append(f"{'start' if kind == START else 'run'} {now}")
    except (ValueError, IndexError, struct.error) as error:
        raise _unreadable(str(error), at) from error
    return Call(tuple(lines), at)


def _event(image: Image, body: bytes) -> str:
    (number,) = struct.unpack_from("<H", body)
    if not 0 < number <= len(image.chart.events):
        raise ValueError("the host gave the machine an event that the chart does not have")
    event = image.chart.events[number - 1]
    values = unpack_values(image, event.fields, body[2:])
    return " ".join((event.name, *map(value_text, values)))


def _log_entry(images: Sequence[Image], kind: int, body: bytes, at: int) -> LogEntry:
    try:
        machine, number = struct.unpack_from("<HH", body)
        if kind == TAKEN:
            return LogEntry(machine, transition=number)
        image = images[machine]
        operation = image.chart.operations[number]
        if operation.result is None:
            return LogEntry(machine, operation.name)
        (result,) = unpack_values(image, (Field("result", operation.result),), body[4:])
    except (ValueError, IndexError, struct.error) as error:
        raise _unreadable(str(error), at) from error
    return LogEntry(machine, operation.name, result)


class DivergenceError(Exception):
    """The interpreter calls an operation that the machine in C did not call then."""


@dataclass
class LogHost:
    """A host whose operations return the results in a log; they must be called in its order."""

    left: list[LogEntry] = field(default_factory=list)
    posts: list[tuple[int, Occurrence]] = field(default_factory=list)
    """Events to post, each with the number of calls completed before it."""
    ended: int = 0
    state: int = 0
    """Seed for scripts; unused with a log."""
    chart: Chart | None = None
    post: Post | None = None

    def accept_posts(self, chart: Chart, post: Post) -> None:
        """Store the function that posts to the machine; invoked machines have their own."""
        if chart is self.chart:
            self.post = post

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Return the result of the next call in the log, after the events that it posts."""
        del arguments
        while self.post is not None and self.posts and self.posts[0][0] <= self.ended:
            self.post(self.posts.pop(0)[1])
        self.ended += 1
        if not self.left or self.left[0].operation != operation:
            raise DivergenceError(operation)
        return self.left.pop(0).result

    def delay(self, least: int, greatest: int) -> int:
        """Return the minimum delay; generated code has no other."""
        del greatest
        return least


@dataclass(frozen=True, slots=True)
class ReplayedLine:
    """A script line replayed from the log, its macrosteps, and the machine afterwards."""

    line: str
    results: tuple[Macrostep | str, ...]
    after: Snapshot
    now: int
    """Ticks; not wrapped."""


def replay(chart: Chart, data: bytes, instance: int | None = None) -> Iterator[str]:
    """Yield the interpreter's trace of a log; raises `FsmkitError` if it diverges from the C."""
    for performed in replay_lines(chart, data, instance):
        for result in performed.results:
            if isinstance(result, str):
                yield result
            else:
                yield from trace_lines(chart, (result,))


def replay_lines(chart: Chart, data: bytes, instance: int | None = None) -> Iterator[ReplayedLine]:
    """Replay a log in the interpreter; raises `FsmkitError` if it diverges from the C."""
    repeater = Replayer(chart)
    for call in host_calls(chart, data, instance):
        yield from repeater.repeat(call)


class Replayer:
    """Replays the calls of a machine in C, and requires equal steps."""

    def __init__(self, chart: Chart) -> None:
        self.player = Player(chart)
        self._host = LogHost(chart=chart)
        self.player.host = self._host  # type: ignore[assignment]

    def repeat(self, call: Call) -> Iterator[ReplayedLine]:
        """Yield the result of each line of a call.

        Raises `FsmkitError` (``replay-parts``) if the steps differ from those of the C.
        """
        self._host.left, self._host.ended = call.operations, 0
        self._host.posts = [(ended, self._event(event)) for ended, event in call.posted]
        steps: list[Macrostep] = []
        refused = False
        try:
            for line in script_texts(call.lines, "<log>"):
                results = self.player.play(line)
                refused = refused or "full queue" in results
                steps += [result for result in results if isinstance(result, Macrostep)]
                yield ReplayedLine(line.value, results, self.player.snapshot, self.player.now)
            late = call.posted[len(call.posted) - len(self._host.posts) :]
            for line in script_texts([f"post {event}" for _, event in late], "<log>"):
                results = self.player.play(line)
                yield ReplayedLine(line.value, results, self.player.snapshot, self.player.now)
        except DivergenceError as parted:
            made = len(call.operations) - len(self._host.left)
            then = str(self._host.left[0]) if self._host.left else "no operation"
            _divergence(call, f"calls `{parted}`", f"{then} as the {made + 1}. call")
        _require_equal(self.player.chart, call, steps, refused=refused)

    def _event(self, event: str) -> Occurrence:
        (line,) = script_texts([f"post {event}"], "<log>")
        return read_line(self.player.chart, line).event


def _require_equal(chart: Chart, call: Call, steps: Sequence[Macrostep], *, refused: bool) -> None:
    """Stop at the first thing that the machine in C did differently in one call of the host."""
    if refused != call.was_refused:
        reaction = ("took the event", "rejected the event")
        _divergence(call, reaction[refused], reaction[call.was_refused])
    here = [each for step in steps for each in log_entries_of(chart, step)]
    there = call.happened
    for place in range(max(len(here), len(there))):
        one = here[place] if place < len(here) else None
        other = there[place] if place < len(there) else None
        if one != other:
            _divergence(call, f"does: {one or 'nothing more'}", f"did: {other or 'nothing more'}")


def _divergence(call: Call, here: str, there: str) -> None:
    raise fail(
        "replay-parts",
        f"at byte {call.at} of the log, in `{call.lines[-1]}`, "
        f"the interpreter {here}; the C {there}",
        help="is the C made from this chart, and the memory of the machine its own?",
    )


def log_entries_of(chart: Chart, step: Macrostep, first: int = 0) -> Iterator[LogEntry]:
    """Yield the items of a log for a macrostep; ``first``: the number of the machine."""
    numbers = []
    number = first + 1
    for invocation in chart.invocations:
        numbers.append(number)
        number += len(machines_of(invocation.chart))
    for effect in step.effects:
        match effect:
            case Taken(transition):
                yield LogEntry(first, transition=transition)
            case Called(operation, _, result):
                yield LogEntry(first, operation, result)
            case InvokedMacrostep(slot, within):
                yield from log_entries_of(chart.invocations[slot].chart, within, numbers[slot])
            case _:
                pass
