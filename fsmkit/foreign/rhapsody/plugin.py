"""Statecharts of Rhapsody as a plug-in: read, not written."""

from fsmkit.foreign.notation import ForeignNotation

PLUGIN = ForeignNotation(
    "rhapsody", (".sbs", ".cls", ".rpy", ".sbsx", ".clsx", ".rpyx"), __package__
)
"""The notation of Rhapsody's packages, classes and projects."""
