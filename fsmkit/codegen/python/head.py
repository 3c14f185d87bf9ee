"""The start of a generated class: its slots, constants and start values."""

from __future__ import annotations

import json
from collections.abc import Container, Mapping

from fsmkit.codegen.python import invoking, relations, sending, template
from fsmkit.codegen.python.content import Needs
from fsmkit.codegen.python.expressions import Printer, spell
from fsmkit.codegen.python.family import Member
from fsmkit.codegen.python.lines import Lines
from fsmkit.codegen.python.linking import ME, resolve_links
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.selection import decimal
from fsmkit.document.document import Trigger
from fsmkit.language import ArrayType, Literal, RecordType
from fsmkit.plan import Plan

OFFERED = ("NAME", "STATES", "EVENTS", "log", "reply")
"""The constants and variables that hosts may use."""
WIDTH = 100
"""The width of the generated text in columns, except comments and long expressions."""


def print_start(out: Lines, plan: Plan, member: Member, needs: Needs, *, is_alone: bool) -> None:
    """Print the constructor and the initialization of the data."""
    chart, names = plan.chart, member.names
    with out.method(
        "__init__",
        "Make a machine; `operations` has the host's methods, or this has.",
        "operations: object | None = None",
    ):
        if not is_alone:
            _adoption(out, member)
        for name in names.locals.values():
            out.line(f"{ME}{name}: Any = None")
        for number, length in enumerate(needs.copies):
            out.line(f"{ME}_copy_{number}: list[Any] = [None] * {length}")
        for variable in chart.inputs:
            value = _start(names, variable.init)
            out.line(f"{ME}{names.variables[variable.name]} = {value}")
        if needs.is_covered:
            out.line(f"{ME}_forget_way()")
        out.line(f"{ME}_prepare(operations)")
    with out.method("_reset_data", "Give data, outputs and histories their start values."):
        for variable in (*chart.data, *chart.outputs):
            value = _start(names, variable.init)
            out.line(f"{ME}{names.variables[variable.name]} = {value}")
        for state in chart.states:
            if state.is_history:
                out.line(f"{ME}_history_{names.bare[state.index]} = 0")


def print_head(
    out: Lines,
    plan: Plan,
    member: Member,
    needs: Needs,
    shared: template.Template,
    tables: Mapping[str, object],
    used: Container[str] | None,
) -> None:
    """Print slots, types and constants of a class.

    ``used``: the constants to print, None for all; ``tables``: more constants.
    """
    chart, names = plan.chart, member.names
    variables = [v for group in (chart.data, chart.inputs, chart.outputs) for v in group]
    own = [names.variables[v.name] for v in variables]
    own += [f"_history_{names.bare[s.index]}" for s in chart.states if s.is_history]
    own += names.locals.values()
    own += [f"_copy_{number}" for number in range(len(needs.copies))]
    own += ["_way", "_noted"] if needs.is_covered else []

    def is_used(name: str) -> bool:
        return used is None or name in used or name in OFFERED

    out.line(f'"""{names.machine}: create it, `start` it, `post` events, `run` it to a time."""')
    out.line()
    slots = sorted({*filter(is_used, shared.slots), *own})
    if slots:
        with out.suite("__slots__ = ("):
            out.lines(f'"{slot}",' for slot in slots)
        out.line(")")
    else:
        out.line("__slots__ = ()")
    out.line()
    for variable in variables:
        out.line(f"{names.variables[variable.name]}: {sending.annotation(variable.type)}")
    out.lines(f"{name}: {type_}" for name, type_ in shared.variables.items() if is_used(name))
    out.line()
    constants = _constants(plan, names, needs)
    if shared.bases:
        constants |= invoking.constants(chart, needs)
    constants |= tables
    for name, value in constants.items():
        if is_used(name) and name in shared.constants:  # records need less than what is saved
            _constant(out, f"{name}: {shared.constants[name]} = ", value)
    out.line(f"_BITS: {shared.constants['_BITS']} = {{")
    out.line("    name: 1 << place for place, name in enumerate(STATES)")
    out.line("}")


def _adoption(out: Lines, member: Member) -> None:
    children = [f"{child.names.machine}(host)" for child in member.invoked]
    if children:
        out.line("host = self if operations is None else operations")
    wrapped(out, f"{ME}_adopt((", children, "))")


def _start(names: Names, value: Literal) -> str:
    """Return a start value; arrays and records as mutable lists."""
    is_parts = isinstance(value.type, ArrayType | RecordType)
    return spell(value.value, value.type, mutable=True) if is_parts else Printer(names).print(value)


def _constants(plan: Plan, names: Names, needs: Needs) -> dict[str, object]:
    chart = plan.chart
    timed = [t for t in chart.transitions if t.has_timer]
    errors = [e.index for e in chart.events if e.name.startswith("error.") and not e.directions]
    deferring = [0] * len(chart.events)
    for state in chart.states:
        for event in state.defer:
            deferring[event] |= 1 << state.index
    periods = [t.delay if t.trigger is Trigger.EVERY else 0 for t in chart.transitions]
    others = [
        tuple(o.index for o in chart.alternatives[t.index][1:]) if t.has_timer else ()
        for t in chart.transitions
    ]
    fields = [{f.name: place for place, f in enumerate(e.fields)} for e in chart.events]
    hosts = [name for name, *_ in sending.host_methods(chart, names, needs)]
    postable = [chart.events[chart.event_index[e.name]] for e in chart.events]
    return {
        "NAME": chart.name,
        "STATES": tuple(s.id for s in chart.states),
        "EVENTS": tuple(e.name for e in chart.events),
        "OPERATIONS": tuple(hosts),
        "FIELDS": tuple(fields),
        "LEAVES": sum(1 << s.index for s in chart.states if s.is_leaf),
        "WIDTH": max((len(e.fields) for e in chart.events), default=0),
        "QUEUE": chart.capacities.queue,
        "INTERNAL": chart.capacities.internal,
        "DELAYED": chart.capacities.delayed,
        "MICROSTEPS": chart.capacities.microsteps,
        "TIMERS": len(timed) + chart.capacities.delayed,
        "SAMPLES_INPUTS": plan.features.samples_inputs,
        "ERROR_EXECUTION": chart.event_index.get("error.execution", -1),
        "ERROR_RANGE": chart.event_index.get("error.range", -1),
        "ERRORS": () if chart.lenient else tuple(errors),
        "DEFERRING": tuple(deferring),
        "PERIODS": tuple(periods),
        "OTHERS": tuple(others),
        "_POSTABLE": {e.name: (e.index, len(e.fields)) for e in postable},
        **relations.conflict_tables(plan),
    }


def _constant(out: Lines, opening: str, value: object) -> None:
    match value:
        case tuple():
            wrapped(out, f"{opening}(", [_spelled(part) for part in value], ")")
        case dict():
            parts = [f"{_spelled(key)}: {_spelled(part)}" for key, part in value.items()]
            wrapped(out, f"{opening}{{", parts, "}")
        case _:
            out.line(opening + _spelled(value))


def _spelled(value: object) -> str:
    if isinstance(value, int):
        return decimal(value)
    return json.dumps(value) if isinstance(value, str) else repr(value)


def wrapped(out: Lines, opening: str, parts: list[str], closing: str) -> None:
    """Print a sequence on one line, or on as many lines as it needs."""
    comma = "," if len(parts) == 1 and closing.startswith(")") else ""
    whole = f"{opening}{', '.join(parts)}{comma}{closing}"
    if len(resolve_links(whole)) + 4 <= WIDTH:
        out.line(whole)
        return
    rows, row = [], ""
    for part in parts:
        if row and len(resolve_links(row + part)) + 10 > WIDTH:
            rows.append(row.rstrip())
            row = ""
        row += f"{part}, "
    rows.append(row.rstrip())
    out.line(opening)
    with out.indented():
        out.lines(rows)
    out.line(closing)
