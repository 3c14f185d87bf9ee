"""Inputs that the environment sets: ``may: [agv.aligned, "agv.temp in {0, 500, 1000}"]``.

Such an input changes at any time to any of its values, one input a step. An exploration has a
machine of the environment for each: its only output is connected to the input, and ``set`` can come
to it from outside.
"""

from __future__ import annotations

from dataclasses import replace

from fsmkit.chart.chart import Chart, Data
from fsmkit.system.links import chart_of_text, types_text
from fsmkit.system.system import InputLink, Machine, Possible, System


def with_free_inputs(system: System) -> System:
    """Return a system in which a machine sets each free input, after all other machines."""
    machines, links, possible = list(system.machines), [], list(system.possible)
    for free in system.free_inputs:
        machine = system.machines[free.machine]
        declared = machine.chart.inputs[free.input]
        if set(free.values) <= {declared.init.value}:
            continue
        number = len(machines)
        machines.append(
            Machine(
                f"{machine.name}.{declared.name}",
                _chart(declared, machine.chart),
                environment=True,
                drives=free,
                span=machine.span,
            )
        )
        links.append(InputLink(number, 0, free.machine, free.input))
        possible += [Possible(number, 0, (value,)) for value in free.values]
    return replace(
        system,
        machines=tuple(machines),
        input_links=(*system.input_links, *links),
        possible=tuple(possible),
        free_inputs=(),
    )


def _chart(declared: Data, of: Chart) -> Chart:
    """Return the chart that sets an input of a chart."""
    lines = [
        "chart: Input",
        *types_text([declared.type]),
        f"capacity: {{tick: {of.capacities.tick}us}}",
        f'events: {{in: ["set(value {declared.type})"]}}',
        f'outputs: {{value: "{declared.type}"}}',
        "initial: open",
        "states: {open: {rest: true, on: {set: {do: value = event.value}}}}",
    ]
    chart = chart_of_text("\n".join(lines) + "\n")
    (value,) = chart.outputs
    return replace(chart, outputs=(replace(value, init=declared.init),))
