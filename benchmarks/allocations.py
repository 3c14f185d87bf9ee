"""Measure the memory that a million steps of a generated Python machine leave or get tracked.

``python -m benchmarks.allocations`` prints it for the charts of the yardstick.
"""

from __future__ import annotations

import gc
import sys
import tempfile
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from benchmarks.comparison.python_machines import by_fsmkit
from benchmarks.comparison.tools import UnavailableError
from benchmarks.yardstick.charts import LETTERS, chart_file
from benchmarks.yardstick.streams import make_stream

TARGETS = ("python", "pyext")


@dataclass(frozen=True, slots=True)
class Allocations:
    """The differences in memory after some steps that are not the first of their kind."""

    blocks: int
    """More blocks of the allocator in use (`sys.getallocatedblocks`)."""
    tracked: int
    """More objects made than freed that the collector tracks (`gc.get_count`)."""
    collections: int
    """Collections begun, where an object that is tracked begins one, however short it lives."""
    bytes_kept: int
    """More bytes in use (`tracemalloc`)."""
    bytes_most: int
    """The most that were in use at once, above the start (`tracemalloc`)."""


Step = Callable[[], object]


def measured(steps: Sequence[Step]) -> Allocations:
    """Run steps several times, the first time to warm up; return the effect on memory.

    The cost of measuring, determined without steps, is subtracted.
    """
    kept, most = _bytes(steps)
    blocks, tracked = _objects(steps)
    own_blocks, own_tracked = _objects(())
    return Allocations(blocks - own_blocks, tracked - own_tracked, _collections(steps), kept, most)


def _run(steps: Iterator[Step]) -> None:
    """Run steps; the iterator is created before, because it is tracked itself."""
    for step in steps:
        step()


def _bytes(steps: Sequence[Step]) -> tuple[int, int]:
    """Return how many bytes more are in use after steps, and were at most."""
    tracemalloc.start()
    try:
        _run(iter(steps))  # so that every value that is replaced is one that is known of
        gc.collect()
        ready = iter(steps)
        before, _ = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        _run(ready)
        after, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return after - before, most - before


def _objects(steps: Sequence[Step]) -> tuple[int, int]:
    """Return how many blocks more are in use, and objects tracked, while none is collected."""
    ready = iter(steps)
    gc.collect()
    gc.disable()
    try:
        blocks, (tracked, *_) = sys.getallocatedblocks(), gc.get_count()
        _run(ready)
        return sys.getallocatedblocks() - blocks, gc.get_count()[0] - tracked
    finally:
        gc.enable()


def _collections(steps: Sequence[Step]) -> int:
    """Return the number of collections with a threshold of two tracked objects.

    One object is kept, so that even a short-lived object of a step causes a collection.
    """
    begun = [0]

    def note(phase: str, _: object) -> None:
        begun[0] += phase == "start"

    thresholds = gc.get_threshold()
    kept: list[object] = []
    ready = iter(steps)
    gc.collect()
    gc.callbacks.append(note)
    try:
        while gc.get_count()[0] < 1:
            kept.append([])
        gc.set_threshold(1)
        begun[0] = 0
        _run(ready)
        return begun[0]
    finally:
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(note)


def main() -> int:
    """Print a line for each chart."""
    print("chart target       events  blocks  tracked  collections  bytes kept  bytes at most")
    with tempfile.TemporaryDirectory() as made:
        work = Path(made)
        for letter in LETTERS:
            stream = make_stream(letter, work)
            for target in TARGETS:
                try:
                    run = by_fsmkit(chart_file(letter), stream, work, "fsmkit", target).start()
                except UnavailableError as error:
                    print(error, file=sys.stderr)
                    continue
                calls = run.prepare(stream.events)
                found = measured(calls)
                columns = zip(astuple(found), (8, 9, 13, 12, 15), strict=True)
                row = (f"{n:{w - 1}}" for n, w in columns)
                print(f"{letter:5} {target:8}{len(calls):11,}", *row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
