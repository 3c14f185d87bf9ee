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
        from fsmkit.export.collect import exported
        from fsmkit.export.promela.model import written

        return exported(system, wanted, written)


PLUGIN = Promela()
