"""C for size, as the tests run it: it is covered as a runtime of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class SmallC:
    """Runs scripts on machines for size; to write one, ask the target `c` for it."""

    name = "c-size"

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Build a chart and return the trace of a script."""
        (lines,) = self.harness_run_all([(chart, script_lines)])
        return lines

    def harness_run_all(self, pairs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
        """Build several charts at once and return the trace of each one's script."""
        from fsmkit.codegen.c.harness.harness import OPTIONS, run_many

        return run_many(pairs, replace(OPTIONS, is_small=True))


PLUGIN = SmallC()
