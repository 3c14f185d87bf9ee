"""``recoverable: P``: from every reachable state, P can be reached again (AG EF P)."""

from __future__ import annotations

from fsmkit.system.properties.property import Kind, OverGraph

KIND = Kind(
    "recoverable",
    OverGraph("recoverable", violation="from the end of this path on it never holds again"),
)
