"""The transport ``file:PATH``: a file, which may grow, or ``-`` for standard input."""

from fsmkit.runtime.tracing.transports import Transport

PLUGIN = Transport("file", "file:PATH", None, f"{__package__}.reading", "FileSource")
