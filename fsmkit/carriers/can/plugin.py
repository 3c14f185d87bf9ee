"""CAN: links on a bus that nodes share, and translators for foreign nodes on a bus."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fsmkit.carriers.can.keys import FOREIGN_KEYS, LINK_KEYS
from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.document.keys import Keys
from fsmkit.emit import snake
from fsmkit.runtime.links.link import SLOTS

if TYPE_CHECKING:
    from can import BusABC

    from fsmkit.carriers.can.message import CanWire
    from fsmkit.codegen.system.node import Node
    from fsmkit.runtime.links.link import Link, LinkRequest, Translator
    from fsmkit.system.deployment.carrier import DeploymentRequest, ForeignNetwork, Network
    from fsmkit.system.deployment.delays import Latency
    from fsmkit.system.deployment.deployment import Deployment


class Can:
    """Reads the CAN part of a deployment, opens buses by python-can, and writes tables in C."""

    name = "can"
    link_keys: Keys = LINK_KEYS
    required_keys: Mapping[str, str] = MappingProxyType({"bus": "can0"})
    foreign_keys: Keys = FOREIGN_KEYS
    options: tuple[str, ...] = ("net", "bus", "interface", "clock", "slots")
    library = Path(__file__).parent / "c"
    node_suffixes: tuple[str, ...] = (".dbc",)

    # --- a deployment ------------------------------------------------------------------------

    def read(self, request: DeploymentRequest, findings: Findings) -> Network | None:
        """Return the bus that the nodes of fsmkit share."""
        from fsmkit.carriers.can.deployment import read_bus

        return read_bus(request, findings)

    def read_foreign(
        self, place: int, request: DeploymentRequest, network: Network | None, findings: Findings
    ) -> ForeignNetwork | None:
        """Return the bus of a foreign node, and its file."""
        from fsmkit.carriers.can.deployment import read_node

        return read_node(place, request, network, findings)

    def latencies(
        self,
        request: DeploymentRequest,
        network: Network | None,
        foreign: Mapping[int, ForeignNetwork],
        findings: Findings,
    ) -> Iterable[Latency]:
        """Yield the worst-case response times of messages, by connection."""
        from fsmkit.carriers.can.deployment import latencies

        return latencies(request, network, foreign, findings)

    # --- links -------------------------------------------------------------------------------

    def open(self, request: LinkRequest) -> Link:
        """Return a link of a node on a shared bus; ``options``: those of `link_options`.

        ``bus``, ``interface``, ``clock``: as for `translator`; ``slots``: events that wait in each
        direction.
        """
        from fsmkit.carriers.can.bus import CanNet

        options, event_map = request.options, request.event_map
        net = options.get("net")
        if not isinstance(net, CanNet):
            raise fail(
                "link-not-opened",
                f"links on a bus need messages, and the deployment of `{event_map.system}` has "
                "links of another kind",
                help="write `links: {kind: can, bus: can0}` in the deployment, or open its kind",
            )
        bus = _open_bus(options.get("bus", net.bus), options, net.wires, is_fd=net.is_fd)
        from fsmkit.carriers.can.link import CanLink

        return CanLink(
            event_map,
            request.node,
            net,
            bus,
            session=request.session,
            faults=request.faults,
            slots=options.get("slots", SLOTS),
            clock=options.get("clock", time.monotonic),
        )

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return the translator between a link and a bus; ``options``: those of `foreign_options`.

        ``interface`` names one of python-can, by default `socketcan`. ``clock`` returns seconds of
        a simulated time; its owner then also calls `CyclicMessages.send_due` of the translator.
        """
        wires = options["wires"]
        bus = _open_bus(options["bus"], options, wires.received, is_fd=False)
        from fsmkit.carriers.can.translator import CanTranslator
        from fsmkit.system.deployment.watchdog import WATCHDOG

        watchdog = options.get("watchdog", WATCHDOG) / 1000
        clock = options.get("clock")
        translator = CanTranslator(link, node, wires, bus, clock or time.monotonic, watchdog)
        if clock is None:
            translator.cyclic.start()
        return translator

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return the bus that the nodes of a deployment share, if they do."""
        from fsmkit.carriers.can.deployment import bus_of

        net = bus_of(deployment)
        return {} if net is None else {"net": net}

    def foreign_options(self, deployment: Any, node: str) -> dict[str, dict[str, Any]]:
        """Return, by foreign node, its bus and the messages that a node exchanges with it."""
        from fsmkit.carriers.can.exchanged import can_wires

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

    # --- files -------------------------------------------------------------------------------

    def files(self, deployment: Deployment) -> dict[str, str]:
        """Return the DBC file of the bus that nodes share."""
        from fsmkit.carriers.can.deployment import bus_of

        net = bus_of(deployment)
        return {} if net is None else {f"{snake(deployment.system.name)}.dbc": net.dbc}

    def node_files(self, node: Node) -> dict[str, str]:
        """Return the tables of ``fsm_can.h``."""
        from fsmkit.carriers.can.tables import compose_can

        return compose_can(node)

    def rejection(self, deployment: Deployment, target: str) -> FsmkitError | None:
        """Return None: each target writes a deployment with CAN."""
        del deployment, target
        return None

    def timing_lines(self, deployment: Deployment) -> Iterable[str]:
        """Yield the worst-case response times of messages on the buses of a deployment."""
        from fsmkit.carriers.can.timing_report import timing_lines

        return timing_lines(deployment)

    def timing_figures(self, deployment: Deployment) -> Mapping[str, object]:
        """Return the same as data, if there is a bus."""
        from fsmkit.carriers.can.timing_report import timing_figures

        return timing_figures(deployment)

    def chart_of_node(
        self, path: Path, node: str | None, findings: Findings, *, may_fall_silent: bool
    ) -> str:
        """Return the chart of a node of a DBC file, in YAML. Raises `FsmkitError` for none."""
        from fsmkit.carriers.can.chart_of_dbc import chart_of
        from fsmkit.carriers.can.dbc import read_dbc
        from fsmkit.chart.loading import read_bytes

        dbc = read_dbc(path, read_bytes(path), findings)
        findings.stop_on_errors()
        if dbc is None or node is None:
            raise fail(
                "wrong-option",
                f"`{path}` describes a bus, but a chart represents one node of it",
                help=f"write `--node` with one of {', '.join(dbc.nodes) if dbc else 'its nodes'}",
            )
        return chart_of(dbc, node, may_fall_silent=may_fall_silent)


def _open_bus(
    name: str, options: Mapping[str, Any], received: Iterable[CanWire], *, is_fd: bool
) -> BusABC:
    try:
        from can import CanError

        from fsmkit.carriers.can.translator import open_bus
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


PLUGIN = Can()
