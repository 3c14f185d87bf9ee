"""The exporter ``perfetto``: tracks of slices, for ui.perfetto.dev."""

from fsmkit.inspector.exports import Format

PLUGIN = Format("perfetto", ".pftrace", __package__)
