"""The exporter ``cspm``."""

from __future__ import annotations

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


PLUGIN = Cspm()
