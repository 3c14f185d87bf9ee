"""Charts as Mermaid's state diagrams, which Git forges and wikis show."""

from fsmkit.chart.drawing.drawing import Notation

PLUGIN = Notation("mermaid", (".mmd", ".mermaid"), __package__)
