"""Mermaid as a plug-in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class Mermaid:
    """Draws charts as Mermaid's state diagrams, which Git forges and wikis show."""

    name = "mermaid"
    suffixes = (".mmd", ".mermaid")

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return a diagram in which the given states stand out."""
        from fsmkit.diagram.states.mermaid.draw import draw

        return draw(chart, active)


PLUGIN = Mermaid()
