"""Machines of the library `transitions`, read into charts: configurations and Python objects."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart
    from fsmkit.diagnostics import Findings


def chart_of(machine: object, name: str = "machine", *, findings: Findings | None = None) -> Chart:
    """Return the chart of a machine, or of the dictionary that configures one.

    Warnings go to ``findings``. Raises `FsmkitError` with every finding if there is an error.
    """
    from fsmkit.chart.elaborate import elaborate
    from fsmkit.diagnostics import Findings, FsmkitError
    from fsmkit.foreign.pytransitions.plugin import PLUGIN

    found = Findings() if findings is None else findings
    document = PLUGIN.read_object(machine, name, found)
    found.stop_on_errors()
    chart = None if document is None else elaborate((document,), found)
    found.stop_on_errors()
    if chart is None:
        raise FsmkitError(found)
    return chart
