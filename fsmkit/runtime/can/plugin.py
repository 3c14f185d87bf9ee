"""Links on a CAN bus, and translators for foreign nodes of the kind ``can``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics import fail
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import SLOTS, Link, Translator
from fsmkit.system.deployment.event_map import EventMap
from fsmkit.system.deployment.watchdog import WATCHDOG

if TYPE_CHECKING:
    from can import BusABC

    from fsmkit.can.wire import CanWire


class CanBuses:
    """Opens buses by python-can."""

    name = "can"

    def open(
        self,
        event_map: EventMap,
        node: str,
        *,
        session: int,
        faults: Faults | None = None,
        options: Mapping[str, Any],
    ) -> Link:
        """Return a link of a node, on a bus that nodes share; ``options``: those of `link_options`.

        ``bus``, ``interface``, ``clock``: as of `translator`; ``slots``: events that wait in each
        direction.
        """
        from fsmkit.system.can_net import CanNet

        net = options.get("net")
        if not isinstance(net, CanNet):
            raise TypeError("links on a bus need the option `net`: see `link_options`")
        bus = _opened(options.get("bus", net.bus), options, net.wires, is_fd=net.is_fd)
        from fsmkit.runtime.can.net import CanLink

        return CanLink(
            event_map,
            node,
            net,
            bus,
            session=session,
            faults=faults,
            slots=options.get("slots", SLOTS),
            clock=options.get("clock", time.monotonic),
        )

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return what joins a link with a bus; ``options``: those of `foreign_options`.

        ``interface`` names one of python-can, by default `socketcan`. ``clock`` returns seconds of
        a simulated time; its owner then also calls `CyclicMessages.send_due` of the translator.
        """
        wires = options["wires"]
        bus = _opened(options["bus"], options, wires.received, is_fd=False)
        from fsmkit.runtime.can.translator import CanTranslator

        watchdog = options.get("watchdog", WATCHDOG) / 1000
        clock = options.get("clock")
        translator = CanTranslator(link, node, wires, bus, clock or time.monotonic, watchdog)
        if clock is None:
            translator.cyclic.start()
        return translator

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return the bus that the nodes of a deployment share."""
        return {"net": deployment.net}

    def foreign_options(self, deployment: Any, node: str) -> dict[str, dict[str, Any]]:
        """Return, by foreign node, its bus and the messages that a node exchanges with it."""
        from fsmkit.system.can_wires import can_wires

        found = {}
        for wires in can_wires(deployment, deployment.nodes.index(node)):
            kind = deployment.foreign[wires.peer]
            if kind is not None and "bus" in kind.options:
                bus = kind.options["bus"].value
                found[deployment.nodes[wires.peer]] = {
                    "bus": bus,
                    "wires": wires,
                    "watchdog": deployment.watchdog,
                }
        return found


def _opened(
    name: str, options: Mapping[str, Any], received: Iterable[CanWire], *, is_fd: bool
) -> BusABC:
    try:
        from can import CanError

        from fsmkit.runtime.can.translator import open_bus
    except ImportError as error:
        raise fail(
            "missing-package",
            f"a CAN bus needs python-can: {error}",
            help="pip install 'fsmkit[can]'",
        ) from error
    try:
        return open_bus(name, options.get("interface", "socketcan"), received, is_fd=is_fd)
    except (OSError, ValueError, CanError) as error:
        raise fail(
            "link-not-opened",
            f"the bus `{name}` cannot be opened: {error}",
            help="name an interface that is up, or `udp:239.74.163.2:43113` for a test",
        ) from error


PLUGIN = CanBuses()
