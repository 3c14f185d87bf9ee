"""Read deployments: the node of each machine of a system, and the links between nodes.

``system: ring.yaml``, ``nodes: {a: [feeder, molder], b: [extractor]}``, ``links: {...}``. A node of
the form ``{machines: [heater], foreign: KIND}`` represents programs that do not use fsmkit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

from fsmkit.chart.loading import named_file, read_bytes
from fsmkit.diagnostics import Findings, Text
from fsmkit.document import keys
from fsmkit.document.keys import NESTED
from fsmkit.language import Scope, read_duration
from fsmkit.language.units import duration_text
from fsmkit.plugins import plugins
from fsmkit.system.channels import without_channels
from fsmkit.system.connections import tick_of
from fsmkit.system.deployment.addresses import (
    endpoints_of,
    health_of,
    read_insecure,
)
from fsmkit.system.deployment.carrier import (
    DEFAULT,
    Carrier,
    Delaying,
    DeploymentRequest,
    ForeignNetwork,
    ForeignNode,
    Network,
    foreign_carriers,
    link_carriers,
)
from fsmkit.system.deployment.crossing import Wires, wires_of
from fsmkit.system.deployment.delays import with_delays
from fsmkit.system.deployment.event_map import EventMap
from fsmkit.system.deployment.keys import link_keys
from fsmkit.system.deployment.placing import placed_machines, report_foreign_pairs, with_options
from fsmkit.system.deployment.watchdog import WATCHDOG, watchdog_of
from fsmkit.system.indices import integer
from fsmkit.system.limits_of_c import report_limits
from fsmkit.system.machine import EventLink, InputLink
from fsmkit.system.machines import Replacement
from fsmkit.system.system import System, part_of
from fsmkit.system.system_file import load_system
from fsmkit.yaml.nodes import Node, require_record, require_text


@dataclass(frozen=True)
class Deployment:
    """A system distributed over nodes. ``placed[machine]``: its node; None in the environment."""

    written: System
    """The explored system: that of its file, with the latencies of its carriers."""
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
    network: Network | None = None
    """The network between nodes of fsmkit, if their links need more than endpoints."""
    foreign_networks: Mapping[int, ForeignNetwork] = field(default_factory=dict)
    """By place: what joins a foreign node, where its carrier has found something."""
    watchdog: int = WATCHDOG
    """Milliseconds after its last cycle in which a node that hangs falls silent."""

    @property
    def carrier(self) -> str:
        """The kind of the links between the nodes of fsmkit."""
        return DEFAULT if self.network is None else self.network.carrier

    @property
    def carriers(self) -> tuple[str, ...]:
        """The kinds of all links and of all foreign nodes, in order of name."""
        kinds = {node.kind for node in self.foreign if node is not None}
        return tuple(sorted({self.carrier, *kinds}))

    @property
    def own_nodes(self) -> tuple[int, ...]:
        """The indices of the nodes that run machines of fsmkit."""
        return self.map.own_nodes

    @property
    def map(self) -> EventMap:
        """The event map of the deployment."""
        return self.wires.map

    def machines_of(self, place: int) -> tuple[int, ...]:
        """Return the numbers of the machines on a node."""
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

    ``replacing``, ``strict``, ``parameters``: as for `fsmkit.system.any_file.read`.
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
    found = placed_machines(parts["nodes"], system, findings)
    if found is None or findings.has_errors:
        return None
    nodes, placed, kinds = found
    options = require_record(parts.get("links"), link_keys(), "`links`", findings) or {}
    foreign = with_options(kinds, nodes, options.get("foreign"), findings)
    report_foreign_pairs(system, nodes, placed, foreign, findings)
    own = tuple(name for name, kind in zip(nodes, foreign, strict=True) if kind is None)
    carrier, texts = _carrier_of(options, own, findings)
    is_insecure = read_insecure(
        require_text(options.get("insecure"), "`insecure`", findings), findings
    )
    if is_insecure and "curve" in options:
        findings.add(
            "broken-deployment",
            "with `curve` the links have keys: `insecure: true` has no meaning",
            options["insecure"].span,
            secondary=[(options["curve"].span, "here")],
            help="remove one of them",
        )
    is_guarded = is_insecure or "curve" in options
    endpoints = endpoints_of(options.get("endpoints"), nodes, own, findings, is_guarded=is_guarded)
    health = health_of(parts.get("health"), nodes, own, findings, is_guarded=is_insecure)
    if not _is_possible(system, placed, file, findings) or findings.has_errors:
        return None
    curve = require_text(options.get("curve"), "`curve`, a folder of keys", findings)
    request = DeploymentRequest(
        system,
        nodes,
        placed,
        foreign,
        wires_of(
            system,
            nodes,
            placed,
            endpoints,
            is_insecure=is_insecure,
            foreign=tuple("" if kind is None else kind.kind for kind in foreign),
        ),
        folder,
        texts,
        {} if carrier is None else _tables(options, carrier),
        _every(options.get("every"), findings),
        None if system.schedule is None else system.schedule.period * tick_of(system.machines),
    )
    network = None if carrier is None else carrier.read(request, findings)
    networks: dict[int, ForeignNetwork] = {}
    for name, joined in _foreign_networks(request, network, findings):
        networks |= joined
        delaying = {each.name: each for each in plugins(Delaying)}.get(name)
        if delaying is not None:
            for latency in delaying.latencies(request, network, joined, findings):
                written = with_delays(written, latency)
    watchdog = watchdog_of(options.get("watchdog"), _period(request), findings)
    _report_freezes(written, nodes, placed, foreign, watchdog, findings)
    return Deployment(
        written,
        system,
        nodes,
        placed,
        request.wires,
        request.every,
        None if curve is None else folder / curve.value,
        health,
        foreign,
        network,
        dict(sorted(networks.items())),
        watchdog,
    )


def _foreign_networks(
    request: DeploymentRequest, network: Network | None, findings: Findings
) -> Iterator[tuple[str, dict[int, ForeignNetwork]]]:
    """Yield the foreign networks of each carrier by node, and its fault in place of a link."""
    carriers = foreign_carriers()
    kinds = {kind.kind for kind in request.foreign if kind is not None}
    for name in sorted(kinds | ({network.carrier} if network is not None else set())):
        found = {}
        for place, kind in enumerate(request.foreign):
            if kind is not None and kind.kind == name:
                joined = carriers[name].read_foreign(place, request, network, findings)
                if joined is not None:
                    found[place] = joined
        yield name, found


def _carrier_of(
    options: Mapping[str, Node], own: tuple[str, ...], findings: Findings
) -> tuple[Carrier | None, dict[str, Text]]:
    """Return the carrier of the links between nodes, and its options in `links`.

    None after an error.
    """
    carriers = link_carriers()
    text = require_text(options.get("kind"), "`kind`", findings)
    kind = DEFAULT if text is None else text.value
    if kind not in carriers:
        findings.add(
            "unexpected-value",
            f"there are no links of the kind `{text}`",
            text,
            help=f"use one of {', '.join(carriers)}",
        )
        return None, {}
    for key in options:
        kinds = [name for name, found in carriers.items() if key in found.link_keys]
        if kinds and kind not in kinds:
            findings.add(
                "broken-deployment",
                f"links of the kind `{kind}` have no `{key}`",
                options[key].span,
                help=f"write `kind: {DEFAULT if DEFAULT in kinds else kinds[0]}`, or remove it",
            )
    if kind == DEFAULT:
        return carriers[kind], {}
    if len(own) < 2:
        findings.add(
            "broken-deployment",
            f"links of the kind `{kind}` join two nodes of fsmkit or more",
            text,
            help="place machines on another node, or remove `kind`",
        )
        return None, {}
    carrier = carriers[kind]
    for key, example in carrier.required_keys.items():
        if key not in options:
            findings.add(
                "broken-deployment",
                f"links of the kind `{kind}` need a `{key}`",
                text,
                help=f"write `{key}: {example}`",
            )
            return None, {}
    texts = {
        key: require_text(options.get(key), f"`{key}`", findings)
        for key, row in carrier.link_keys.items()
        if row.form not in NESTED
    }
    found = {key: value for key, value in texts.items() if value is not None}
    return (carrier, found) if carrier.required_keys.keys() <= found.keys() else (None, {})


def _tables(options: Mapping[str, Node], carrier: Carrier) -> dict[str, Node]:
    """Return the options of a carrier in `links` that are not strings."""
    rows = carrier.link_keys.values()
    return {r.name: options[r.name] for r in rows if r.form in NESTED and r.name in options}


EXAMPLE = "write `system: cell.yaml` and `nodes: {a: [feeder, molder], b: [extractor]}`"


def _is_possible(
    system: System, placed: tuple[int | None, ...], file: Text, findings: Findings
) -> bool:
    """Report connections between nodes that C cannot express; return whether all can."""
    own = Findings()
    if report_limits(_without_environment(system, placed), own):
        return True
    findings.extend(own)
    findings.add(
        "broken-deployment",
        f"`{system.name}` cannot be spread over nodes: see the warnings",
        file,
        help="follow the warnings",
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


def _period(request: DeploymentRequest) -> int | None:
    """Return the cycle time of the nodes in microseconds; None if it is not specified."""
    if "period" in request.options:
        return read_duration(request.options["period"], Scope(tick=1), Findings())  # reported there
    return request.cycle


def _report_freezes(
    system: System,
    nodes: tuple[str, ...],
    placed: tuple[int | None, ...],
    foreign: tuple[ForeignNode | None, ...],
    watchdog: int,
    findings: Findings,
) -> None:
    """Report nodes whose freezes in the system differ from this deployment.

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
        most = freezer.within[1] * tick_of(system.machines)
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
