"""The exporter ``vcd``: value changes, for GTKWave and PulseView."""

from fsmkit.inspector.exports import Format

PLUGIN = Format("vcd", ".vcd", __package__)
