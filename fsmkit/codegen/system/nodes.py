"""The C of a node: its machines joined, and what crosses to others over a link.

It is the C of a system (`glue`) in which some connections end at ``fsm_link.h``: a message is
written into the ring to the worker, and what came in is posted at the beginning of a cycle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.system.glue import header
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.node_printer import NodePrinter
from fsmkit.codegen.system.parts import Part, named_charts, parts_of
from fsmkit.system.deployment import Deployment
from fsmkit.system.system import System
from fsmkit.texts import printing


def nodes_of(deployment: Deployment) -> tuple[Node, ...]:
    """Return the nodes."""
    return tuple(_node(deployment, place) for place in range(len(deployment.nodes)))


def _node(deployment: Deployment, place: int) -> Node:
    whole = deployment.system
    numbers = tuple(n for n, node in enumerate(deployment.placed) if node == place)
    events = tuple(
        replace(link, source=numbers.index(link.source), target=numbers.index(link.target))
        for link in whole.event_links
        if link.source in numbers and link.target in numbers
    )
    inputs = tuple(
        replace(link, source=numbers.index(link.source), target=numbers.index(link.target))
        for link in whole.input_links
        if link.source in numbers and link.target in numbers
    )
    machines = tuple(whole.machines[number] for number in numbers)
    name = whole.name + "_" + deployment.nodes[place]
    system = System(name, machines, events, inputs, source=whole.source)
    begins = tuple(
        replace(link, source=numbers.index(link.source))
        for link in deployment.wires.events
        if link.source in numbers
    )
    named = replace(system, event_links=(*events, *begins))
    return Node(deployment, place, system, numbers, named_charts(named))


@printing
def compose_node(node: Node, headers: Mapping[str, str]) -> dict[str, str]:
    """Return header and source; ``headers``: of the machines, by file name."""
    parts = parts_of(node.system, node.charts, headers)
    return {
        f"{node.prefix}.h": _header(node, parts),
        f"{node.prefix}.c": NodePrinter(node, parts).text(),
    }


def _header(node: Node, parts: tuple[Part, ...]) -> str:
    prefix, upper = node.prefix, node.prefix.upper()
    deployment = node.deployment
    lines = ["", "/* The nodes of the deployment, for fsm_link_count and the like. */"]
    lines += [f"#define {upper}_NODE_{word} {place}u" for place, word in enumerate(node.words)]
    lines += [
        "",
        "/* What crosses the nodes. */",
        f"extern const fsm_link_map {prefix}_map;",
    ]
    if deployment.map.endpoints:
        lines += [
            "",
            "/* Where each node publishes, as the deployment says. */",
            f"extern const char *const {prefix}_endpoints[{len(deployment.nodes)}];",
        ]
    lines += [
        "",
        "/* A cycle: post what other nodes sent, run all machines until `now`, let out what they",
        " * send, and the levels. False as X_run. Without a link: only the run. */",
        f"bool {prefix}_cycle({prefix} *s, uint32_t now);",
    ]
    told = NodePrinter(node, parts).told()
    if told:
        lines += ["", "/* Connected both to other machines and to the environment: the host's. */"]
        lines += [f"void {name}({prefix} *s{parameters(f, p.names)});" for name, p, f in told]
    return header(
        node.system,
        prefix,
        parts,
        includes=['#include "fsm_link.h"'],
        members=["fsm_link *link; /* NULL: what goes to other nodes is lost */"],
        calls="\n".join(lines),
    )
