"""The exporter ``cspm``."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.export.exporter import ExportedModel, ExportOptions, Notation


class Cspm(Notation):
    """Writes a network of automata, and refinements, for FDR and other tools of CSP."""

    __slots__ = ()

    def export_refinement(
        self, derived: Chart, base: Chart, options: ExportOptions
    ) -> ExportedModel:
        """Take the steps of both charts by the interpreter, then write them."""
        from fsmkit.export.cspm.comparison import comparison
        from fsmkit.export.cspm.refinement_model import write_refinement

        found = comparison(derived, base, options)
        figures = {"states": len(found.derived_steps), "states of the base": len(found.base_steps)}
        return ExportedModel(write_refinement(found), figures)


PLUGIN = Cspm("cspm", "FDR: a process for each machine and each queue", __package__)
