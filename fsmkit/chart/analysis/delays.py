"""All delays of a chart."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.chart import Chart
from fsmkit.chart.content import all_statements
from fsmkit.chart.statements import Send
from fsmkit.chart.walk import charts_within
from fsmkit.language import Literal


def delays_of(chart: Chart) -> Iterator[int | None]:
    """Yield every delay of a chart in ticks, None for one that is known only when running.

    With those of the charts that it invokes.
    """
    for one in charts_within(chart):
        for transition in one.transitions:
            if not transition.is_open_ended:
                yield transition.delay
            if transition.least is not None:
                yield transition.least
        for statement in all_statements(one):
            if isinstance(statement, Send) and (delay := statement.delay) is not None:
                value = delay.value if isinstance(delay, Literal) else None
                yield value if isinstance(value, int) else None
