"""Machines of QM as a plug-in: read, not written."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation("qm", (".qm",), __package__)
"""The notation of QM 5 and newer, an XML format."""
