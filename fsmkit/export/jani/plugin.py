"""The exporter ``jani``."""

from __future__ import annotations

from fsmkit.export.exporter import Exported, ExportOptions
from fsmkit.system.system import System


class Jani:
    """Writes a network of automata as a jani-model."""

    name = "jani"
    summary = "Storm and other readers of JANI: an automaton for each machine"

    def export(self, system: System, wanted: ExportOptions) -> Exported:
        """Explore, then write the local steps."""
        from fsmkit.export.collect import exported
        from fsmkit.export.jani.model import written

        return exported(system, wanted, written)


PLUGIN = Jani()
