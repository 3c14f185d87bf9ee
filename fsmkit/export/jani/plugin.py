"""The exporter ``jani``."""

from fsmkit.export.exporter import Notation

PLUGIN = Notation(
    "jani", "Storm and other readers of JANI: an automaton for each machine", __package__
)
