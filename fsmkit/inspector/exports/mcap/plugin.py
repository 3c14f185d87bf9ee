"""The exporter ``mcap``: a log of channels, for Foxglove."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from fsmkit.runtime.live.messages import AnyMessage


class McapExporter:
    """Writes a log of channels, for Foxglove."""

    name = "mcap"
    suffix = ".mcap"

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages."""
        from fsmkit.inspector.exports.mcap.writing import write

        write(messages, out)


PLUGIN = McapExporter()
