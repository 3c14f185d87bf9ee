"""The keys of deployments with CAN: of the links of nodes, and of foreign nodes."""

from __future__ import annotations

from fsmkit.document.keys import named

LINK_KEYS = named(
    bus="the interface of the bus, such as can0",
    base="the identifier of the first message; 0x100 unless it says so",
    bitrate="bits of the bus in a second; 500000 unless it says so",
    error_every="the shortest time between two errors; 10ms unless it says so",
    period="the cycle of the nodes; 10ms unless it says so",
)
FOREIGN_KEYS = named(
    bus="the interface of the bus, such as can0",
    dbc="the file with its messages",
    bitrate="bits of the bus in a second; 500000 unless it says so",
    error_every="the shortest time between two errors of the bus; 10ms unless it says so",
)
