"""Model free inputs: ``may: [agv.aligned, "agv.temp in {0, 500, 1000}"]``.

Such an input changes at any time to any of its values, one input per step. The explored system has
a machine of the environment for each. The only output of this machine is connected to the input,
and its external event ``set`` chooses a value. If two changes have a minimum separation, the
machine is closed for that time. Events with a minimum separation pass through a similar machine.
"""

from __future__ import annotations

from dataclasses import replace

from fsmkit.chart.chart import Chart, Data, Event
from fsmkit.system.channels import chart_of_text, types_text
from fsmkit.system.machine import EventLink, InputLink, Machine, Possible
from fsmkit.system.system import System


def with_free_inputs(system: System) -> System:
    """Return a system with a machine for each free input, after all other machines."""
    machines, links = list(system.machines), []
    possible = [each for each in system.possible if not each.apart]
    for free in system.free_inputs:
        machine = system.machines[free.machine]
        declared = machine.chart.inputs[free.input]
        if set(free.values) <= {declared.init.value} and not free.any_start:
            continue
        number = len(machines)
        machines.append(
            Machine(
                f"{machine.name}.{declared.name}",
                _chart(declared, machine.chart, free.apart, any_start=free.any_start),
                environment=True,
                drives=free,
                span=machine.span,
            )
        )
        links.append(InputLink(number, 0, free.machine, free.input))
        possible += [Possible(number, 0, (value,)) for value in free.values]
    events = []
    for target, event in dict.fromkeys((p.machine, p.event) for p in system.possible if p.apart):
        machine, number = system.machines[target], len(machines)
        declared_event = machine.chart.events[event]
        those = [p for p in system.possible if p.apart and (p.machine, p.event) == (target, event)]
        chart = _gate(declared_event, machine.chart, min(each.apart for each in those))
        name = f"{machine.name}.{declared_event.name}"
        machines.append(Machine(name, chart, environment=True, span=machine.span))
        values = tuple(range(len(declared_event.fields)))
        passed = chart.event_index["passed"]
        events.append(EventLink(number, passed, target, event, values))
        coming = chart.event_index["comes"]
        possible += [Possible(number, coming, each.payload) for each in those]
    return replace(
        system,
        machines=tuple(machines),
        event_links=(*system.event_links, *events),
        input_links=(*system.input_links, *links),
        possible=tuple(possible),
        free_inputs=(),
    )


def _chart(declared: Data, of: Chart, apart: int, *, any_start: bool) -> Chart:
    """Return the chart that sets an input of a chart, with a minimum separation in ticks.

    ``any_start``: it starts with any value.
    """
    choosing = [f'operations: ["start() -> {declared.type}"]', "script: value = start()"]
    choosing = choosing if any_start else []
    lines = [
        "chart: Input",
        *types_text([declared.type]),
        f"capacity: {{tick: {of.capacities.tick}us}}",
        f'events: {{in: ["set(value {declared.type})"]}}',
        f'outputs: {{value: "{declared.type}"}}',
        *choosing,
        *_states("set", "value = event.value", apart * of.capacities.tick),
    ]
    chart = chart_of_text("\n".join(lines) + "\n")
    (value,) = chart.outputs
    return replace(chart, outputs=(replace(value, init=declared.init),))


def _gate(event: Event, of: Chart, apart: int) -> Chart:
    """Return the chart that forwards an event, with a minimum separation in ticks."""
    fields = ", ".join(f"v{n} {part.type}" for n, part in enumerate(event.fields))
    values = ", ".join(f"v{n} = event.v{n}" for n in range(len(event.fields)))
    shown, sent = (f"({fields})", f"({values})") if fields else ("", "")
    lines = [
        "chart: Event",
        *types_text(part.type for part in event.fields),
        f"capacity: {{tick: {of.capacities.tick}us}}",
        f'events: {{in: ["comes{shown}"], out: ["passed{shown}"]}}',
        *_states("comes", f"send passed{sent}", apart * of.capacities.tick),
    ]
    return chart_of_text("\n".join(lines) + "\n")


def _states(event: str, content: str, apart: int) -> list[str]:
    """Return states that run ``content`` for an event, with a minimum separation in us."""
    if not apart:
        return [
            "initial: open",
            f'states: {{open: {{rest: true, on: {{{event}: {{do: "{content}"}}}}}}}}',
        ]
    return [
        "initial: open",
        "states:",
        f'  open: {{rest: true, on: {{{event}: {{target: shut, do: "{content}"}}}}}}',
        f"  shut: {{rest: true, after: {{{apart}us: open}}}}",
    ]
