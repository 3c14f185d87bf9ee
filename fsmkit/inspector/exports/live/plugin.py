"""The exporter ``live``: the protocol's own messages, one a line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from fsmkit.runtime.live.messages import AnyMessage


class LiveExporter:
    """Writes the protocol's own messages, one a line."""

    name = "live"
    suffix = ".live"

    def export_messages(self, messages: Iterable[AnyMessage], out: BinaryIO) -> None:
        """Write messages."""
        from fsmkit.inspector.exports.live.writing import write

        write(messages, out)


PLUGIN = LiveExporter()
