"""C for size, as the tests run it: it is covered as a runtime of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class AimedC:
    """Runs scripts on machines for one aim; to write one, ask the target `c` for it."""

    def __init__(self, name: str, *, is_small: bool = False, is_fast: bool = False) -> None:
        """Run machines of such code under a name."""
        self.name = name
        self._is_small = is_small
        self._is_fast = is_fast

    def harness_run(self, chart: Chart, script_lines: Sequence[str]) -> list[str]:
        """Build a chart and return the trace of a script."""
        (lines,) = self.harness_run_all([(chart, script_lines)])
        return lines

    def harness_run_all(self, pairs: Sequence[tuple[Chart, Sequence[str]]]) -> list[list[str]]:
        """Build several charts at once and return the trace of each one's script."""
        from fsmkit.codegen.c.harness.harness import OPTIONS, run_many

        return run_many(pairs, replace(OPTIONS, is_small=self._is_small, is_fast=self._is_fast))


PLUGIN = AimedC("c-size", is_small=True)
