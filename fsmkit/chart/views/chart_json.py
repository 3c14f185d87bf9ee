"""A chart as data for JSON."""

from __future__ import annotations

from dataclasses import asdict

from fsmkit.chart.chart import Chart, Data, Event, Invocation, State, Transition
from fsmkit.chart.format import format_statement
from fsmkit.chart.statements import Block
from fsmkit.chart.views.origins import ItemOrigin, Origins
from fsmkit.chart.views.properties import environment_parts, property_parts
from fsmkit.diagnostics import Span
from fsmkit.diagnostics.as_json import location
from fsmkit.document import keys
from fsmkit.document.document import Origin, Trigger
from fsmkit.language import EnumType, Expr, Field, RecordType, Type, format_expression, format_value

Json = dict[str, object]


def chart_document(chart: Chart, origins: Origins) -> Json:
    """Return a chart as data: names and texts, each item with its origin and its place."""
    tick = chart.capacities.tick
    return {
        "name": chart.name,
        "doc": chart.doc,
        "req": [one.value for one in chart.req],
        "base": chart.base,
        "abstract": chart.abstract,
        "sources": [source.name for source in chart.sources],
        "capacities": asdict(chart.capacities),
        "types": [{**_type(t), **_from(origins.types.get(str(t)))} for t in chart.types],
        "constants": [
            {
                "name": name,
                "value": format_value(value.value, value.type, tick),
                **_from(origins.constants.get(name)),
            }
            for name, value in chart.constants
        ],
        "data": [_data(d, chart) for d in chart.data],
        "inputs": [_data(d, chart) for d in chart.inputs],
        "outputs": [_data(d, chart) for d in chart.outputs],
        "operations": [
            {
                "name": o.name,
                "parameters": _fields(o.parameters),
                "result": None if o.result is None else str(o.result),
                **({"tried": list(o.tried)} if o.tried else {}),
                "req": [one.value for one in o.req],
                **_at(o.origin, o.span),
            }
            for o in chart.operations
        ],
        "functions": [
            {
                "name": f.name,
                "parameters": [{"name": p.name, "type": str(p.type)} for p in f.parameters],
                "result": str(f.result),
                "body": _block(f.body, chart),
                **_from(origins.functions.get(f.name)),
            }
            for f in chart.functions
        ],
        "events": [_event(e) for e in chart.events],
        "script": _block(chart.script, chart),
        "states": [_state(s, chart) for s in chart.states],
        "transitions": [_transition(t, chart) for t in chart.transitions],
        "invocations": [_invocation(i, chart) for i in chart.invocations],
        "properties": [
            {
                "name": p.name.value,
                "kind": p.kind.value,
                "parts": property_parts(p),
                **({"watch": [text.value for text in p.watch]} if p.watch else {}),
                "req": [one.value for one in p.req],
                **_at(p.origin, p.name.span),
            }
            for p in chart.properties
        ],
        "environment": None if chart.environment is None else environment_parts(chart.environment),
    }


def _at(origin: Origin, span: Span | None) -> Json:
    found: Json = {"origin": origin.value}
    return found if span is None else {**found, "at": location(span)}


def _from(where: ItemOrigin | None) -> Json:
    return {} if where is None else _at(where.origin, where.span)


def _type(type_: Type) -> Json:
    match type_:
        case EnumType(name, members):
            numbers = {} if type_.is_counted else {"numbers": list(type_.numbers)}
            return {"name": name, "members": list(members), **numbers}
        case RecordType(name, fields):
            return {"name": name, "fields": _fields(fields)}
        case _:
            return {"name": str(type_)}


def _fields(fields: tuple[Field, ...]) -> list[Json]:
    return [{"name": f.name, "type": str(f.type)} for f in fields]


def _data(data: Data, chart: Chart) -> Json:
    start = format_value(data.init.value, data.type, chart.capacities.tick)
    return {
        "name": data.name,
        "type": str(data.type),
        "start": start,
        **_at(data.origin, data.span),
    }


def _event(event: Event) -> Json:
    return {
        "name": event.name,
        "directions": sorted(d.value for d in event.directions),
        "fields": _fields(event.fields),
        "reply": None if event.reply is None else str(event.reply),
        **_at(event.origin, event.span),
    }


def _block(block: Block, chart: Chart) -> list[str]:
    return [format_statement(statement, chart) for statement in block]


def _expr(expr: Expr | None, chart: Chart) -> str | None:
    return None if expr is None else format_expression(expr, chart.capacities.tick)


def _state(state: State, chart: Chart) -> Json:
    return {
        "id": state.id,
        "kind": state.kind.value,
        "parent": None if state.parent is None else chart.states[state.parent].id,
        "children": [chart.states[c].id for c in state.children],
        "initial": state.initial,
        "transitions": list(state.transitions),
        "entry": [_block(b, chart) for b in state.on_entry],
        "exit": [_block(b, chart) for b in state.on_exit],
        "invoke": [_block(b, chart) for b in state.invokes],
        "defer": [chart.events[e].name for e in state.defer],
        "invariant": _expr(state.invariant, chart),
        **keys.plain_values(state, keys.kept_keys(keys.STATE, State)),
        **_at(state.origin, state.span),
    }


def _invocation(invocation: Invocation, chart: Chart) -> Json:
    """Return a slot with the whole chart of the machine in it."""
    within = invocation.chart
    finalize = {
        event.name: _block(event.finalize, chart)
        for event in chart.events
        if event.invocation == invocation.index and event.finalize
    }
    return {
        "id": invocation.id,
        "state": chart.states[invocation.state].id,
        "given": [within.data[location].name for location in invocation.given],
        "autoforward": invocation.autoforward,
        "finalize": finalize,
        **({} if invocation.span is None else {"at": location(invocation.span)}),
        "chart": chart_document(within, Origins({}, {}, {}, {})),
    }


def _transition(transition: Transition, chart: Chart) -> Json:
    timed = transition.trigger in (Trigger.AFTER, Trigger.EVERY)
    return {
        "index": transition.index,
        "source": chart.states[transition.source].id,
        "trigger": transition.trigger.value,
        "descriptors": list(transition.descriptors),
        "events": [chart.events[e].name for e in transition.events],
        "delay_us": transition.delay * chart.capacities.tick if timed else None,
        "guard": _expr(transition.guard, chart),
        "targets": [chart.states[t].id for t in transition.targets],
        "content": _block(transition.content, chart),
        **keys.plain_values(transition, keys.kept_keys(keys.TRANSITION, Transition)),
        **_at(transition.origin, transition.span),
    }
