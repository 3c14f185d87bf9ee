"""The exporter ``promela``."""

from __future__ import annotations

from fsmkit.export.exporter import Exported, ExportOptions
from fsmkit.system.system import System


class Promela:
    """Writes a network of automata for SPIN."""

    name = "promela"
    summary = "SPIN: a process for each machine, a channel for each queue"

    def export(self, system: System, wanted: ExportOptions) -> Exported:
        """Explore by the interpreter, then write the local steps."""
        from fsmkit.export.collect import network_of
        from fsmkit.export.promela.model import written

        network = network_of(system, wanted)
        figures = {"states": network.states, "transitions": network.transitions}
        return Exported(written(network), figures)


PLUGIN = Promela()
