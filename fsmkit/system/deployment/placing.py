"""Assign the machines of a system to nodes, and find the foreign nodes."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.document.keys import NESTED
from fsmkit.system.deployment.carrier import ForeignNode
from fsmkit.system.deployment.keys import foreign_keys, node_keys
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Mapping as Entries
from fsmkit.yaml.nodes import (
    Node,
    check_keys,
    require_mapping,
    require_record,
    require_text,
    texts_of,
)

MOST_NODES = 8
"""As many as ``FSM_LINK_NODES`` of the library in C, by default."""


def placed_machines(
    node: Node, system: System, findings: Findings
) -> tuple[tuple[str, ...], tuple[int | None, ...], tuple[ForeignNode | None, ...]] | None:
    """Return the nodes, the node of each machine, and the foreign nodes."""
    mapping = require_mapping(node, "`nodes`", findings)
    if mapping is None:
        return None
    if not 1 <= len(mapping.entries) <= MOST_NODES:
        findings.add(
            "broken-deployment",
            f"a deployment has 1 to {MOST_NODES} nodes, not {len(mapping.entries)}",
            mapping.span,
            help="place several machines on one node",
        )
        return None
    where: dict[int, tuple[int, Text]] = {}
    foreign: list[ForeignNode | None] = []
    for place, (name, value) in enumerate(mapping.entries):
        if not name.value.isidentifier():
            findings.add(
                "broken-deployment",
                f"`{name}` is not a valid node name",
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
    """Return the list of the machines of a node, and its foreign kind if it has one."""
    if not isinstance(value, Entries):
        return value, None
    parts = require_record(value, node_keys(), f"the node `{name}`", findings) or {}
    kind = require_text(parts.get("foreign"), "`foreign`", findings)
    if kind is None:
        return parts.get("machines"), None
    if kind.value not in foreign_keys():
        findings.add(
            "unexpected-value",
            f"there are no foreign nodes of the kind `{kind}`",
            kind,
            help=f"use one of {', '.join(foreign_keys())}",
        )
        return parts.get("machines"), None
    return parts.get("machines"), ForeignNode(kind.value, kind.span, {})


def with_options(
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
        rows = foreign_keys()[kind.kind]
        parts = require_record(value, rows, f"`{name}`", findings) or {}
        nested = {row.name for row in rows.values() if row.form in NESTED}
        tables = {key: part for key, part in parts.items() if key in nested}
        texts = {
            key: require_text(part, f"`{key}`", findings)
            for key, part in parts.items()
            if key in rows and key not in nested
        }
        options = {key: text for key, text in texts.items() if text is not None}
        kinds[name.value] = replace(kind, options=options, tables=tables)
    return tuple(kinds[name] for name in nodes)


def report_foreign_pairs(
    system: System,
    nodes: tuple[str, ...],
    placed: tuple[int | None, ...],
    foreign: tuple[ForeignNode | None, ...],
    findings: Findings,
) -> None:
    """Report connections between two foreign nodes, which no link of fsmkit carries."""
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
    """Return the number of a machine, or the numbers of all elements of an array of that name."""
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
