"""Every node below a node of a chart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Source, Span
from fsmkit.language.placing import BARE, values_of


def nodes(node: object) -> Iterator[object]:
    """Yield a node and all below it: dataclasses and tuples, in order.

    Places and the types of expressions are left out.
    """
    left: list[Any] = [node]
    while left:
        part = left.pop()
        if type(part) is tuple:
            left += part[::-1]
        elif (held := _held(part.__class__)) is not None:
            yield part
            left += held(part)[::-1]


def children(node: Any) -> tuple[object, ...]:
    """Return the fields of a node that may hold nodes, in order."""
    held = _held(node.__class__)
    return () if held is None else held(node)


@cache
def _held(kind: type[Any]) -> Callable[[Any], tuple[Any, ...]] | None:
    """Return how to take what a node may hold of nodes; None for what is none."""
    if not is_dataclass(kind) or issubclass(kind, Span | Source):
        return None
    held = (field for field in fields(kind) if not BARE.fullmatch(str(field.type)))
    return values_of(tuple(field.name for field in held if field.name not in ("span", "type")))


def own_nodes(chart: Chart) -> Iterator[object]:
    """Yield every node of a chart; what it invokes has its own."""
    return nodes(tuple(getattr(chart, f.name) for f in fields(chart) if f.name != "invocations"))


def charts_within(chart: Chart) -> Iterator[Chart]:
    """Yield a chart and all that it invokes."""
    yield chart
    for invocation in chart.invocations:
        yield from charts_within(invocation.chart)
