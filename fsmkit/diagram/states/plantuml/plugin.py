"""PlantUML as a plug-in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsmkit.chart.chart import Chart


class PlantUml:
    """Draws charts as PlantUML's state diagrams."""

    name = "plantuml"
    suffixes = (".puml", ".plantuml")

    def draw(self, chart: Chart, active: frozenset[int]) -> str:
        """Return a diagram in which the given states stand out."""
        from fsmkit.diagram.states.plantuml.draw import draw

        return draw(chart, active)


PLUGIN = PlantUml()
