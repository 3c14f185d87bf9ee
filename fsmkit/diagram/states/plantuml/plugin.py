"""Charts as PlantUML's state diagrams."""

from fsmkit.plugins import Notation

PLUGIN = Notation("plantuml", (".puml", ".plantuml"), __package__)
