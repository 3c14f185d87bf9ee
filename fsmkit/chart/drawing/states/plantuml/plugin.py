"""Charts as PlantUML's state diagrams."""

from fsmkit.chart.drawing.drawing import Notation

PLUGIN = Notation("plantuml", (".puml", ".plantuml"), __package__)
