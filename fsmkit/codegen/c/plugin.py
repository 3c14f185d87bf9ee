"""C as a target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class C:
    """C99, freestanding, without allocation."""

    name = "c"
    summary = "C99 without allocation, recursion or globals: a struct, a switch, a queue, timers"
    options = ("prefix", "with", "without", "optimize", "binding")

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the files of a machine.

        Options: ``prefix`` replaces the chart's name; ``without``: some of `PARTS`, separated by
        commas; ``binding``: the file that binds the chart to the host's own C.
        """
        from fsmkit.codegen.c.generate import machine_of

        machine = machine_of(chart, findings, options)
        return None if machine is None else Generated(machine.files, machine.figures)


PLUGIN = C()
