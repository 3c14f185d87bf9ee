"""Files of messages (``.live``, ``.live.gz``): sessions that were recorded or saved.

What the interpreter simulated is done again, and must be the same message by message, so every
moment is known. Of anything else the messages are shown, as a client saw them.
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
from fsmkit.inspector.as_messages import Teller
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
"""What messages lead to that no session of these machines has."""
Told = Step | Post | Set | State | Pass | Lost


def is_live(path: Path) -> bool:
    """Whether a file is one of messages, by its name."""
    return path.name.endswith(SUFFIXES)


def read_live(path: Path, findings: Findings, file: Path | None = None) -> tuple[Recording, Path]:
    """Return a file of messages, and the file of its chart or system.

    ``file``: that file; by default the one that the messages name, beside them. A file that ends
    within a line, as one of a session that was killed, is read up to there. `FsmkitError`:
    ``unreadable-log``, ``foreign-log`` for another chart, ``replay-parts`` where the interpreter
    does not do it again.
    """
    hello, groups = _read(path)
    file = file or _file_of(path, hello)
    system = system_within(read(file, findings))
    simulation = Simulation(system, hello.seed)
    teller = Teller(simulation)
    if teller.machines != hello.machines:
        raise fail(
            "foreign-log",
            f"`{path}` is of other machines than those of `{file}`: {_differs(teller, hello)}",
            help="name the chart or the system as it was then",
        )
    if groups and groups[0][0].n == 0 and hello.time == "simulated":
        del groups[0]  # all before the start
    numbers = [group[0].n for group in groups]
    is_whole = hello.time == "simulated" and numbers == list(range(1, len(groups) + 1))
    begin = simulation.begin() if is_whole else None
    try:
        entries = (
            list(_done_again(simulation, teller, groups))
            if is_whole
            else [Entry(None, tuple(group)) for group in _checked(teller, groups)]
        )
    except WRONG as error:
        raise _unreadable(path, f"no session says so: {error}") from error
    return Recording(system, begin, entries), file


def _differs(teller: Teller, hello: Hello) -> str:
    here = {each.m: each.chart for each in teller.machines}
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
        f"`{path}` is no file of messages: {why}",
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
    """Yield the lines of a file, one at a time, as far as a packed file that was cut off goes.

    A packed file may unpack to a thousand times its size, so no more than a line is held.
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
    """Put the messages of a line to their entries; what is of the past begins another branch there.

    States alone are no entry of their own, but that in which all began: they go with the last one.
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


def _checked(teller: Teller, groups: Iterable[list[Told]]) -> Iterator[list[Told]]:
    """Yield entries that machines of these charts can have; `WRONG` for others."""
    folded = Folded(teller.unknown(0))
    names = {state.m for state in folded.states}
    for group in groups:
        for message in group:
            if not names.issuperset(_machines_of(message)):
                raise ValueError(f"entry {message.n} is of a machine that there is not")
            if isinstance(message, Step) and not all(map(_is_row, (message.cause, *message.do))):
                raise ValueError(f"entry {message.n} has an effect without words")
            teller.action_line(message)
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


def _done_again(
    simulation: Simulation, teller: Teller, groups: Iterable[list[Told]]
) -> Iterator[Entry]:
    """Yield what a simulation does, which must be what was told."""
    moment = simulation.begin()
    for group in groups:
        first, done = group[0], None
        if first.at > moment.now and not isinstance(first, Step):
            moment, done = simulation.step(moment, first.at)
        if isinstance(first, Step):
            moment, done = simulation.step(moment, first.at)
            told: list[AnyMessage] = [] if done is None else teller.step(first.n, moment, done)
        elif done is not None:
            told = teller.step(first.n, moment, done)
        else:
            moment = _acted(simulation, moment, first)
            told = list(group)
        if told != group[: len(told)] or not told:
            raise fail(
                "replay-parts",
                f"at entry {first.n}, {first.at} ticks, the interpreter does "
                f"{_words(told)}; it was {_words(group)}",
                help="is the chart as it was then?",
            )
        yield Entry(moment, tuple(group), done)


def _acted(simulation: Simulation, moment: Moment, told: Told) -> Moment:
    """Return the system after what a client did."""
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
            raise ValueError(f"entry {told.n} is nothing that a client does")


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
