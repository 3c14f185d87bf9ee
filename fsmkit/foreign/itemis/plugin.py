"""Statecharts of itemis CREATE as a plug-in: read, not written."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation("itemis", (".sct", ".ysc"), __package__)
"""The notation of itemis CREATE and of YAKINDU Statechart Tools 2 and 3, an XML format."""
