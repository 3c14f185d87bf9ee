"""Every node of a chart, and the charts that it invokes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

from fsmkit.chart.chart import Chart
from fsmkit.language.walk import nodes


def own_nodes(chart: Chart) -> Iterator[object]:
    """Yield every node of a chart, without those of invoked charts."""
    return nodes(tuple(getattr(chart, f.name) for f in fields(chart) if f.name != "invocations"))


def charts_within(chart: Chart) -> Iterator[Chart]:
    """Yield a chart and, recursively, the charts that it invokes."""
    yield chart
    for invocation in chart.invocations:
        yield from charts_within(invocation.chart)
