"""Translators for foreign nodes of the kind ``can``."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fsmkit.diagnostics import fail
from fsmkit.runtime.links.link import Link, Translator

if TYPE_CHECKING:
    from fsmkit.system.deployment import Deployment


class CanBuses:
    """Opens buses by python-can."""

    name = "can"

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return what joins a link with a bus; ``options``: those of `can_options`.

        ``interface`` names one of python-can, by default `socketcan`; ``clock`` returns seconds.
        """
        try:
            from can import CanError

            from fsmkit.runtime.can.translator import CanTranslator, open_bus
        except ImportError as error:
            raise fail(
                "missing-package",
                f"a CAN bus needs python-can: {error}",
                help="pip install 'fsmkit[can]'",
            ) from error
        interface = options.get("interface", "socketcan")
        try:
            bus = open_bus(options["bus"], interface, options["wires"])
        except (OSError, ValueError, CanError) as error:
            raise fail(
                "link-not-opened",
                f"the bus `{options['bus']}` cannot be opened: {error}",
                help="name an interface that is up, or `udp:239.74.163.2:43113` for a test",
            ) from error
        return CanTranslator(
            link, node, options["wires"], bus, options.get("clock", time.monotonic)
        )


def can_options(deployment: Deployment, node: str) -> dict[str, dict[str, Any]]:
    """Return ``foreign`` of `fsmkit.runtime.fan.open_link`, for the buses of a node."""
    from fsmkit.system.can_wires import can_wires

    found = {}
    for wires in can_wires(deployment, deployment.nodes.index(node)):
        kind = deployment.foreign[wires.peer]
        if kind is not None and "bus" in kind.options:
            bus = kind.options["bus"].value
            found[deployment.nodes[wires.peer]] = {"bus": bus, "wires": wires}
    return found


PLUGIN = CanBuses()
