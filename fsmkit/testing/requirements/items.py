"""The items of a model that name requirements: states, transitions, operations, properties."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from fsmkit.chart.chart import Chart
from fsmkit.chart.walk import charts_within
from fsmkit.diagnostics import Span, Text
from fsmkit.emit import guard
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.system.properties.property import Builtin
from fsmkit.system.system import System
from fsmkit.testing.coverage.record import ChartCoverage, transition_text


@dataclass(frozen=True, slots=True)
class Item:
    """A part of a model that implements requirements. ``covered``: by the tests; None: unknown."""

    kind: str
    name: str
    span: Span = field(compare=False, repr=False)
    req: tuple[Text, ...]
    chart: str = ""
    """The fingerprint of its chart."""
    covered: bool | None = None

    def __post_init__(self) -> None:
        guard(self, "name")


@dataclass(frozen=True, slots=True)
class StatedProperty:
    """A property of a model. ``file``: the model; ``verdict``: of a check, None if unknown."""

    file: str
    name: str
    claim: str
    span: Span | None = field(compare=False, repr=False)
    req: tuple[Text, ...]
    verdict: str | None = None

    def __post_init__(self) -> None:
        guard(self, "file", "name", "claim")


def items_of(system: System, coverage: tuple[ChartCoverage, ...] | None) -> Iterator[Item]:
    """Yield the items with requirements, each location once.

    ``coverage``: of the tests, or None if no test ran.
    """
    counts = None if coverage is None else _counts(coverage)
    if system.req:
        yield Item("system", system.name, system.req[0].span, system.req)
    seen: set[tuple[str, str, int]] = set()
    for machine in system.machines:
        for chart in charts_within(machine.chart):
            for item in _chart_items(chart, counts):
                at = item.kind, item.span.source.name, item.span.start
                if at not in seen:
                    seen.add(at)
                    yield item


Counts = dict[tuple[str, str, int, str], int]
"""How often items were executed, by kind, file, line and text."""


def _counts(coverage: tuple[ChartCoverage, ...]) -> Counts:
    found: Counts = {}
    for chart in coverage:
        for kind, items in (("state", chart.states), ("transition", chart.transitions)):
            for one in items:
                key = kind, _real(one.at.file), one.at.line, one.text
                found[key] = found.get(key, 0) + one.count
    return found


@cache
def _real(file: str) -> str:
    return os.path.realpath(file)


def _chart_items(chart: Chart, counts: Counts | None) -> Iterator[Item]:
    digest = fingerprint(chart)

    def covered(kind: str, span: Span, text: str) -> bool | None:
        if counts is None:
            return None
        line = span.source.position(span.start)[0]
        return counts.get((kind, _real(span.source.name), line, text), 0) > 0

    if chart.req:
        yield Item("chart", chart.name, chart.req[0].span, chart.req, digest)
    for operation in chart.operations:
        if operation.req:
            yield Item("operation", operation.name, operation.span, operation.req, digest)
    for state in chart.states:
        if state.req:
            reached = covered("state", state.span, state.id)
            yield Item("state", state.id, state.span, state.req, digest, reached)
    for transition in chart.transitions:
        if transition.req:
            text = transition_text(chart, transition)
            taken = covered("transition", transition.span, text)
            yield Item("transition", text, transition.span, transition.req, digest, taken)


def properties_of(file: str, system: System) -> Iterator[StatedProperty]:
    """Yield the properties of a system, whether they name requirements or not."""
    for one in system.properties:
        is_builtin = isinstance(one.kind.decided, Builtin)
        claim = one.text if is_builtin or one.owner is not None else f"{one.kind.key}: {one.text}"
        yield StatedProperty(file, one.name, claim, one.span, one.req)
