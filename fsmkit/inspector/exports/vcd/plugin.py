"""The exporter ``vcd``: value changes, for GTKWave and PulseView."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from fsmkit.runtime.live.messages import AnyMessage


class VcdExporter:
    """Writes value changes, for GTKWave and PulseView."""

    name = "vcd"
    suffix = ".vcd"

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages."""
        from fsmkit.inspector.exports.vcd.writing import write

        write(messages, out)


PLUGIN = VcdExporter()
