"""The exporter ``cspm``."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.export.exporter import Exported, ExportOptions
from fsmkit.system.system import System


class Cspm:
    """Writes a network of automata for FDR and other tools of CSP."""

    name = "cspm"
    summary = "FDR: a process for each machine and each queue"

    def export(self, system: System, wanted: ExportOptions) -> Exported:
        """Explore by the interpreter, then write the local steps."""
        from fsmkit.export.collect import exported
        from fsmkit.export.cspm.model import written

        return exported(system, wanted, written)

    def export_refinement(self, derived: Chart, base: Chart, wanted: ExportOptions) -> Exported:
        """Take the steps of both charts by the interpreter, then write them."""
        from fsmkit.export.cspm.comparison import comparison
        from fsmkit.export.cspm.refinement_model import written

        found = comparison(derived, base, wanted)
        figures = {"states": len(found.derived_steps), "states of the base": len(found.base_steps)}
        return Exported(written(found), figures)


PLUGIN = Cspm()
