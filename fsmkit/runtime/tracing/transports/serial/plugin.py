"""The carrier ``serial:DEVICE:BAUD``."""

from __future__ import annotations

from fsmkit.runtime.tracing.transports import Source


class SerialCarrier:
    """Opens a serial line: 8 bits, no parity, 1 stop bit, no flow control."""

    name = "serial"
    form = "serial:DEVICE:BAUD"
    framed = True

    def open_source(self, address: str) -> Source:
        """Open the line."""
        from fsmkit.runtime.tracing.transports.serial.line import SerialSource

        return SerialSource(address)


PLUGIN = SerialCarrier()
