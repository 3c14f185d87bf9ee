"""The carrier ``rtt:HOST:PORT``: the server of a debug probe (OpenOCD, pyOCD, J-Link) for RTT."""

from __future__ import annotations

from fsmkit.runtime.tracing.transports import Source


class RttCarrier:
    """Connects to a server that reads the ring of the target and loses nothing."""

    name = "rtt"
    form = "rtt:HOST:PORT"
    framed = False

    def open_source(self, address: str) -> Source:
        """Connect."""
        from fsmkit.runtime.tracing.transports.tcp.connection import connect

        return connect(self.name, address)


PLUGIN = RttCarrier()
