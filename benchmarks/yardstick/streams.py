"""The streams of events, and the digests of their runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.yardstick.charts import Chart, chart_file, read_chart
from benchmarks.yardstick.model import FNV_OFFSET, Digests, Model, digest, mix

EVENTS = 1_000_000
"""The length of a stream."""
SEED = 12345


@dataclass(frozen=True, slots=True)
class Distribution:
    """The random distribution of the events in a stream."""

    weights: Mapping[str, int]
    """Events in the order of their numbers. The sum is a power of two."""
    choices: int
    """Three of four events are among the first so many that the active leaf names; 0: none."""


DISTRIBUTIONS = {
    "A": Distribution({f"E{number}": 1 for number in range(8)}, 4),
    "B": Distribution(
        {
            "POWER_ON": 1, "POWER_OFF": 1, "HOMED": 1, "START": 2, "ARRIVED": 2, "READY": 2,
            "DONE": 2, "STOP": 1, "FAULT": 1, "RESET": 1, "TICK": 2,
        },
        1,
    ),
    "C": Distribution(
        {
            "ON": 2, "RESUME": 2, "OFF": 1, "TICK": 7,
            "A0": 3, "A1": 3, "A2": 3, "A3": 3, "B0": 2, "B1": 2, "B2": 2, "B3": 2,
        },
        0,
    ),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Stream:
    """The events of a chart, as numbers into `names`, and the digests of the whole stream."""

    letter: str
    chart: Chart
    names: tuple[str, ...]
    """Event names."""
    file: Path
    """Holds the events, one byte each."""
    events: bytes
    digests: Digests

    @property
    def variables(self) -> tuple[str, ...]:
        """All variables in the order of the digests."""
        return tuple(self.chart.variables)

    @property
    def states(self) -> tuple[str, ...]:
        """The states whose entries and exits are counted, by number; empty for the others."""
        states = self.chart.states.values()
        return tuple(state.name if state.entry or state.exit else "" for state in states)


def make_stream(letter: str, folder: Path, count: int = EVENTS) -> Stream:
    """Draw the stream of a chart, write it to a folder, and interpret it."""
    chart, distribution = read_chart(chart_file(letter)), DISTRIBUTIONS[letter]
    names = tuple(distribution.weights)
    model = Model(chart)
    events = bytearray()

    def drawn() -> Iterator[str]:
        for event in _draw(distribution, model, count):
            events.append(names.index(event))
            yield event

    digests = _play(model, drawn())
    file = folder / f"events_{letter}.bin"
    file.write_bytes(events)
    return Stream(letter, chart, names, file, bytes(events), digests)


def digests_of(stream: Stream, events: bytes) -> Digests:
    """Return the digests of a shorter or a different stream for the same chart."""
    return _play(Model(stream.chart), (stream.names[event] for event in events))


def _play(model: Model, events: Iterable[str]) -> Digests:
    path = FNV_OFFSET
    for event in events:
        model.process(event)
        path = mix(path, model.n() & 0xFF)
    return Digests(digest(model.values()), f"{path:08x}", f"{model.order:08x}")


def _draw(distribution: Distribution, model: Model, count: int) -> Iterator[str]:
    """Yield random events; the model must process each one before the next is drawn."""
    table = [name for name, weight in distribution.weights.items() for _ in range(weight)]
    shift = 33 - len(table).bit_length()
    numbers = _random_numbers()
    choices = distribution.choices
    named = {
        name: tuple(dict.fromkeys(transition.event for transition in state.transitions))
        for name, state in model.chart.states.items()
    }
    for _ in range(count):
        if choices and next(numbers) >> 24 & 3:
            place = next(numbers) >> 24 & choices - 1 if choices > 1 else 0
            yield named[model.leaf()][place]
        else:
            yield table[next(numbers) >> shift]


def _random_numbers() -> Iterator[int]:
    """Yield numbers of 32 bits from a linear congruential generator."""
    number = SEED
    while True:
        number = (number * 1664525 + 1013904223) & 0xFFFFFFFF
        yield number
