"""The exporter ``cspm``."""

from __future__ import annotations

from fsmkit.model.chart import Chart
from fsmkit.verify.export.exporter import Exported, Wanted
from fsmkit.verify.system import System


class Cspm:
    """Writes a network of automata for FDR and other tools of CSP."""

    name = "cspm"
    summary = "FDR: a process for each machine and each queue"

    def export(self, system: System, wanted: Wanted) -> Exported:
        """Explore by the interpreter, then write the local steps."""
        from fsmkit.verify.export.collect import network_of
        from fsmkit.verify.export.cspm.model import written

        network = network_of(system, wanted)
        figures = {"states": network.states, "transitions": network.transitions}
        return Exported(written(network), figures)

    def export_refinement(self, derived: Chart, base: Chart, wanted: Wanted) -> Exported:
        """Take the steps of both charts by the interpreter, then write them."""
        from fsmkit.verify.export.cspm.comparison import comparison
        from fsmkit.verify.export.cspm.refinement_model import written

        found = comparison(derived, base, wanted)
        figures = {"states": len(found.derived_steps), "states of the base": len(found.base_steps)}
        return Exported(written(found), figures)


PLUGIN = Cspm()
