"""The machines of a deployment that are on no node, and what the host does in their place."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.system.deployment import Deployment


def tell_left_out(deployment: Deployment, findings: Findings) -> None:
    """Report each machine of the environment that is on no node (``world-left-out``)."""
    system, placed = deployment.system, deployment.placed
    for index, machine in enumerate(system.machines):
        if placed[index] is not None:
            continue
        posts = {
            (link.target, system.machines[link.target].chart.events[link.event].name)
            for link in system.event_links
            if link.source == index and placed[link.target] is not None
        }
        sets = {
            (link.target, system.machines[link.target].chart.inputs[link.input].name)
            for link in system.input_links
            if link.source == index and placed[link.target] is not None
        }
        takes = {
            (link.source, _port(system.machines[link.source].chart, link.port))
            for link in system.event_links
            if link.target == index and placed[link.source] is not None
        }
        names = [one.name for one in system.machines]
        told = [
            f"{verb} {_listed(names, found)}"
            for verb, found in (("posts", posts), ("sets", sets), ("takes", takes))
            if found
        ]
        findings.add(
            "world-left-out",
            f"`{machine.name}` is on no node, so no code is written for it",
            None,
            help=f"the host {', '.join(told)}" if told else None,
        )


def _port(chart: Chart, port: int) -> str:
    """Return what leaves a machine: an event, or an operation after all events."""
    events = chart.events
    return events[port].name if port < len(events) else chart.operations[port - len(events)].name


def _listed(names: list[str], found: Iterable[tuple[int, str]]) -> str:
    return ", ".join(f"`{names[machine]}.{name}`" for machine, name in sorted(found))
