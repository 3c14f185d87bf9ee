"""The tables with which a class records its steps: the numbers of `runtime.tracing.numbering`."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.saving import type_code
from fsmkit.runtime.tracing.numbering import Numbering
from fsmkit.runtime.tracing.writing import period


def constants(chart: Chart, outermost: Numbering, names: Names) -> dict[str, object]:
    """Return the tables by name.

    Args:
        chart: The chart of the class.
        outermost: The numbers of the outermost machine.
        names: The names of the class.

    """
    results = [type_code(o.result) for o in chart.operations if o.result is not None]
    return {
        "_INPUTS": tuple((names.variables[i.name], type_code(i.type)) for i in chart.inputs),
        "_RESULTS": tuple(results),
        "_RECORD_HASH": outermost.hash,
        "_RECORD_FIRST": (
            outermost.first_event,
            outermost.first_dispatched,
            outermost.first_input,
        ),
        "_RECORD_PLACES": tuple(_places(outermost)),
        "_RECORD_PERIOD": period(outermost.chart),
    }


def _places(numbering: Numbering) -> list[tuple[int, int, int]]:
    """Return for each machine the numbers of its first transition, start and first result."""
    machines = [machine for machine, _ in numbering.results]
    return [
        (
            numbering.base(number),
            numbering.first_start + number,
            numbering.first_result + sum(machine < number for machine in machines),
        )
        for number in range(len(numbering.machines))
    ]
