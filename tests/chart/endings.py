"""How a chart ends on several runtimes: they agree where there is one ending."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.testing.conformance.expectations import ends_in


def endings(
    chart: Chart, script: Sequence[str], runtimes: Iterable[str] = ("interpreter",)
) -> set[tuple[str, ...] | None]:
    """Return the final states that the chart ends in, on each of the runtimes."""
    return {ends_in(harness(runtime).run(chart, script)) for runtime in runtimes}
