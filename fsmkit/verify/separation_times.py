"""Compute the exact minimum and maximum time between two conditions of a system, by zones."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace

from fsmkit.chart.analysis.delays import delays_of
from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.system.conditions import read_condition
from fsmkit.system.properties.kinds import reachable
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.report.verdict import ENDS
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import End

DELAYS_WATCHED = 64
"""Times are distinguished by default up to so many times the longest delay."""


@dataclass(frozen=True, slots=True)
class Limit:
    """A bound on a time: in ticks, and whether the bound is attained."""

    ticks: int
    reached: bool


@dataclass(frozen=True, slots=True)
class SeparationTimes:
    """The time from one condition's start until another condition holds next.

    ``least`` and ``greatest`` of all possible times, in ticks; None if the end is never reached, or
    if the time exceeds ``most``. ``pending``: the maximum time that can pass before the end; None
    if it can exceed ``most``. It is greater than ``greatest`` if the end may never be reached.
    ``doubt``: why nothing is known, if so.
    """

    least: Limit | None
    greatest: Limit | None
    pending: Limit | None
    most: int
    doubt: str = ""

    def is_within(self, ticks: int) -> bool:
        """Whether the end is always reached after at most ``ticks``, less than ``most``."""
        return not self.doubt and self.pending is not None and self.pending.ticks <= ticks


def separation_times(
    system: System,
    begin: str,
    end: str,
    *,
    most: int | None = None,
    memory: int = 4 << 30,
    timeout: float = 0,
) -> SeparationTimes:
    """Measure the time from when ``begin`` becomes true until ``end`` holds (at once: 0).

    Both are conditions as in properties. A start while the time is running already is measured,
    too. Times beyond ``most`` ticks only count as longer. Raises `FsmkitError` if a condition is
    wrong or if there is no C compiler.
    """
    findings = Findings()
    measured = replace(system, properties=tuple(_reached(system, (begin, end), findings)))
    findings.stop_on_errors()
    closed = replace(close(measured), zones=True)
    unit = closed.unit or 1
    units = -(-(_longest_delay(closed) if most is None else most) // unit)
    with closing(CEngine(closed, findings)) as engine:
        found, told = engine.watch(0, 1, units, memory, timeout)
    if found.end is not End.COMPLETE or closed.samples:
        doubt = found.why or ENDS.get(found.end) or f"samples only of {', '.join(closed.samples)}"
        return SeparationTimes(None, None, None, units * unit, doubt)

    def limit(name: str) -> Limit | None:
        bound = told[name]
        return None if bound is None else Limit(*bound)

    stopped = bool(told["stopped"])
    return SeparationTimes(
        limit("least") if stopped else None,
        limit("greatest") if stopped else None,
        limit("pending"),
        units * unit,
    )


def _reached(system: System, texts: tuple[str, ...], findings: Findings) -> list[Property]:
    found = []
    for number, text in enumerate(texts):
        place = Span(Source("a condition", text), 0, len(text))
        condition = read_condition(Text(text, place), system.machines, findings)
        if condition is not None:
            found.append(
                Property(
                    str(number),
                    reachable.KIND,
                    text,
                    condition.expression,
                    condition.atoms,
                )
            )
    return found


def _longest_delay(closed: ClosedSystem) -> int:
    delays = [delay for chart in closed.charts for delay in delays_of(chart)]
    return DELAYS_WATCHED * max((delay for delay in delays if delay is not None), default=1)
