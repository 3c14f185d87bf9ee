"""The exporter ``live``: the protocol's own messages, one a line."""

from fsmkit.inspector.exports import Format

PLUGIN = Format("live", ".live", __package__)
