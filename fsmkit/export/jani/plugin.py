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
        from fsmkit.export.jani.layout import laid_out
        from fsmkit.export.jani.model import model_of

        return exported(system, wanted, lambda network, found: laid_out(model_of(network, found)))


PLUGIN = Jani()
