"""A system as a tree on the terminal and as data."""

from __future__ import annotations

from typing import Any

from rich.text import Text
from rich.tree import Tree

from fsmkit.system.freezes import freezer_text
from fsmkit.system.system import System


def system_tree(system: System) -> Tree:
    """Return machines, connections, environment and properties."""
    tree = Tree(Text(system.name, "bold"))
    found = system_document(system)
    parts = {
        "machines": [
            f"{m['name']}: {m['chart']}, {m['states']} states"
            + (", of the environment" if m["environment"] else "")
            for m in found["machines"]
        ],
        "connections": found["connections"],
        "shared": [f"{name}: {', '.join(holders)}" for name, holders in found["shared"].items()],
        "environment": [
            *(f"{'will' if p['fair'] else 'may'} {p['event']}" for p in found["environment"]),
            *(f"may {name}" for name in found["free_inputs"]),
            *(freezer_text(freezer, system) for freezer in system.freezers),
        ],
        "properties": [
            f"{p['name']}: {p['kind']}" + (f" {p['text']}" if p["text"] != p["kind"] else "")
            for p in found["properties"]
        ],
    }
    for name, lines in parts.items():
        if lines:
            group = tree.add(Text(name, "bold"))
            for line in lines:
                group.add(Text(line))
    return tree


def _port(system: System, machine: int, index: int) -> str:
    """Return what leaves or enters a machine: an event, or an operation after all events."""
    owner = system.machines[machine]
    events = owner.chart.events
    if index < len(events):
        return f"{owner.name}.{events[index].name}"
    return f"{owner.name}.{owner.chart.operations[index - len(events)].name}()"


def _free_inputs(system: System) -> list[str]:
    machines = system.machines
    return [
        f"{machines[free.machine].name}.{machines[free.machine].chart.inputs[free.input].name}"
        for free in system.free_inputs
        if free.values
    ]


def _connections(system: System) -> list[str]:
    found = [
        f"{_port(system, link.source, link.port)} -> {_port(system, link.target, link.event)}"
        for link in system.event_links
    ]
    for link in system.input_links:
        source, target = system.machines[link.source], system.machines[link.target]
        if link.output >= len(source.chart.outputs):
            continue  # shared data
        written = source.chart.outputs[link.output].name
        read = target.chart.inputs[link.input].name
        found.append(f"{source.name}.{written} -> {target.name}.{read}")
    return found


def _shared(system: System) -> dict[str, list[str]]:
    """Return the machines that hold each shared variable."""
    found: dict[str, list[str]] = {}
    for machine in system.machines:
        for name in dict.fromkeys(slot.name for slot in machine.shared):
            found.setdefault(name, []).append(machine.name)
    return found


def system_document(system: System) -> dict[str, Any]:
    """Return a system as data for JSON."""
    return {
        "name": system.name,
        "machines": [
            {
                "name": m.name,
                "chart": m.chart.name,
                "file": m.chart.sources[0].name if m.chart.sources else None,
                "states": len(m.chart.states) - 1,
                "environment": m.environment,
                **({"started": list(m.started)} if m.started else {}),
                **({"any_start": list(m.any_start)} if m.any_start else {}),
            }
            for m in system.machines
        ],
        "connections": _connections(system),
        "shared": _shared(system),
        "environment": [
            {"event": _port(system, p.machine, p.event), "fair": p.fair} for p in system.possible
        ],
        "free_inputs": _free_inputs(system),
        "freezes": [
            {
                "node": freezer.machine.name,
                "machines": [system.machines[n].name for n in freezer.frozen],
                "silent": [_port(system, *receiver) for receiver in freezer.silent],
                "within": list(freezer.within),
                "continues": freezer.continues,
            }
            for freezer in system.freezers
        ],
        "properties": [
            {"name": p.name, "kind": p.kind.key, "text": p.text} for p in system.properties
        ],
    }
