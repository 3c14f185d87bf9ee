"""The carrier ``file:PATH``: a file, or ``-`` for standard input."""

from __future__ import annotations

from fsmkit.runtime.tracing.transports import Source


class FileCarrier:
    """Reads a file to its end; a file that grows is read on."""

    name = "file"
    form = "file:PATH"
    framed = None

    def open_source(self, address: str) -> Source:
        """Open a file for reading."""
        from fsmkit.runtime.tracing.transports.file.reading import FileSource

        return FileSource(address)


PLUGIN = FileCarrier()
