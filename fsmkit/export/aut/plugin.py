"""The exporter ``aut``."""

from __future__ import annotations

from fsmkit.export.exporter import Exported, ExportOptions
from fsmkit.system.system import System


class Aldebaran:
    """Writes the transition system of a closed system."""

    name = "aut"
    summary = "mCRL2 and CADP: the transition system"

    def export(self, system: System, wanted: ExportOptions) -> Exported:
        """Explore by the interpreter, then write."""
        from fsmkit.export.aut.text import written
        from fsmkit.export.transition_system import system_of

        found = system_of(system, wanted)
        figures = {"states": found.states, "transitions": len(found.arrows)}
        return Exported("".join(written(found)), figures)


PLUGIN = Aldebaran()
