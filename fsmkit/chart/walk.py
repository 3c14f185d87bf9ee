"""Every node below a node of a chart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span


def nodes(node: object) -> Iterator[object]:
    """Yield a node and all below it: dataclasses and tuples, in order.

    Places and the types of expressions are left out.
    """
    left: list[Any] = [node]
    while left:
        part = left.pop()
        if type(part) is tuple:
            left += part[::-1]
        elif (names := _names_backwards(part.__class__)) is not None:
            yield part
            left += [getattr(part, name) for name in names]


@cache
def _names_backwards(kind: type[Any]) -> tuple[str, ...] | None:
    """Return what a node holds, the last first; None for what is none."""
    if not is_dataclass(kind) or issubclass(kind, Span | Source):
        return None
    names = (field.name for field in reversed(fields(kind)))
    return tuple(name for name in names if name not in ("span", "type"))


def own_nodes(chart: Chart) -> Iterator[object]:
    """Yield every node of a chart; what it invokes has its own."""
    return nodes(tuple(getattr(chart, f.name) for f in fields(chart) if f.name != "invocations"))


def charts_within(chart: Chart) -> Iterator[Chart]:
    """Yield a chart and all that it invokes."""
    yield chart
    for invocation in chart.invocations:
        yield from charts_within(invocation.chart)
