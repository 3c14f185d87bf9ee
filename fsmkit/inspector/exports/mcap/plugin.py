"""The exporter ``mcap``: a log of channels, for Foxglove."""

from fsmkit.inspector.exports import Format

PLUGIN = Format("mcap", ".mcap", __package__)
