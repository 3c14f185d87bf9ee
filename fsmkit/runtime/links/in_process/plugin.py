"""The plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fsmkit.runtime.links.event_map import EventMap
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.in_process.link import InProcessLink, Wire


class InProcess:
    """Opens links within one program; the option ``wire`` joins them."""

    name = "in_process"

    def open(
        self,
        event_map: EventMap,
        node: str,
        *,
        session: int,
        faults: Faults | None = None,
        options: Mapping[str, Any],
    ) -> InProcessLink:
        """Return a link of a node."""
        wire = options.get("wire")
        if not isinstance(wire, Wire):
            raise TypeError("links within a program need the option `wire`, the same for all")
        return InProcessLink(event_map, node, wire, session=session, faults=faults)


PLUGIN = InProcess()
