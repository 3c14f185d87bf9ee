"""What generated code counted (`plan.counting`), as coverage that adds up with the interpreter's.

The bytes are those of ``fsm_coverage.h``: of a machine, then of each machine in its slots. They may
come from a line of which other things were read, too, and lie anywhere in what was read.
"""

from __future__ import annotations

import binascii
import struct
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from fsmkit.chart.analysis.decisions import Outcomes
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.plan.counting import area_of
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.testing.coverage.record import ChartCoverage, Counts, coverage_of

MAGIC = b"FSMC\x01"
HEAD = struct.Struct("<5s8sI")
CHECK = struct.Struct(">H")


@dataclass(frozen=True, slots=True)
class Counters:
    """The counters of a chart: the first 16 digits of its fingerprint, and the bytes."""

    fingerprint: str
    area: bytes


def read_counters(path: Path, charts: Iterable[Chart]) -> tuple[ChartCoverage, ...]:
    """Return what the bytes of a file say of charts, and of those that these invoke.

    Args:
        path: What `x_coverage` in C, or `coverage` in Python, gave out, once or several times.
        charts: Those that may be meant; each that is not is left out.

    Raises:
        FsmkitError: ``unreadable-file``; ``broken-coverage`` where there are no counters, or some
            came over damaged; ``other-chart`` for counters of another chart than these.

    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise fail("unreadable-file", f"`{path}` cannot be read: {error.strerror}") from error
    return counted_in(content, str(path), charts)


def counted_in(content: bytes, path: str, charts: Iterable[Chart]) -> tuple[ChartCoverage, ...]:
    """Return the same of bytes; ``path``: of what they were read from."""
    known = {fingerprint(chart)[:16]: chart for chart in everyone(charts)}
    found = []
    for each in counters(content, path):
        chart = known.get(each.fingerprint)
        if chart is None or len(each.area) != area_of(chart).size:
            names = ", ".join(f"`{chart.name}`" for chart in known.values())
            raise fail(
                "other-chart",
                f"`{path}` holds counters of the chart {each.fingerprint}, which is not {names}",
                help="name the chart that the code was generated from, as it was then",
            )
        found.append(of_area(chart, each.area))
    return tuple(found)


def everyone(charts: Iterable[Chart]) -> Iterator[Chart]:
    """Yield charts, and those that they invoke."""
    for chart in charts:
        yield chart
        yield from everyone(invocation.chart for invocation in chart.invocations)


def counters(content: bytes, name: str) -> list[Counters]:
    """Return the counters in bytes, however many charts they are of.

    `FsmkitError` (``broken-coverage``) where there are none, or their check is wrong; ``name``: of
    what they were read from.
    """
    found: list[Counters] = []
    at = content.find(MAGIC)
    while at >= 0:
        try:
            _, number, size = HEAD.unpack_from(content, at)
            end = at + HEAD.size + size
            (check,) = CHECK.unpack_from(content, end)
        except struct.error:
            raise _broken(name, "the last counters are cut off") from None
        if binascii.crc_hqx(content[at:end], 0xFFFF) != check:
            raise _broken(name, f"the check of those at byte {at} is wrong")
        found.append(Counters(number.hex(), content[at + HEAD.size : end]))
        at = content.find(MAGIC, end + CHECK.size)
    if not found:
        raise _broken(name, "there are no counters in it")
    return found


def _broken(name: str, why: str) -> FsmkitError:
    return fail(
        "broken-coverage", f"`{name}` holds no counts of coverage: {why}",
        help="write the bytes of `coverage` as they are, and all of them",
    )  # fmt: skip


def of_area(chart: Chart, area: bytes) -> ChartCoverage:
    """Return what an area says was reached of a chart; a full counter counts as 255."""
    where = area_of(chart)
    assert len(area) == where.size  # noqa: S101  (whoever calls has looked)
    counts = Counts(chart)
    first = where.first_transition
    counts.states = Counter(dict(enumerate(area[:first])))
    counts.transitions = Counter(dict(enumerate(area[first : first + len(chart.transitions)])))
    for transition, guard in where.guards.items():
        counted = area[guard.counter : guard.counter + guard.bytes]
        seen: Counter[Outcomes] = Counter()
        if guard.is_noted:
            counts.decided[transition, False], counts.decided[transition, True] = counted[:2]
            bits = int.from_bytes(counted[2:], "little")
            for place, outcomes in enumerate(guard.ways.outcomes):
                seen[outcomes] = bits >> place & 1
        else:
            for count, outcomes, result in zip(
                counted, guard.ways.outcomes, guard.ways.results, strict=True
            ):
                seen[outcomes] = count
                counts.decided[transition, result] += count
        counts.outcomes[transition] = +seen
    return coverage_of(counts)
