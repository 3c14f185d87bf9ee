"""The target `transitions` as a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fsmkit.codegen.target import Generated
from fsmkit.diagnostics import Findings

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


@dataclass(frozen=True, slots=True)
class TransitionsTarget:
    """Writes ``<machine>_machine.py``."""

    name: str = "transitions"
    summary: str = "a HierarchicalMachine of the library transitions, where it means the same"
    options: tuple[str, ...] = ()

    def generate(
        self, chart: Chart, findings: Findings, options: Mapping[str, str]
    ) -> Generated | None:
        """Return the module, or None after saying what the library cannot express."""
        from fsmkit.codegen.transitions.generate import module_text
        from fsmkit.codegen.transitions.limits import check
        from fsmkit.codegen.transitions.names import file_name

        del options
        if not check(chart, findings):
            return None
        text = module_text(chart)
        figures = {
            "states": len(chart.states) - 1,
            "transitions": len(chart.transitions),
            "lines": text.count("\n"),
        }
        return Generated({file_name(chart): text}, figures)


PLUGIN = TransitionsTarget()
