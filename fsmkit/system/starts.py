"""Start values that a system gives its machines: ``start: {aligned: true, tries: any}``.

A value replaces the one in the chart. With ``any`` an exploration starts from each value. The
explored chart then has an operation whose result is stored first; for an input, the machine that
sets it starts with any value. All others start with the value of the chart.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Data, Operation
from fsmkit.chart.statements import Assign
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language.constants import start_value
from fsmkit.system.machine import Machine
from fsmkit.system.system import System

ANY = "any"


def with_start_values(
    machine: Machine, given: Iterable[tuple[Text, Text]], findings: Findings
) -> Machine:
    """Return a machine whose data and inputs have the start values that a system gives them."""
    data, inputs = list(machine.chart.data), list(machine.chart.inputs)
    names: list[str] = []
    anything: list[str] = []
    for name, text in given:
        found = _place(name.value, data, inputs)
        if found is None:
            known = [variable.name for variable in (*data, *inputs)]
            findings.add(
                "unknown-name",
                f"`{machine.name}` has no data and no input `{name}`",
                name,
                help=suggest(name.value, known, "name one of the chart"),
            )
            continue
        variables, place = found
        names.append(name.value)
        variable = variables[place]
        if text.value.strip() == ANY and not _is_constant(machine.chart, ANY):
            if _is_countable(variable, name, findings):
                anything.append(name.value)
            continue
        chart = machine.chart
        types = {str(type_): type_ for type_ in chart.types}
        scope = lang.Scope(constants=dict(chart.constants), types=types, tick=chart.capacities.tick)
        init = start_value(text, variable.type, scope, findings)
        if init is not None:
            variables[place] = replace(variable, init=init)
    chart = replace(machine.chart, data=tuple(data), inputs=tuple(inputs))
    if chart == machine.chart:
        chart = machine.chart
    return replace(machine, chart=chart, started=tuple(names), any_start=tuple(anything))


def _place(name: str, *kinds: list[Data]) -> tuple[list[Data], int] | None:
    for variables in kinds:
        for place, variable in enumerate(variables):
            if variable.name == name:
                return variables, place
    return None


def _is_constant(chart: Chart, name: str) -> bool:
    return any(known == name for known, _ in chart.constants)


def _is_countable(variable: Data, name: Text, findings: Findings) -> bool:
    """Whether an exploration can start from each value; otherwise report why not."""
    if isinstance(
        variable.type, lang.ArrayType | lang.RecordType | lang.SymbolType | lang.FloatType
    ):
        findings.add(
            "connection-mismatch",
            f"`{name}` cannot start from each value: `{variable.type}`",
            name,
            help="give it one value, or declare a number, a truth value or an enumeration",
        )
        return False
    return True


def check_starts(system: System, findings: Findings) -> None:
    """Report start values without effect: for connected inputs, and for shared data."""
    driven = {(link.target, link.input) for link in system.input_links}
    for number, machine in enumerate(system.machines):
        shared = {slot.name for slot in machine.shared}
        set_by_others = {
            variable.name
            for place, variable in enumerate(machine.chart.inputs)
            if (number, place) in driven
        }
        for name in machine.started:
            if name in shared or name in set_by_others:
                whose = "shared" if name in shared else "connected"
                findings.add(
                    "duplicate-connection",
                    f"`{machine.name}.{name}` is {whose}: its start value comes from there",
                    machine.span,
                    help="give the start value under `shared`, or in the chart of the writer; "
                    "remove this one",
                )


def started_inputs(machines: Iterable[Machine]) -> list[tuple[int, int]]:
    """Return the inputs, by machine and number, whose start value the system gives."""
    return [
        (number, place)
        for number, machine in enumerate(machines)
        for place, variable in enumerate(machine.chart.inputs)
        if variable.name in machine.started
    ]


def with_any_starts(system: System) -> System:
    """Return a system with the start values ``any`` as choices of its machines."""
    machines = tuple(
        replace(machine, chart=_with_choices(machine.chart, machine.any_start))
        if machine.any_start
        else machine
        for machine in system.machines
    )
    return replace(system, machines=machines)


def _with_choices(chart: Chart, names: tuple[str, ...]) -> Chart:
    """Return a chart that stores the results of operations in some data when it starts."""
    variables = (*chart.data, *chart.inputs, *chart.outputs)
    taken = {one.name for one in chart.operations} | {one.name for one in variables}
    operations: list[Operation] = []
    statements: list[Assign[lang.Location, lang.Expr]] = []
    for variable in chart.data:
        if variable.name not in names:
            continue
        name = "start_" + re.sub(r"\W", "_", variable.name)
        while name in taken:
            name += "_"
        taken.add(name)
        operations.append(Operation(name, (), variable.type, variable.span))
        location = lang.Variable(variable.name, variable.type, lang.Storage.DATA, variable.span)
        value = lang.Call(name, (), variable.type, variable.span)
        statements.append(Assign(location, value, variable.span))
    return replace(
        chart,
        operations=(*chart.operations, *operations),
        script=(*statements, *chart.script),
    )
