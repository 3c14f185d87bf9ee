"""Charts in the language of Graphviz's ``dot``."""

from fsmkit.chart.drawing.drawing import Notation

PLUGIN = Notation("dot", (".dot", ".gv"), __package__)
