"""The carrier ``tcp:HOST:PORT``: a serial line behind a server, for instance of an emulator."""

from __future__ import annotations

from fsmkit.runtime.tracing.transports import Source


class TcpCarrier:
    """Connects to a server that sends frames."""

    name = "tcp"
    form = "tcp:HOST:PORT"
    framed = True

    def open_source(self, address: str) -> Source:
        """Connect."""
        from fsmkit.runtime.tracing.transports.tcp.connection import connect

        return connect(self.name, address)


PLUGIN = TcpCarrier()
