"""The carrier ``file:PATH``: a file, or ``-`` for standard input; one that grows is read on."""

from fsmkit.runtime.tracing.transports import Transport

PLUGIN = Transport("file", "file:PATH", None, f"{__package__}.reading", "FileSource")
