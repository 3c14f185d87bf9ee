"""Graphviz as a plug-in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class Dot:
    """Draws charts in the language of Graphviz's ``dot``."""

    name = "dot"
    suffixes = (".dot", ".gv")

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return a diagram in which the given states stand out."""
        from fsmkit.diagram.states.dot.draw import draw

        return draw(chart, active)


PLUGIN = Dot()
