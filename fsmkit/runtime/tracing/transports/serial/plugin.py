"""The carrier ``serial:DEVICE:BAUD``: 8 bits, no parity, 1 stop bit, no flow control."""

from fsmkit.runtime.tracing.transports import Transport

PLUGIN = Transport("serial", "serial:DEVICE:BAUD", True, f"{__package__}.line", "SerialSource")
