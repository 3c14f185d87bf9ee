"""Links between nodes of one thread: frames arrive when the cycle of their sender ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fsmkit.diagnostics import fail
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import SLOTS, Link, LinkRequest, LinkTimeout
from fsmkit.system.deployment.event_map import EventMap


class Wire:
    """The connection of the links of one program."""

    def __init__(self) -> None:
        self.links: dict[int, InProcessLink] = {}


class InProcessLink(Link):
    """A link of a node, connected with the others of its wire; a second one replaces the first."""

    def __init__(
        self,
        event_map: EventMap,
        node: str,
        wire: Wire,
        *,
        session: int = 1,
        faults: Faults | None = None,
        slots: int = SLOTS,
    ) -> None:
        super().__init__(event_map, node, session, faults, slots, is_proven=True)
        self._wire = wire
        wire.links[self.node] = self

    def wait_listeners(self, timeout: float) -> None:
        """Raise `LinkTimeout` if a node is missing: waiting would change nothing."""
        for node in self.map.own_nodes:
            if node not in self._wire.links:
                own, name = self.map.nodes[self.node], self.map.nodes[node]
                raise LinkTimeout(f"node `{own}` waited {timeout} s for `{name}` to listen")

    def close(self) -> None:
        """Leave the wire."""
        super().close()
        if self._wire.links.get(self.node) is self:
            del self._wire.links[self.node]

    def _wake(self) -> None:
        while (frame := self.next_frame()) is not None:
            for link in list(self._wire.links.values()):
                if link is not self:
                    link.receiver.arrive(self.node, frame)

    def _take_in(self, node: int, timeout: float) -> bool:  # noqa: ARG002  (all is there)
        return False


class InProcess:
    """Opens links within one program; the option ``wire`` connects them."""

    name = "in_process"
    options: tuple[str, ...] = ("wire",)
    library = Path(__file__).parent / "c"

    def open(self, request: LinkRequest) -> InProcessLink:
        """Return a link of a node."""
        wire = request.options.get("wire")
        if not isinstance(wire, Wire):
            raise fail(
                "link-not-opened",
                "links within a program need the option `wire`, the same for all of its nodes",
                help="pass `options={'wire': wire}` with one `fsmkit.carriers.in_process.Wire()`",
            )
        return InProcessLink(
            request.event_map, request.node, wire, session=request.session, faults=request.faults
        )

    def link_options(self, deployment: Any) -> dict[str, Any]:  # noqa: ARG002  (there is no wire)
        """Return nothing: the program has the wire."""
        return {}


PLUGIN = InProcess()
