"""The exporter ``dot``."""

from fsmkit.export.exporter import Notation

PLUGIN = Notation("dot", "Graphviz: the same, to be looked at", __package__)
