"""Report the features of a system that joined C does not support."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.language import SymbolType
from fsmkit.system.schedule import time_unit
from fsmkit.system.system import System


def report_limits(system: System, findings: Findings) -> bool:
    """Report unsupported features with a replacement for each; return whether all is supported.

    Raises `FsmkitError` if the machines have different ticks.
    """
    time_unit(system)
    before = len(list(findings))
    if system.schedule is not None:
        findings.add(
            "not-joined",
            "joined C has no cyclic schedule: one `run` would let all machines come to rest",
            system.schedule.span,
            help="write the loop: once a period `X_run` of each machine, in this order",
        )
    shared = [machine for machine in system.machines if machine.shared]
    if shared:
        findings.add(
            "not-joined",
            "`shared` data are not joined in C",
            shared[0].span,
            help="let one machine own them, and connect its outputs",
        )
    for link in system.event_links:
        source, target = system.machines[link.source], system.machines[link.target]
        operation = link.port - len(source.chart.events)
        if operation >= 0 and source.chart.operations[operation].result is not None:
            declared = source.chart.operations[operation]
            findings.add(
                "not-joined",
                f"the operation `{source.name}.{declared.name}` returns a value, which a "
                "connection in C does not",
                source.span,
                help="send an event, and return the result as another event",
            )
        event = target.chart.events[link.event]
        if any(isinstance(part.type, SymbolType) for part in event.fields):
            findings.add(
                "not-joined",
                f"`{target.name}.{event.name}` carries strings, which each machine in C numbers "
                "for itself",
                target.span,
                help="declare an enumeration",
            )
    for wire in system.input_links:
        target = system.machines[wire.target]
        if wire.input < len(target.chart.inputs) and isinstance(
            target.chart.inputs[wire.input].type, SymbolType
        ):
            findings.add(
                "not-joined",
                f"`{target.name}.{target.chart.inputs[wire.input].name}` is a string, which each "
                "machine in C numbers for itself",
                target.span,
                help="declare an enumeration",
            )
    return len(list(findings)) == before
