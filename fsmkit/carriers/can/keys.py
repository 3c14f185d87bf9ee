"""The keys of deployments with CAN: of the links of nodes, and of foreign nodes."""

from __future__ import annotations

from fsmkit.document.keys import named

LINK_KEYS = named(
    bus="the interface of the bus, such as can0",
    base="the identifier of the first message (default: 0x100)",
    bitrate="bits of the bus per second (default: 500000)",
    error_every="the shortest time between two errors (default: 10ms)",
    period="the cycle of the nodes (default: 10ms)",
)
FOREIGN_KEYS = named(
    bus="the interface of the bus, such as can0",
    dbc="the file with its messages",
    bitrate="bits of the bus per second (default: 500000)",
    error_every="the shortest time between two errors of the bus (default: 10ms)",
)
