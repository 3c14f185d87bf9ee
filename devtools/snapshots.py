"""Damaged snapshots with valid checksums: every target must accept the same ones.

``python -m devtools.snapshots --charts 100 --each 200`` changes bytes of snapshots of random
charts, renews their checksums, and restores them on every target. Accepted ones continue, on all
targets alike. C is built with sanitizers, so a memory error is a divergence.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import click

from devtools.differential import Case, first_difference, random_case, traces_of
from devtools.runtimes import harness
from devtools.runtimes import runtimes as named
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.plan.image import head, image_of, sealed
from fsmkit.runtime.snapshot_bytes import unpack
from fsmkit.testing.harness.harness import INTERPRETER

TARGETS = ("python", "javascript", "c-sanitized", "c-size-sanitized")
BATCH = 1_000
"""Number of snapshots compared together: their traces are in memory."""
NOW = 100
"""The time at which a machine is restored, in ticks."""
OVERDUE = 10_000
"""Ticks. A repeating timer expires once for each period that passed, at most 2^31 times."""
CRC = 4
LARGEST = 255


@dataclass
class Totals:
    """The figures of a run."""

    tried: int = 0
    accepted: int = 0
    divergences: int = 0


def damaged(draw: random.Random, chart: Chart, saved: bytes) -> bytes:
    """Return a snapshot with a few changed bytes and a valid checksum.

    Half of the changes put numbers of states where states, status and fault are stored.
    """
    data = bytearray(saved[:-CRC])
    image, start = image_of(chart), len(head(chart))
    numbers = len(image.plan.regions) + len(image.histories)
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        if draw.random() < 0.5:
            place = start + 2 + 2 * draw.randrange(numbers)
            number = draw.randrange(len(chart.states) + 1)
            data[place : place + 2] = number.to_bytes(2, "little")
        elif draw.random() < 0.2:
            data[start + draw.randrange(2)] = draw.randrange(7)
        else:
            place = draw.randrange(start, len(data))
            data[place] = draw.choice((0, 1, 2, 0x7F, 0x80, LARGEST, draw.randrange(256)))
    return sealed(bytes(data))


def is_overdue(chart: Chart, data: bytes) -> bool:
    """Return whether a timer of a restored machine should have expired long ago.

    Such a machine is right, but the trace of its first run may have a thousand million lines.
    """
    try:
        found = [unpack(chart, data, NOW)]
    except FsmkitError:
        return False
    for machine in found:
        found += filter(None, machine.invoked)
    return any(NOW - timer.deadline > OVERDUE for machine in found for timer in machine.timers)


def snapshots(case: Case) -> list[bytes]:
    """Return the snapshots that the script of a case saves."""
    trace = INTERPRETER.run(case.chart, case.script)
    found = [line.removeprefix("saved ") for line in trace if line.startswith("saved ")]
    return [bytes.fromhex(text) for text in dict.fromkeys(found)]


def scripts(draw: random.Random, case: Case, each: int) -> Iterator[tuple[str, ...]]:
    """Yield scripts that restore damaged snapshots and continue with the script of the case."""
    events = [line for line in case.script if line.startswith(("post ", "dispatch "))]
    saved = snapshots(case)
    for _ in range(each if saved else 0):
        data = damaged(draw, case.chart, draw.choice(saved))
        while is_overdue(case.chart, data):
            data = damaged(draw, case.chart, draw.choice(saved))
        following = draw.sample(events, min(4, len(events)))
        yield (f"restore {NOW} {data.hex()}", "dump", *following, "run 105", "run 3000", "dump")


def run_chart(seed: int, number: int, each: int, targets: Sequence[str]) -> Totals:
    """Restore damaged snapshots of a random chart on targets; print the differences."""
    case = random_case(seed, number, is_saved=True)
    draw = random.Random(f"{seed}:{number}")  # noqa: S311  (no secret)
    drawn = scripts(draw, case, each)
    totals = Totals()
    while batch := list(islice(drawn, BATCH)):
        part = replace(case, script=tuple(line for script in batch for line in script))
        expected = INTERPRETER.run(part.chart, part.script)
        totals.tried += len(batch)
        totals.accepted += len(batch) - expected.count("not restored")
        for name in targets:
            (trace,) = traces_of(harness(name), [part])
            found = None if trace is None else first_difference(name, expected, trace)
            if found is not None:
                totals.divergences += 1
                click.echo(f"{case.name}: {found}")
    return totals


@click.command()
@click.option("--charts", default=100, show_default=True, help="How many random charts.")
@click.option("--each", default=200, show_default=True, help="Snapshots of each chart.")
@click.option("--seed", default=0, show_default=True, help="Which charts.")
@click.option("--targets", callback=named, help="By name, with commas.")
def main(charts: int, each: int, seed: int, targets: tuple[str, ...]) -> None:
    """Restore damaged snapshots on every target."""
    totals = Totals()
    for number in range(charts):
        part = run_chart(seed, number, each, targets or TARGETS)
        totals.tried += part.tried
        totals.accepted += part.accepted
        totals.divergences += part.divergences
        click.echo(f"chart {number}: {part.tried} snapshots tried, {part.accepted} accepted")
    click.echo(
        f"{totals.tried} snapshots tried, {totals.accepted} accepted, "
        f"{totals.divergences} divergences"
    )
    sys.exit(1 if totals.divergences else 0)


if __name__ == "__main__":
    main()
