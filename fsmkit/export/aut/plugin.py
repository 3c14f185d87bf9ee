"""The exporter ``aut``."""

from fsmkit.export.exporter import Notation

PLUGIN = Notation("aut", "mCRL2 and CADP: the transition system", __package__)
