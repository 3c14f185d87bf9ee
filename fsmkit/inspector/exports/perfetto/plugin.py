"""The exporter ``perfetto``: tracks of slices, for ui.perfetto.dev."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from fsmkit.runtime.live.messages import AnyMessage


class PerfettoExporter:
    """Writes tracks of slices, for ui.perfetto.dev."""

    name = "perfetto"
    suffix = ".pftrace"

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages."""
        from fsmkit.inspector.exports.perfetto.writing import write

        write(messages, out)


PLUGIN = PerfettoExporter()
