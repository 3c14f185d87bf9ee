"""Charts in the language of Graphviz's ``dot``."""

from fsmkit.plugins import Notation

PLUGIN = Notation("dot", (".dot", ".gv"), __package__)
