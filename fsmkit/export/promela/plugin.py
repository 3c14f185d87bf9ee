"""The exporter ``promela``."""

from fsmkit.export.exporter import Notation

PLUGIN = Notation(
    "promela", "SPIN: a process for each machine, a channel for each queue", __package__
)
