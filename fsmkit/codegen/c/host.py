"""Forwarding functions of a host, which serve any machine.

The includer defines ``FSM_HOST_CALL(m, operation, given, result)`` and ``FSM_HOST_SEND(m, event,
given)``. Operations and events are numbers. ``given`` is an array of pointers to the arguments, or
NULL. ``result`` points to the result, or is NULL.
"""

from __future__ import annotations

from collections.abc import Collection

from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.expressions.types import loaded, parameter_type
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit import Emitter
from fsmkit.language import ArrayType, EnumType, Field


def print_host(out: Emitter, names: Names, but: Collection[int] = ()) -> None:
    """Print the operations of a machine and the functions that take outgoing events.

    ``but``: numbers of events and, counted after all events, of operations to omit.
    """
    p = names.prefix
    for number, operation in enumerate(names.chart.operations):
        if len(names.chart.events) + number in but:
            continue
        result = operation.result
        returned = "void" if result is None else parameter_type(result, names)
        taken = parameters(operation.parameters, names)
        out.line(f"{returned} {p}_{names.operations[operation.name]}({p} *m{taken})")
        with out.block("{"):
            if result is not None:
                out.line(f"{storage(result, names.records).text} result;")
            given = _given(out, names, operation.parameters)
            place = "NULL" if result is None else "&result"
            out.line(f"FSM_HOST_CALL(m, {number}u, {given}, {place});")
            if result is not None:
                out.line(f"return {loaded(result, 'result', names)};")
        out.line()
    for index in sent_events(names.chart):
        if index in but:
            continue
        event = names.chart.events[index]
        taken = parameters(event.fields, names)
        out.line(f"void {p}_send_{names.event_names[index]}({p} *m{taken})")
        with out.block("{"):
            given = _given(out, names, event.fields)
            out.line(f"FSM_HOST_SEND(m, {index}u, {given});")
        out.line()


def _given(out: Emitter, names: Names, fields: tuple[Field, ...]) -> str:
    """Print the array of pointers to the arguments; return its name."""
    if not fields:
        return "NULL"
    places = []
    for number, part in enumerate(fields):
        name = names.field(part.name)
        if isinstance(part.type, EnumType):
            stored = storage(part.type, names.records).text
            out.line(f"const {stored} fsm_value_{number} = ({stored}){name};")
            name = f"fsm_value_{number}"
        places.append(name if isinstance(part.type, ArrayType) else f"&{name}")
    listed = ", ".join(places)
    out.line(f"const void *const fsm_given[] = {{{listed}}};")
    return "fsm_given"
