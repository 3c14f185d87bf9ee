"""The CAN part of a deployment: the bus that nodes share, and foreign nodes on buses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.carriers.can.bus import CAN, PERIOD, CanNet, can_net, late_by_connection, report_late
from fsmkit.carriers.can.foreign import (
    CanNode,
    CanTimes,
    bitrate_of,
    can_node,
    late_of_node,
    report_missing_messages,
)
from fsmkit.carriers.can.response_times import TimedFrame, frames_of
from fsmkit.diagnostics import Findings
from fsmkit.system.deployment.carrier import DeploymentRequest, ForeignNetwork, ForeignNode
from fsmkit.system.deployment.delays import Latency
from fsmkit.system.deployment.deployment import Deployment


def read_bus(request: DeploymentRequest, findings: Findings) -> CanNet | None:
    """Return the bus that the nodes of fsmkit share; None after an error."""
    cycle = PERIOD if request.cycle is None else request.cycle
    levels = cycle, request.every
    return can_net(request.map, request.wires.events, request.options, levels, findings)


def read_node(
    place: int, request: DeploymentRequest, network: object, findings: Findings
) -> CanNode | None:
    """Return a foreign node on a bus; None where it names no file, or after an error."""
    kind = request.foreign[place]
    if kind is None:
        return None
    own = network.frames if isinstance(network, CanNet) and _is_on(kind, network) else ()
    others = [frame for _, frame in own]
    return can_node(request.nodes[place], kind.options, request.folder, others, findings)


def latencies(
    request: DeploymentRequest,
    network: object,
    foreign: Mapping[int, ForeignNetwork],
    findings: Findings,
) -> Iterator[Latency]:
    """Yield maximum latencies of events: for each foreign node, then for the shared bus."""
    buses = _buses(foreign)
    for place, bus in buses.items():
        kind = request.foreign[place]
        if kind is not None:
            machines, at = request.machines_of(place), kind.options["dbc"]
            report_missing_messages(request.system, machines, bus, at, findings)
            yield Latency(late_of_node(request.system, machines, bus), at.span)
    if isinstance(network, CanNet):
        at = request.options["bus"]
        _report_clashes(request, network, buses, findings)
        times = network.times(_frames_on(network, request.foreign, buses))
        report_late(times, network, at, findings)
        late = late_by_connection(request.system, request.wires.events, network, times)
        yield Latency(late, at.span)


def bus_of(deployment: Deployment) -> CanNet | None:
    """Return the bus that the nodes of fsmkit share, if they do."""
    return deployment.network if isinstance(deployment.network, CanNet) else None


def buses_of(deployment: Deployment) -> dict[int, CanNode]:
    """Return the foreign nodes with a named bus file, by index."""
    return _buses(deployment.foreign_networks)


def times_of_buses(deployment: Deployment) -> tuple[CanTimes, ...]:
    """Return the response times of all buses, the one that nodes of fsmkit share first."""
    network, buses = bus_of(deployment), buses_of(deployment)
    frames = [] if network is None else _frames_on(network, deployment.foreign, buses)
    own = () if network is None else (network.times(frames),)
    return (*own, *(bus.times for bus in buses.values()))


def _buses(foreign: Mapping[int, ForeignNetwork]) -> dict[int, CanNode]:
    return {place: found for place, found in foreign.items() if isinstance(found, CanNode)}


def _is_on(kind: ForeignNode | None, network: CanNet) -> bool:
    """Whether a foreign node is on the bus that nodes of fsmkit share."""
    if kind is None or kind.kind != CAN or "bus" not in kind.options:
        return False
    return kind.options["bus"].value == network.bus


def _frames_on(
    network: CanNet, foreign: tuple[ForeignNode | None, ...], buses: Mapping[int, CanNode]
) -> list[TimedFrame]:
    """Return the frames of foreign nodes on the bus that nodes of fsmkit share."""
    found: list[TimedFrame] = []
    for place, bus in buses.items():
        if _is_on(foreign[place], network):
            found += frames_of(bus.dbc, network.bitrate)
    return found


def _report_clashes(
    request: DeploymentRequest, network: CanNet, buses: Mapping[int, CanNode], findings: Findings
) -> None:
    """Report foreign nodes with another bitrate, or with identifiers of the shared bus."""
    at = request.options["bus"]
    own = {wire.message.frame: wire.message.name for wire in network.wires}
    for place, bus in buses.items():
        kind = request.foreign[place]
        if kind is None or not _is_on(kind, network):
            continue
        bitrate = bitrate_of(kind.options.get("bitrate"), Findings())  # reported with the node
        if bitrate != network.bitrate:
            findings.add(
                "broken-deployment",
                f"`{network.bus}` has {network.bitrate} bits per second here, and {bitrate} for "
                f"`{request.nodes[place]}`",
                at,
                secondary=[(kind.span, "the foreign node")],
                help="give both the same `bitrate`",
            )
        for message in bus.dbc.messages:
            if not message.is_extended and message.frame in own:
                findings.add(
                    "broken-deployment",
                    f"`{message.name}` and `{own[message.frame]}` have the identifier "
                    f"0x{message.frame:x} on one bus",
                    at,
                    secondary=[(message.span, "it is declared here")],
                    help="choose another `base`",
                )
