"""Events a second in Python: all machines of a chart in turn, round by round, in one process."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from benchmarks.comparison.figures import LIMIT, Speed
from benchmarks.comparison.python_machines import Contender, is_correct
from benchmarks.yardstick.streams import Stream, digests_of

FEW = 5_000
"""Events in a run of a package that takes a hundred times as long."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A contender with its events and the seconds of each round."""

    contender: Contender
    events: bytes
    is_correct: bool
    seconds: list[float] = field(default_factory=list)


def seconds(contender: Contender, events: bytes) -> float:
    """Return the processor's time for the events, on a new machine; never 0."""
    run = contender.start()
    prepared = run.prepare(events)
    gc.collect()
    before = time.process_time()
    run.feed(prepared)
    return max(time.process_time() - before, 1e-9)


def entered(stream: Stream, contender: Contender, count: int) -> Entry:
    """Return a contender with its part of the stream, verified."""
    events = stream.events[:count]
    if not contender.has_history:
        events = without_history(stream, events)
    return Entry(contender, events, is_correct(contender, events, digests_of(stream, events)))


def without_history(stream: Stream, events: bytes) -> bytes:
    """Return events without uses of the history: ``ON`` for each ``RESUME``."""
    if "RESUME" not in stream.names:
        return events
    resume, on = (stream.names.index(name) for name in ("RESUME", "ON"))
    return events.replace(bytes([resume]), bytes([on]))


def race(entries: Sequence[Entry], rounds: int, step: Callable[[str], None]) -> None:
    """Time all in turn; every second round runs backwards, so that none is always after another."""
    for at in range(rounds):
        for entry in entries if at % 2 == 0 else reversed(entries):
            step(f"Python: {entry.contender.name}, round {at + 1}")
            entry.seconds.append(seconds(entry.contender, entry.events))


def speeds(letter: str, entries: Sequence[Entry]) -> list[Speed]:
    """Return the figures of all; each ratio is to the machine by hand in the same round."""
    base = [rates(entry) for entry in entries if entry.contender.kind == LIMIT]
    return [
        Speed(
            letter, entry.contender.name, entry.contender.kind, len(entry.events),
            statistics.median(rates(entry)),
            median_ratio(rates(entry), base[0]) if base else None,
            entry.is_correct,
            "" if entry.contender.has_history or letter != "C" else "no history",
        )
        for entry in entries
    ]  # fmt: skip


def rates(entry: Entry) -> list[float]:
    """Return the events a second of each round."""
    return [len(entry.events) / taken for taken in entry.seconds]


def median_ratio(these: Sequence[float], those: Sequence[float]) -> float:
    """Return the median of the ratios, round by round."""
    return statistics.median(one / other for one, other in zip(these, those, strict=True))
