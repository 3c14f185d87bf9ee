"""Type invocations and the events that the two machines exchange (SCXML 6.4, 6.5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from fsmkit.chart.chart import Chart, Event, Invocation, Operation, Passage, every_operation
from fsmkit.chart.passes.collect_events import Events, Returned
from fsmkit.chart.passes.context import Context, warn_not_evaluable
from fsmkit.chart.passes.invoke_charts import (
    Draft,
    given_values,
    returned,
    sent_events,
    top_level,
)
from fsmkit.chart.passes.number_states import Node, Tree
from fsmkit.chart.passes.plan_invocations import Slot, is_service
from fsmkit.chart.passes.type_content import type_block, type_condition, type_value
from fsmkit.chart.statements import Block, Branch, Fail, If, Invoke, Statement
from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.document.document import DocInvoke
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.literal_content import string
from fsmkit.language import EnumType, Expr, RecordType, location_of_session, type_expression
from fsmkit.language.statements.tree import Assign
from fsmkit.language.statements.tree import Block as DocBlock


def invoker_targets(given: InvocationContext | None) -> frozenset[str]:
    """Return the targets under which an invoked machine reaches its invoker."""
    if given is None:
        return frozenset()
    return frozenset(("#_parent", location_of_session(given.invoker)))


def type_invokes(
    tree: Tree, slots: tuple[Slot, ...], charts: tuple[Chart, ...], context: Context
) -> tuple[tuple[Block, ...], ...]:
    """Return, for each state, a block for each thing that it invokes."""
    return tuple(
        tuple(
            _invoke(node, invoke, slots, charts, context.at(node.index))
            for invoke in node.state.invokes
        )
        for node in tree.nodes
    )


def _invoke(
    node: Node,
    invoke: DocInvoke,
    slots: tuple[Slot, ...],
    charts: tuple[Chart, ...],
    context: Context,
) -> Block:
    own = [slot for slot in slots if slot.invoke is invoke]
    if not own:
        return (Fail(f"what `{node.id}` invokes is not run", invoke.span),)

    def started(source: str) -> Block:
        found = [slot for slot in own if slot.source == source]
        if not found:
            return (Fail(f"`{source}` could not be read", invoke.span),)
        failures = _failing_values(found[0], charts[found[0].index], context)
        return (*failures, _start(found[0], charts[found[0].index], context))

    start = started(own[0].source)
    if invoke.src_expr is not None:
        start = _choice(invoke, invoke.sources, lambda text: started(text.value), context)
    if invoke.type_expr is not None:
        inner = start

        def served(text: Text) -> Block:
            failure = Fail(f"there is no service `{text}`", invoke.span)
            return inner if is_service(text) else (failure,)

        start = _choice(invoke, invoke.types, served, context)
    return (*_stored_id(own[0], context), *start)


def _choice(
    invoke: DocInvoke,
    values: tuple[tuple[Text | None, Text], ...],
    then: Callable[[Text], Block],
    context: Context,
) -> Block:
    branches: list[Branch[Expr, Statement]] = []
    for condition, value in values:
        test = None if condition is None else type_condition(condition, context)
        branches.append(Branch(test, then(value)))
    if branches[-1].condition is not None:
        branches.append(Branch(None, (Fail("what to invoke has no value", invoke.span),)))
    return (If(tuple(branches), invoke.span),)


def _stored_id(slot: Slot, context: Context) -> Block:
    """Return the assignment of the id to a location, if there is one (SCXML 6.4.1)."""
    location = slot.invoke.id_location
    if location is None:
        return ()
    return type_block((Assign(location, string(slot.id, location), slot.invoke.span),), context)


def _failing_values(slot: Slot, chart: Chart, context: Context) -> Block:
    """Return ``error.execution`` for a value that nobody takes and that cannot be evaluated."""
    taken = {name for name, _ in _given_data(slot, chart)}
    for name, value in given_values(slot.invoke):
        attempt = Findings()
        if name in taken or not context.is_loose:
            continue
        type_expression(value, context.scope, attempt)
        wrong = [d for d in attempt if d.severity is Severity.ERROR]
        if wrong and any(d.rule.name != "outside-language" for d in wrong):
            warn_not_evaluable(wrong[0].message, value.span, context.findings, wrong[0].help)
            return (Fail(wrong[0].message, value.span),)
    return ()


def _start(slot: Slot, chart: Chart, context: Context) -> Statement:
    known = top_level(slot.documents)
    arguments: list[Expr] = []
    for name, data in _given_data(slot, chart):
        values = [v for n, v in given_values(slot.invoke) if n == name and name in known]
        value = values[-1]  # as `_event.data.x` reads the last of two
        typed = type_value(value, chart.data[data].type, context)
        if typed is not None:
            arguments.append(typed)
    return Invoke(slot.index, tuple(arguments), slot.invoke.span)


def _given_data(slot: Slot, chart: Chart) -> list[tuple[str, int]]:
    """Return the data that are given, each once, with their places in the chart."""
    places = {data.name: place for place, data in enumerate(chart.data)}
    names = dict.fromkeys(name for name, _ in given_values(slot.invoke))
    known = top_level(slot.documents)
    return [(name, places[name]) for name in names if name in known and name in places]


def _check_operations(
    own: tuple[Operation, ...],
    slots: tuple[Slot, ...],
    charts: tuple[Chart, ...],
    findings: Findings,
) -> None:
    """Report operations of one name and other types: one host performs those of all machines."""
    known = {operation.name: operation for operation in own}
    for slot, chart in zip(slots, charts, strict=True):
        for name, operation in every_operation(chart).items():
            first = known.setdefault(name, operation)
            if first is operation or _signature(first) == _signature(operation):
                continue
            findings.add(
                "invocation-mismatch",
                f"operation `{name}` of `{chart.name}` has other types than the one declared here",
                first.span,
                secondary=[(operation.span, "the other"), (slot.invoke.span, "invoked here")],
                help="one host performs the operations of a chart and of its invoked charts: "
                "rename one of the two, or give both the same types",
            )


def _signature(operation: Operation) -> tuple[object, ...]:
    return operation.result, *(parameter.type for parameter in operation.parameters)


def build_invocations(
    draft: Draft, events: Events, charts: tuple[Chart, ...], findings: Findings
) -> tuple[Invocation, ...]:
    """Return the invocations of a chart, with the passages of events in both directions."""
    slots = draft.slots
    _check_operations(draft.names.operations, slots, charts, findings)
    coming = returned(slots, charts)
    found = []
    for slot, chart in zip(slots, charts, strict=True):
        sent = frozenset(sent_events(slot, draft, events))
        _check(slot, chart, [events.all[index] for index in sorted(sent)], coming, findings)
        found.append(
            Invocation(
                index=slot.index,
                state=slot.state,
                id=slot.id,
                chart=chart,
                given=tuple(place for _, place in _given_data(slot, chart)),
                passages=tuple(
                    _passage(event, chart) if event.index in sent else None for event in events.all
                ),
                returns=_returns(slot, chart, events, coming),
                autoforward=slot.invoke.autoforward,
                span=slot.invoke.span,
            )
        )
    return tuple(found)


def _passage(event: Event, chart: Chart) -> Passage | None:
    """Return the passage of an event into an invoked chart, or None if that has no such event."""
    index = chart.event_index.get(event.name)
    if index is None or not chart.events[index].directions:
        return None
    places = {part: place for place, part in enumerate(event.fields)}
    return Passage(index, tuple(places.get(part) for part in chart.events[index].fields))


def _returns(
    slot: Slot, chart: Chart, events: Events, coming: tuple[Returned, ...]
) -> tuple[int | None, ...]:
    here = {e.name: e.index for e in events.all if e.invocation == slot.index}
    names = {r.event: r.name for r in coming if r.slot == slot.index}
    return tuple(here[names[e.index]] if e.index in names else None for e in chart.events)


def _check(
    slot: Slot, chart: Chart, sent: list[Event], coming: tuple[Returned, ...], findings: Findings
) -> None:
    """Report fields that cannot be passed, and an invoked chart with inputs."""
    if chart.inputs:
        findings.add(
            "invocation-mismatch",
            f"`{chart.name}` has inputs, and nothing writes those of an invoked chart",
            slot.invoke.span,
            help="give it data instead, and send it an event when they change",
        )
    for event in coming:
        if event.slot == slot.index and any(
            isinstance(part.type, EnumType | RecordType) for part in event.fields
        ):
            findings.add(
                "invocation-mismatch",
                f"`{event.name}` of `{chart.name}` has fields of types that only that chart has",
                slot.invoke.span,
                help="send numbers, truth values or strings to the invoker",
            )
    for own in sent:
        passage = _passage(own, chart)
        if passage is None or not own.fields:
            continue
        names = {part.name for part in chart.events[passage.event].fields}
        lost = [part for part in own.fields if part.name in names]
        kept = [place for place in passage.fields if place is not None]
        if len(kept) < len(lost):
            findings.add(
                "invocation-mismatch",
                f"`{own.name}` has fields of other types in `{chart.name}`",
                slot.invoke.span,
                help="give the fields one type in both charts",
            )


def with_finalize(events: Events, slots: tuple[Slot, ...], context: Context) -> tuple[Event, ...]:
    """Return the events; those of invoked machines have their ``finalize``."""
    return tuple(
        event
        if event.invocation is None
        else replace(event, finalize=_finalize(event, slots[event.invocation], events, context))
        for event in events.all
    )


def _finalize(event: Event, slot: Slot, events: Events, context: Context) -> Block:
    written = slot.invoke.finalize
    if written is None:
        return ()
    if not written:
        written = _stored_fields(event, slot)
    scope = replace(
        context.scope,
        event_fields=events.common_fields((event.index,)),
        event_facts=events.common_facts((event.index,)),
    )
    return type_block(written, replace(context, scope=scope))


def _stored_fields(event: Event, slot: Slot) -> DocBlock:
    """Return the assignments of an empty ``finalize``: it reads passed data back (SCXML 6.5.2)."""
    fields = {part.name for part in event.fields}
    names = [name for name in slot.invoke.name_list if name.value.strip() in fields]
    return tuple(
        Assign(
            name,
            name.with_value(f"_event.data.{name.value.strip()}"),
            slot.invoke.span,
        )
        for name in names
    )
