"""Read files of messages (``.live``, ``.live.gz``): recorded or saved sessions.

A simulated session is replayed by the interpreter and compared message by message, so every moment
is known. For any other session, the messages are shown as a client received them.
"""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import get_args

import msgspec

from fsmkit.chart.loading import read_bytes
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.diagnostics.paths import is_file
from fsmkit.inspector.as_messages import MessageEncoder
from fsmkit.inspector.folding import Folded, fold
from fsmkit.inspector.questions.arguments import results_of
from fsmkit.inspector.simulation import Moment, Simulation
from fsmkit.inspector.sources import Entry
from fsmkit.inspector.sources.recording import Recording
from fsmkit.runtime.interpreter.snapshot import Occurrence
from fsmkit.runtime.live.messages import (
    AnyMessage,
    Hello,
    Lost,
    Pass,
    Post,
    Row,
    Set,
    State,
    Step,
)
from fsmkit.runtime.live.values import from_json as value_from
from fsmkit.system.any_file import read, system_within

SUFFIXES = (".live", ".live.gz")
GZIP = b"\x1f\x8b"
MOST_BYTES = 1 << 30
"""Bytes of a file after unpacking."""
MOST_LINE = 1 << 26
"""Bytes of a line; the longest holds the chart of a machine."""
KINDS = {kind.__struct_config__.tag for kind in get_args(AnyMessage)}
WRONG = (LookupError, TypeError, ValueError)
"""Errors caused by messages that are impossible for these machines."""
Told = Step | Post | Set | State | Pass | Lost


def is_live(path: Path) -> bool:
    """Whether a file is one of messages, by its name."""
    return path.name.endswith(SUFFIXES)


def read_live(path: Path, findings: Findings, file: Path | None = None) -> tuple[Recording, Path]:
    """Return a file of messages, and the file of its chart or system.

    ``file``: that file; by default the one named in the messages, beside them. A file that ends
    within a line, as after a kill, is read up to there. Raises `FsmkitError`: ``unreadable-log``,
    ``foreign-log`` for another chart, ``replay-parts`` if the replay differs.
    """
    hello, groups = _read(path)
    file = file or _file_of(path, hello)
    system = system_within(read(file, findings))
    simulation = Simulation(system, hello.seed)
    encoder = MessageEncoder(simulation)
    if encoder.machines != hello.machines:
        raise fail(
            "foreign-log",
            f"`{path}` is of other machines than those of `{file}`: {_differs(encoder, hello)}",
            help="name the chart or the system as it was then",
        )
    if groups and groups[0][0].n == 0 and hello.time == "simulated":
        del groups[0]  # all before the start
    numbers = [group[0].n for group in groups]
    is_whole = hello.time == "simulated" and numbers == list(range(1, len(groups) + 1))
    begin = simulation.begin() if is_whole else None
    try:
        entries = (
            list(_replay(simulation, encoder, groups))
            if is_whole
            else [Entry(None, tuple(group)) for group in _checked(encoder, groups)]
        )
    except WRONG as error:
        raise _unreadable(path, f"a message is impossible: {error}") from error
    return Recording(system, begin, entries), file


def _differs(encoder: MessageEncoder, hello: Hello) -> str:
    here = {each.m: each.chart for each in encoder.machines}
    there = {each.m: each.chart for each in hello.machines}
    other = [name for name in there if there[name] != here.get(name)]
    return ", ".join(f"`{name}`" for name in other[:3]) or "their number or order"


def _file_of(path: Path, hello: Hello) -> Path:
    if hello.file and is_file(path.parent / hello.file):
        return path.parent / hello.file
    raise fail(
        "foreign-log",
        f"`{path}` is of the file `{hello.file or '?'}`, which is not there",
        help="name it: `fsmkit serve FILE --replay` and this file",
    )


# --- the file -----------------------------------------------------------------------------------


def _unreadable(path: Path, why: str) -> FsmkitError:
    return fail(
        "unreadable-log",
        f"`{path}` is not a file of messages: {why}",
        help="record one with `fsmkit serve --record`, or save a session as `live`",
    )


def _read(path: Path) -> tuple[Hello, list[list[Told]]]:
    """Return the first message, and the others grouped by entry.

    A last line without a line break is ignored where it cannot be read: the session was killed.
    """
    hello: Hello | None = None
    groups: list[list[Told]] = []
    for number, line in enumerate(_lines(path, read_bytes(path)), 1):
        try:
            if not line.strip():
                raise ValueError("it is empty")
            told = list(_messages(line))
        except (ValueError, RecursionError) as error:
            if not line.endswith(b"\n"):
                break
            raise _unreadable(path, f"line {number}: {error}") from error
        if number == 1:
            hello = next((message for message in told if isinstance(message, Hello)), None)
        if hello is None:
            break
        _take(groups, (message for message in told if isinstance(message, Told)))
    if hello is None:
        raise _unreadable(path, "its first line is not a `hello` message")
    return hello, groups


def _lines(path: Path, data: bytes) -> Iterator[bytes]:
    """Yield the lines of a file, up to the end of a truncated compressed file.

    A compressed file can grow a thousandfold, so only one line is in memory.
    """
    packed = io.BytesIO(data)
    file = gzip.GzipFile(fileobj=packed) if data.startswith(GZIP) else packed
    total = 0
    try:
        while line := file.readline(MOST_LINE + 1):
            total += len(line)
            if len(line) > MOST_LINE:
                raise _unreadable(path, f"a line has more than {MOST_LINE:,} bytes")
            if total > MOST_BYTES:
                raise _unreadable(path, f"it holds more than {MOST_BYTES:,} bytes")
            yield line
    except EOFError:
        return  # the packed file was cut off
    except (OSError, zlib.error) as error:
        raise _unreadable(path, str(error)) from error


def _messages(line: bytes) -> Iterator[AnyMessage]:
    """Yield the messages of a line; messages of unknown kinds are skipped."""
    found = msgspec.json.decode(line)
    for each in found if isinstance(found, list) else [found]:
        if not isinstance(each, dict):
            raise ValueError("a message is an object")
        kind = each.get("k")
        if isinstance(kind, str) and kind in KINDS:
            yield msgspec.convert(each, AnyMessage)


def _take(groups: list[list[Told]], line: Iterable[Told]) -> None:
    """Add the messages of a line to their entries; one of the past starts another branch.

    A message with states alone joins the last entry, except the first one.
    """
    for n, found in groupby(line, key=lambda message: message.n):
        told = list(found)
        last = groups[-1][0].n if groups else None
        if last is not None and n <= last and all(isinstance(message, State) for message in told):
            if n == last:
                groups[-1] += told
            continue
        while groups and groups[-1][0].n >= n:
            groups.pop()
        groups.append(told)


# --- entries ------------------------------------------------------------------------------------


def _checked(encoder: MessageEncoder, groups: Iterable[list[Told]]) -> Iterator[list[Told]]:
    """Yield entries that machines of these charts can have; `WRONG` for others."""
    folded = Folded(encoder.unknown(0))
    names = {state.m for state in folded.states}
    for group in groups:
        for message in group:
            if not names.issuperset(_machines_of(message)):
                raise ValueError(f"entry {message.n} is of a machine that there is not")
            if isinstance(message, Step) and not all(map(_is_row, (message.cause, *message.do))):
                raise ValueError(f"entry {message.n} has an effect without words")
            encoder.action_line(message)
        folded = fold(folded, group)
        yield group


def _machines_of(message: Told) -> tuple[str, ...]:
    if isinstance(message, Pass):
        return message.source[0], message.target[0]
    return () if isinstance(message, Lost) and not message.m else (message.m,)


LEAST = {"eventless": 1, "start": 1, "within": 1, "cancelled": 1, "out to": 3}
"""Words of a row, where they are not two or more."""


def _is_row(row: Row) -> bool:
    return bool(row) and isinstance(row[0], str) and len(row) >= LEAST.get(row[0], 2)


def _replay(
    simulation: Simulation, encoder: MessageEncoder, groups: Iterable[list[Told]]
) -> Iterator[Entry]:
    """Yield the entries of a simulation, which must equal the messages."""
    moment = simulation.begin()
    for group in groups:
        first, done = group[0], None
        if first.at > moment.now and not isinstance(first, Step):
            moment, done = simulation.step(moment, first.at)
        if isinstance(first, Step):
            moment, done = simulation.step(moment, first.at)
            told: list[AnyMessage] = [] if done is None else encoder.step(first.n, moment, done)
        elif done is not None:
            told = encoder.step(first.n, moment, done)
        else:
            moment = _apply_action(simulation, moment, first)
            told = list(group)
        if told != group[: len(told)] or not told:
            raise fail(
                "replay-parts",
                f"at entry {first.n}, {first.at} ticks, the interpreter does "
                f"{_words(told)}; it was {_words(group)}",
                help="is the chart as it was then?",
            )
        yield Entry(moment, tuple(group), done)


def _apply_action(simulation: Simulation, moment: Moment, told: Told) -> Moment:
    """Return the system after an action of a client."""
    machine = simulation.names.index(told.m) if isinstance(told, Post | Set) else 0
    chart = simulation.charts[machine]
    match told:
        case Post(event=[name, *values], how=how):
            event = chart.events[chart.event_index[name]]
            typed = zip(values, event.fields, strict=True)
            payload = tuple(value_from(value, part.type) for value, part in typed)
            after = simulation.post(moment, machine, Occurrence(event.index, payload))
            return moment if after is None or how == "refused" else after
        case Set(inputs=inputs, data=data, results=results):
            names = [each.name for each in chart.inputs]
            for name, value in inputs.items():
                place = names.index(name)
                given = value_from(value, chart.inputs[place].type)
                moment = simulation.set_input(moment, machine, place, given)
            names = [each.name for each in chart.data]
            for name, value in data.items():
                place = names.index(name)
                given = value_from(value, chart.data[place].type)
                moment = simulation.set_data(moment, machine, place, given)
            for name, values in results.items():
                moment = simulation.set_results(
                    moment, machine, name, results_of(chart, name, values)
                )
            return moment
        case _:
            raise ValueError(f"entry {told.n} is not an action of a client")


def _words(told: Sequence[AnyMessage]) -> str:
    """Return entries in a few words."""
    first = told[0] if told else None
    match first:
        case Step(m=name, cause=cause, do=do):
            rows = (" ".join(map(str, row)) for row in do[:4])
            return f"`{name}: {' '.join(map(str, cause))}: {', '.join(rows)}`"
        case Post(m=name, event=event, how=how):
            return f"`{name}: post {' '.join(map(str, event))}` ({how})"
        case _:
            return "nothing" if first is None else f"`{type(first).__name__.lower()}`"
