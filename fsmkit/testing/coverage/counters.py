"""Convert the counters of generated code (`plan.counting`) to coverage.

The bytes are those of ``fsm_coverage.h``: of a machine, then of each machine in its slots. They
may be surrounded by other output of the line they were read from.
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
    """Return the coverage in a file, of the charts and of those they invoke.

    Args:
        path: The output of `x_coverage` in C, or `coverage` in Python, once or several times.
        charts: The possible charts; those without counters are omitted.

    Raises:
        FsmkitError: ``unreadable-file``; ``broken-coverage`` if counters are missing or damaged;
            ``other-chart`` for counters of another chart.

    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise fail("unreadable-file", f"`{path}` cannot be read: {error.strerror}") from error
    return coverage_in_bytes(content, str(path), charts)


def coverage_in_bytes(
    content: bytes, path: str, charts: Iterable[Chart]
) -> tuple[ChartCoverage, ...]:
    """Return the coverage in bytes; ``path``: the file they were read from."""
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
        found.append(coverage_of_area(chart, each.area))
    return tuple(found)


def everyone(charts: Iterable[Chart]) -> Iterator[Chart]:
    """Yield charts, and those that they invoke."""
    for chart in charts:
        yield chart
        yield from everyone(invocation.chart for invocation in chart.invocations)


def counters(content: bytes, name: str) -> list[Counters]:
    """Return all counters in bytes.

    Raises `FsmkitError` (``broken-coverage``) if they are missing or have a wrong checksum;
    ``name``: the file they were read from.
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


def coverage_of_area(chart: Chart, area: bytes) -> ChartCoverage:
    """Return the coverage in the counters of a chart; a saturated counter is 255."""
    where = area_of(chart)
    assert len(area) == where.size  # noqa: S101  (checked by the caller)
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
