"""Reads deployments: which machine of a system runs on which node, and what joins the nodes.

``system: ring.yaml``, ``nodes: {a: [feeder, molder], b: [extractor]}``, ``links: {...}``. A node of
the form ``{machines: [heater], foreign: can}`` stands for programs that know nothing of fsmkit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

from fsmkit.can.timing import TimedFrame, frames_of
from fsmkit.chart.loading import named_file, read_bytes
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggest import suggest
from fsmkit.document import keys
from fsmkit.language import Scope, read_duration
from fsmkit.language.units import duration_text
from fsmkit.system.can_net import (
    OPTIONS,
    PERIOD,
    CanNet,
    can_net,
    connection_of,
    late_by_connection,
    report_late,
)
from fsmkit.system.can_nodes import (
    CanNode,
    CanTimes,
    bitrate_of,
    can_node,
    lateness,
    report_unfit,
    with_delays,
)
from fsmkit.system.channels import without_channels
from fsmkit.system.deployment.addresses import is_loopback, rejection_of
from fsmkit.system.deployment.crossing import Wires, wires_of
from fsmkit.system.deployment.event_map import EventMap
from fsmkit.system.deployment.watchdog import LOOKS, WATCHDOG
from fsmkit.system.indices import integer
from fsmkit.system.limits_of_c import report_limits
from fsmkit.system.machines import Replacement
from fsmkit.system.ros_nodes import RosNet, RosNode, is_insecure_as, ros_net, ros_node
from fsmkit.system.system import EventLink, InputLink, System, part_of
from fsmkit.system.system_file import load_system
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import (
    Node,
    check_keys,
    require_mapping,
    require_record,
    require_text,
    texts_of,
)

LEAST_WATCHDOG, MOST_WATCHDOG = 4, 60_000
"""Milliseconds."""
MOST_NODES = 8
"""As many as ``FSM_LINK_NODES`` of the library in C, by default."""


@dataclass(frozen=True)
class ForeignNode:
    """A node whose programs know nothing of fsmkit: its machines are models of them.

    ``options``: what `links: {foreign: ...}` says of it, by the keys of its kind.
    """

    kind: str
    span: Span
    options: Mapping[str, Text]
    tables: Mapping[str, Node] = field(default_factory=dict, compare=False)
    """Those that are no text."""


@dataclass(frozen=True)
class Deployment:
    """A system spread over nodes. ``placed[machine]``: the node; None for the environment's."""

    written: System
    """What is explored: as its file has it, with the delays of messages on buses."""
    system: System
    """Without the models of its connections, which the links of the nodes replace."""
    nodes: tuple[str, ...]
    placed: tuple[int | None, ...]
    wires: Wires
    every: int = 1
    """Levels are published in every so-many-th cycle."""
    keys: Path | None = None
    """The folder with the CURVE keys of the nodes; None: no authentication."""
    health: tuple[str, ...] = ()
    """Where each node answers how it is, "" for one that does not; see `fsmkit.runtime.health`."""
    foreign: tuple[ForeignNode | None, ...] = ()
    """By node: what it is, None where it runs machines of fsmkit."""
    buses: Mapping[int, CanNode] = field(default_factory=dict)
    """The foreign nodes on a CAN bus with a DBC file, by their places."""
    ros: Mapping[int, RosNode] = field(default_factory=dict)
    """The foreign nodes of ROS, by their places."""
    net: CanNet | None = None
    """The CAN bus that the nodes of fsmkit share, if they do."""
    net_times: CanTimes | None = None
    """Its response times."""
    topics: RosNet | None = None
    """The topics of ROS by which the nodes of fsmkit exchange their frames, if they do."""
    watchdog: int = WATCHDOG
    """Milliseconds after its last cycle in which a node that hangs falls silent."""

    @property
    def carrier(self) -> str:
        """The kind of the links between the nodes of fsmkit."""
        if self.topics is not None:
            return "ros"
        return "zeromq" if self.net is None else "can"

    @property
    def bus_times(self) -> tuple[CanTimes, ...]:
        """The response times of all buses."""
        own = () if self.net_times is None else (self.net_times,)
        return (*own, *(bus.times for bus in self.buses.values()))

    @property
    def own_nodes(self) -> tuple[int, ...]:
        """The nodes that run machines of fsmkit, by their places."""
        return self.map.own_nodes

    @property
    def map(self) -> EventMap:
        """What crosses the nodes."""
        return self.wires.map

    def machines_of(self, place: int) -> tuple[int, ...]:
        """Return the machines of a node, by their numbers in the system."""
        return tuple(number for number, node in enumerate(self.placed) if node == place)

    def part(self, place: int) -> System:
        """Return the machines of a node as a system, with the connections among them."""
        name = f"{self.system.name}_{self.nodes[place]}"
        return replace(part_of(self.system, self.machines_of(place)), name=name, possible=())


def deployment_of(
    root: Node | None,
    folder: Path,
    findings: Findings,
    replacing: Mapping[str, Replacement] = MappingProxyType({}),
    *,
    strict: bool = False,
    parameters: Mapping[str, str] = MappingProxyType({}),
) -> Deployment | None:
    """Read a deployment; paths in it are relative to ``folder``. Mind the findings.

    ``replacing``, ``strict``, ``parameters``: as of `fsmkit.system.any_file.read`.
    """
    parts = require_record(root, keys.DEPLOYMENT, "a deployment", findings, keys.BELONGS)
    if root is None or parts is None:
        return None
    if not {"system", "nodes"} <= set(parts):
        findings.add(
            "broken-deployment", "a deployment needs `system` and `nodes`", root.span, help=EXAMPLE
        )
        return None
    file = require_text(parts["system"], "the path of the system", findings)
    if file is None:
        return None
    path = named_file(folder / "deployment", file.value)
    read_bytes(path, file)
    written = load_system(path, findings, replacing, strict=strict, parameters=parameters)
    system = without_channels(written)
    found = _placed(parts["nodes"], system, findings)
    if found is None or findings.has_errors:
        return None
    nodes, placed, kinds = found
    options = require_record(parts.get("links"), keys.LINKS, "`links`", findings) or {}
    foreign = _with_options(kinds, nodes, options.get("foreign"), findings)
    _report_foreign_pairs(system, nodes, placed, foreign, findings)
    own = tuple(name for name, kind in zip(nodes, foreign, strict=True) if kind is None)
    carrier, net_options = _net_options(options, own, findings)
    is_insecure = is_insecure_as(
        require_text(options.get("insecure"), "`insecure`", findings), findings
    )
    if is_insecure and "curve" in options:
        findings.add(
            "broken-deployment",
            "with `curve` the links have keys: `insecure: true` has no meaning",
            options["insecure"].span,
            secondary=[(options["curve"].span, "here")],
            help="leave one of them out",
        )
    is_guarded = is_insecure or "curve" in options
    endpoints = _endpoints(options.get("endpoints"), nodes, own, findings, is_guarded=is_guarded)
    health = _health(parts.get("health"), nodes, own, findings, is_guarded=is_insecure)
    if not _is_possible(system, placed, file, findings) or findings.has_errors:
        return None
    curve = require_text(options.get("curve"), "`curve`, a folder of keys", findings)
    wires = wires_of(
        system,
        nodes,
        placed,
        endpoints,
        is_insecure=is_insecure,
        foreign=tuple("" if kind is None else kind.kind for kind in foreign),
    )
    every = _every(options.get("every"), findings)
    topics = None
    if carrier == "ros" and net_options is not None:
        topics = ros_net(net_options, wires.map, findings)
    net = None
    if carrier == "can" and net_options is not None:
        cycle = PERIOD if system.schedule is None else system.schedule.period * tick_of(system)
        net = can_net(wires.map, wires.events, net_options, (cycle, every), findings)
    buses = _buses(nodes, foreign, folder, net, findings)
    for place, bus in buses.items():
        kind = foreign[place]
        assert kind is not None  # noqa: S101  (it has a bus)
        machines = tuple(n for n, at in enumerate(placed) if at == place)
        report_unfit(system, machines, bus, kind.options["dbc"], findings)
        names = {system.machines[n].name for n in machines}
        same = tuple(n for n, machine in enumerate(written.machines) if machine.name in names)
        span = kind.options["dbc"].span
        written = with_delays(written, lateness(written, same, bus), span)
    times = None
    if net is not None and net_options is not None:
        times = net.times(_on_bus(net, buses, nodes, foreign, net_options["bus"], findings))
        report_late(times, net, net_options["bus"], findings)
        late = late_by_connection(system, wires.events, net, times)
        whole = written
        written = with_delays(
            written, lambda link: late.get(connection_of(whole, link)), net_options["bus"].span
        )
    ros = {
        place: ros_node(place, kind.span, kind.options, kind.tables, system, wires, findings)
        for place, kind in enumerate(foreign)
        if kind is not None and kind.kind == "ros"
    }
    watchdog = _watchdog(options.get("watchdog"), _period(system, net_options), findings)
    _report_freezes(written, nodes, placed, foreign, watchdog, findings)
    return Deployment(
        written,
        system,
        nodes,
        placed,
        wires,
        every,
        None if curve is None else folder / curve.value,
        health,
        foreign,
        buses,
        ros,
        net,
        times,
        topics,
        watchdog,
    )


def tick_of(system: System) -> int:
    """Return the microseconds in a tick of a system; all its machines count alike."""
    return system.machines[0].chart.capacities.tick


def _net_options(
    options: Mapping[str, Node], own: tuple[str, ...], findings: Findings
) -> tuple[str, dict[str, Text] | None]:
    """Return the kind of the links between the nodes, and what is said of its bus or topics.

    None where nothing but ZeroMQ can be opened.
    """
    text = require_text(options.get("kind"), "`kind`", findings)
    kind = "zeromq" if text is None else text.value
    if kind not in KINDS:
        findings.add(
            "unexpected-value",
            f"there are no links of the kind `{text}`",
            text,
            help=f"use one of {', '.join(KINDS)}",
        )
        return kind, None
    for key in options:
        kinds = [name for name, keys_ in KINDS.items() if key in keys_]
        if kinds and kind not in kinds:
            findings.add(
                "broken-deployment",
                f"links of the kind `{kind}` have no `{key}`",
                options[key].span,
                help=f"write `kind: {kinds[-1]}`, or remove it",
            )
    if text is None or kind == "zeromq":
        return kind, None
    if len(own) < 2:
        findings.add(
            "broken-deployment",
            f"links of the kind `{kind}` join two nodes of fsmkit or more",
            text,
            help="place machines on another node, or remove `kind`",
        )
        return kind, None
    if kind == "can" and "bus" not in options:
        findings.add(
            "broken-deployment",
            "links of the kind `can` need a `bus`",
            text,
            help="write `bus: can0`",
        )
        return kind, None
    texts = {key: require_text(options.get(key), f"`{key}`", findings) for key in KINDS[kind]}
    found = {key: text for key, text in texts.items() if text is not None}
    return kind, found if kind == "ros" or "bus" in found else None


KINDS = {
    "ros": ("domain", "namespace", "insecure"),
    "can": OPTIONS,
    "zeromq": ("endpoints", "curve", "insecure"),
}
"""The kinds of links between nodes, with the keys that are not of all kinds."""


def _on_bus(
    net: CanNet,
    buses: Mapping[int, CanNode],
    nodes: tuple[str, ...],
    foreign: tuple[ForeignNode | None, ...],
    at: Text,
    findings: Findings,
) -> list[TimedFrame]:
    """Return what foreign nodes send on the bus that nodes of fsmkit share."""
    found: list[TimedFrame] = []
    own = {wire.message.frame: wire.message.name for wire in net.wires}
    for place, bus in buses.items():
        kind = foreign[place]
        if kind is None or not _is_same_bus(kind, net):
            continue
        bitrate = bitrate_of(kind.options.get("bitrate"), Findings())  # reported with the node
        if bitrate != net.bitrate:
            findings.add(
                "broken-deployment",
                f"`{net.bus}` has {net.bitrate} bits per second here, and {bitrate} for "
                f"`{nodes[place]}`",
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
        found += frames_of(bus.dbc, net.bitrate)
    return found


def _is_same_bus(kind: ForeignNode | None, net: CanNet | None) -> bool:
    if kind is None or net is None or "bus" not in kind.options:
        return False
    return kind.options["bus"].value == net.bus


def _buses(
    nodes: tuple[str, ...],
    foreign: tuple[ForeignNode | None, ...],
    folder: Path,
    net: CanNet | None,
    findings: Findings,
) -> dict[int, CanNode]:
    """Return the foreign nodes on a bus whose file is named, by their places."""
    found = {}
    for place, kind in enumerate(foreign):
        if kind is not None and kind.kind == "can":
            others = () if net is None or not _is_same_bus(kind, net) else net.frames
            bus = can_node(nodes[place], kind.options, folder, [f for _, f in others], findings)
            if bus is not None:
                found[place] = bus
    return found


EXAMPLE = "write `system: cell.yaml` and `nodes: {a: [feeder, molder], b: [extractor]}`"


def _placed(
    node: Node, system: System, findings: Findings
) -> tuple[tuple[str, ...], tuple[int | None, ...], tuple[ForeignNode | None, ...]] | None:
    """Return the nodes, for each machine its node, and which nodes are foreign."""
    mapping = require_mapping(node, "`nodes`", findings)
    if mapping is None:
        return None
    if not 1 <= len(mapping.entries) <= MOST_NODES:
        findings.add("broken-deployment", f"a deployment has 1 to {MOST_NODES} nodes", mapping.span)
        return None
    where: dict[int, tuple[int, Text]] = {}
    foreign: list[ForeignNode | None] = []
    for place, (name, value) in enumerate(mapping.entries):
        if not name.value.isidentifier():
            findings.add(
                "broken-deployment",
                f"`{name}` is no name for a node",
                name,
                help="use letters, digits and `_`",
            )
        machines, kind = _node_of(name, value, findings)
        foreign.append(kind)
        for text in texts_of(machines, f"the machines of `{name}`", "a machine", findings):
            for machine in _machines(text, system, findings):
                if kind is not None and not system.machines[machine].environment:
                    findings.add(
                        "broken-deployment",
                        f"`{system.machines[machine].name}` is not of the environment, and `{name}`"
                        " is foreign",
                        text,
                        secondary=[(kind.span, "here")],
                        help=f"name it in `environment: {{will: [...]}}` of `{system.name}`, as a "
                        "model of programs that exist, or place it on another node",
                    )
                if machine in where:
                    findings.add(
                        "broken-deployment",
                        f"`{system.machines[machine].name}` has a node already",
                        text,
                        secondary=[(where[machine][1], "here")],
                        help="name it once",
                    )
                else:
                    where[machine] = place, text
    homeless = [
        machine.name
        for index, machine in enumerate(system.machines)
        if index not in where and not machine.environment
    ]
    if homeless and not findings.has_errors:
        findings.add(
            "broken-deployment",
            f"{', '.join(f'`{name}`' for name in homeless)} of `{system.name}` "
            f"{'has' if len(homeless) == 1 else 'have'} no node",
            mapping.span,
            help="name each machine that is not of the environment on one node",
        )
    placed = tuple(where[n][0] if n in where else None for n in range(len(system.machines)))
    return tuple(name.value for name, _ in mapping.entries), placed, tuple(foreign)


def _node_of(name: Text, value: Node, findings: Findings) -> tuple[Node | None, ForeignNode | None]:
    """Return the list of the machines of a node, and what it is if it is foreign."""
    if not isinstance(value, Entries):
        return value, None
    parts = require_record(value, keys.NODE, f"the node `{name}`", findings) or {}
    kind = require_text(parts.get("foreign"), "`foreign`", findings)
    if kind is None:
        return parts.get("machines"), None
    if kind.value not in keys.FOREIGN:
        findings.add(
            "unexpected-value",
            f"there are no foreign nodes of the kind `{kind}`",
            kind,
            help=f"use one of {', '.join(keys.FOREIGN)}",
        )
        return parts.get("machines"), None
    return parts.get("machines"), ForeignNode(kind.value, kind.span, {})


def _with_options(
    foreign: tuple[ForeignNode | None, ...],
    nodes: tuple[str, ...],
    node: Node | None,
    findings: Findings,
) -> tuple[ForeignNode | None, ...]:
    """Return the foreign nodes with their options."""
    mapping = require_mapping(node, "`foreign`", findings)
    kinds = dict(zip(nodes, foreign, strict=True))
    if mapping is None:
        return foreign
    check_keys(mapping, [name for name in nodes if kinds[name] is not None], "`foreign`", findings)
    for name, value in mapping.entries:
        kind = kinds.get(name.value)
        if kind is None:
            continue
        parts = require_record(value, keys.FOREIGN[kind.kind], f"`{name}`", findings) or {}
        tables = {key: part for key, part in parts.items() if key in keys.FOREIGN_TABLES}
        texts = {
            key: require_text(part, f"`{key}`", findings)
            for key, part in parts.items()
            if key not in tables
        }
        options = {key: text for key, text in texts.items() if text is not None}
        kinds[name.value] = replace(kind, options=options, tables=tables)
    return tuple(kinds[name] for name in nodes)


def _report_foreign_pairs(
    system: System,
    nodes: tuple[str, ...],
    placed: tuple[int | None, ...],
    foreign: tuple[ForeignNode | None, ...],
    findings: Findings,
) -> None:
    """Report connections between two foreign nodes: nothing of fsmkit would carry them."""
    pairs = {(link.source, link.target): None for link in system.event_links}
    pairs |= {(link.source, link.target): None for link in system.input_links}
    for source, target in pairs:
        one, other = placed[source], placed[target]
        if one is None or other is None or one == other:
            continue
        kind, another = foreign[one], foreign[other]
        if kind is not None and another is not None:
            findings.add(
                "broken-deployment",
                f"`{system.machines[source].name}` is connected to "
                f"`{system.machines[target].name}`, and both are on foreign nodes",
                kind.span,
                secondary=[(another.span, f"the kind of `{nodes[other]}`")],
                help="place both on one foreign node, or put a machine of yours between them",
            )


def _machines(text: Text, system: System, findings: Findings) -> list[int]:
    """Return the numbers of a machine, or of all elements of an array of that name."""
    name = text.value.replace(" ", "")
    found = [
        index
        for index, machine in enumerate(system.machines)
        if machine.name == name or (machine.place is not None and machine.place[0] == name)
    ]
    if not found:
        names = [machine.name for machine in system.machines]
        findings.add(
            "unknown-name",
            f"`{system.name}` has no machine `{text}`",
            text,
            help=suggest(name, names, "name one of its machines"),
        )
    return found


def _is_possible(
    system: System, placed: tuple[int | None, ...], file: Text, findings: Findings
) -> bool:
    """Say what of the connections of the nodes cannot be written in C."""
    own = Findings()
    if report_limits(_without_environment(system, placed), own):
        return True
    findings.extend(own)
    findings.add(
        "broken-deployment",
        f"`{system.name}` cannot be spread over nodes: see the warnings",
        file,
        help="do what they say",
    )
    return False


def _without_environment(system: System, placed: tuple[int | None, ...]) -> System:
    def is_placed(link: EventLink | InputLink) -> bool:
        return placed[link.source] is not None and placed[link.target] is not None

    return replace(
        system,
        event_links=tuple(filter(is_placed, system.event_links)),
        input_links=tuple(filter(is_placed, system.input_links)),
        schedule=None,
    )


def _endpoints(
    node: Node | None,
    nodes: tuple[str, ...],
    own: tuple[str, ...],
    findings: Findings,
    *,
    is_guarded: bool,
) -> tuple[str, ...]:
    """Return where each node publishes, "" for one that is foreign.

    Without a guard only within this computer.
    """
    found = _addresses(node, "endpoints", own, findings, None if is_guarded else KEYLESS)
    if node is None:
        return ()
    missing = [name for name in own if name not in found]
    if missing and not findings.has_errors:
        findings.add(
            "broken-deployment",
            f"{', '.join(f'`{name}`' for name in missing)} has no endpoint",
            node.span,
            help="write for instance `b: tcp://127.0.0.1:5572`",
        )
    return tuple(found.get(name, "") for name in nodes)


def _health(
    node: Node | None,
    nodes: tuple[str, ...],
    own: tuple[str, ...],
    findings: Findings,
    *,
    is_guarded: bool,
) -> tuple[str, ...]:
    """Return where each node answers how it is; not each must."""
    found = _addresses(node, "health", own, findings, None if is_guarded else LOCAL)
    return tuple(found.get(name, "") for name in nodes) if found else ()


KEYLESS = (
    "the links have no keys",
    "name a folder of keys with `curve: keys`, or write `insecure: true`",
)
LOCAL = (
    "answers on health have no keys",
    "name an address of 127.0.0.1, to be reached by a tunnel, or write `insecure: true` in `links`",
)


def _addresses(
    node: Node | None,
    key: str,
    nodes: tuple[str, ...],
    findings: Findings,
    beyond: tuple[str, str] | None,
) -> dict[str, str]:
    """Return endpoints by node; ``beyond``: why none may be of others, and the way out."""
    mapping = require_mapping(node, f"`{key}`", findings)
    if mapping is None:
        return {}
    check_keys(mapping, nodes, f"`{key}`", findings)
    found = {}
    places: dict[str, Text] = {}
    for name, value in mapping.entries:
        text = require_text(value, f"the endpoint of `{name}`", findings)
        if text is not None:
            found[name.value] = text.value
            if (rejection := rejection_of(text.value)) is not None:
                findings.add(
                    "broken-deployment",
                    f"the endpoint `{text}` {rejection.why}",
                    text,
                    help=rejection.fix,
                )
                continue
            if (other := places.setdefault(text.value, text)) is not text:
                findings.add(
                    "broken-deployment",
                    f"`{text}` is the endpoint of two nodes",
                    text,
                    secondary=[(other, "the other one")],
                    help="give each node an endpoint of its own",
                )
            if beyond is not None and not is_loopback(text.value):
                why, way_out = beyond
                findings.add(
                    "unguarded-endpoint",
                    f"`{text}` is not of this computer only, and {why}",
                    text,
                    help=way_out,
                )
    return found


def _period(system: System, net_options: Mapping[str, Text] | None) -> int | None:
    """Return the microseconds from cycle to cycle of the nodes; None where nothing says it."""
    if net_options is not None and "period" in net_options:
        return read_duration(net_options["period"], Scope(tick=1), Findings())  # reported there
    return None if system.schedule is None else system.schedule.period * tick_of(system)


def _watchdog(node: Node | None, period: int | None, findings: Findings) -> int:
    """Return the milliseconds after its last cycle in which a node that hangs falls silent.

    ``period``: of the loops in microseconds. A watch is sure of cycles up to half its bound apart.
    """
    text = require_text(node, "`watchdog`", findings)
    if text is None:
        return max(WATCHDOG, -(-LOOKS * (period or 0) // 1000))
    found = read_duration(text, Scope(tick=1), findings)
    if found is None:
        return WATCHDOG
    if found % 1000 or not LEAST_WATCHDOG <= found // 1000 <= MOST_WATCHDOG:
        findings.add(
            "unexpected-value",
            f"`watchdog` is {LEAST_WATCHDOG}ms to {MOST_WATCHDOG // 1000}s in milliseconds",
            text,
            help=f"write for instance `watchdog: {WATCHDOG}ms`",
        )
        return WATCHDOG
    if period is not None and found < 2 * period:
        findings.add(
            "unexpected-value",
            f"`watchdog` is shorter than two cycles of {period} us, so a node that works would "
            "fall silent",
            text,
            help=f"write `watchdog: {-(-LOOKS * period // 1000)}ms`, or more",
        )
    return found // 1000


def _report_freezes(
    system: System,
    nodes: tuple[str, ...],
    placed: tuple[int | None, ...],
    foreign: tuple[ForeignNode | None, ...],
    watchdog: int,
    findings: Findings,
) -> None:
    """Report nodes that freeze in the system in another way than this deployment lets them.

    ``watchdog``: milliseconds in which a node that hangs may still send.
    """
    for freezer in system.freezers:
        name, span = freezer.machine.name, freezer.machine.span
        if name not in nodes:
            continue
        place = nodes.index(name)
        if set(freezer.frozen) != {n for n, at in enumerate(placed) if at == place}:
            findings.add(
                "broken-deployment",
                f"the node `{name}` has other machines here than under `freezes` of the system",
                span,
                help="give it the same machines in both files, or another name under `freezes`",
            )
        most = freezer.within[1] * tick_of(system)
        if freezer.silent and foreign[place] is None and most < 1000 * watchdog:
            findings.add(
                "broken-deployment",
                f"a node that hangs may send for {watchdog}ms, but the silence of `{name}` is "
                f"noticed within {duration_text(most)} in the system",
                span,
                help=f"write `within: {watchdog}ms` or more in the system, or a shorter "
                "`watchdog` under `links`",
            )


def _every(node: Node | None, findings: Findings) -> int:
    text = require_text(node, "`every`", findings)
    if text is None:
        return 1
    number = integer(text, findings)
    if number is not None and not 1 <= number <= 65535:
        findings.add("unexpected-value", "`every` is 1 to 65535 cycles", text)
    return number or 1
