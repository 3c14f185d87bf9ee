"""Random charts that invoke random charts: what the documents mean does not matter here.

Sends of the invoked charts go to the invoker, some of the invoker's to them; every event can become
any other, as far as the types of their fields allow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import Choices
from fsmkit.chart.chart import Chart, Event, Invocation, Passage, State, Transition
from fsmkit.chart.elaborate import elaborate
from fsmkit.chart.statements import Assign, Block, Destination, Invoke, Send
from fsmkit.diagnostics import Findings, Span
from fsmkit.document.document import Direction, Kind, Trigger
from fsmkit.language import Call, EventField, Field, Storage, Variable

ERROR = "error.communication"
LEAVING = (Destination.PORT, Destination.SELF)


def random_family(choices: Choices, depth: int) -> Chart:
    """Return a random chart that invokes others, to that depth."""
    chart = elaborate((random_document(choices),), Findings())
    assert chart is not None
    if depth == 0:
        return chart
    found = [i for i in range(1, len(chart.states)) if not _is_bare(chart.states[i])]
    if not found:
        return chart
    children = []
    for place in range(choices.integer(1, 2)):
        child = _renamed(random_family(choices, depth - 1), place)
        children.append((choices.pick(found), _answering(choices, child)))
    return _invoking(choices, chart, children)


def _renamed(chart: Chart, place: int) -> Chart:
    """Return a chart whose operations are no others': the host has one of each name."""

    def change(node: Any) -> Any:
        is_call = isinstance(node, Call)
        return replace(node, operation=f"{node.operation}_{place}") if is_call else node

    operations = tuple(replace(one, name=f"{one.name}_{place}") for one in chart.operations)
    invocations = tuple(replace(i, chart=_renamed(i.chart, place)) for i in chart.invocations)
    return replace(_content(chart, change), operations=operations, invocations=invocations)


def _is_bare(state: State) -> bool:
    return state.is_history or state.kind in (Kind.FINAL, Kind.CHOICE)


def rewritten(node: Any, change: Callable[[Any], Any]) -> Any:
    """Return a tree in which every part was replaced, the inner ones first."""
    match node:
        case tuple():
            return tuple([rewritten(part, change) for part in node])
        case Span() | Chart():
            return node
        case _ if is_dataclass(node):
            new = {f.name: rewritten(getattr(node, f.name), change) for f in fields(node)}
            return change(replace(node, **new))  # type: ignore[type-var]
        case _:
            return node


def _content(chart: Chart, change: Callable[[Any], Any]) -> Chart:
    """Return a chart with other content."""
    return replace(
        chart,
        states=rewritten(chart.states, change),
        transitions=rewritten(chart.transitions, change),
        script=rewritten(chart.script, change),
    )


def _answering(choices: Choices, chart: Chart) -> Chart:
    """Return a chart to be invoked: it sends to its invoker, and reports its end to it."""

    def change(node: Any) -> Any:
        is_leaving = isinstance(node, Send) and node.destination in LEAVING
        if is_leaving and choices.chance(70):
            return replace(node, destination=Destination.INVOKER, peer="#_parent")
        return node

    chart = _content(chart, change)
    shown = [v for v in chart.data if choices.chance(40)][:2]
    done = Event(
        len(chart.events), "done.session", tuple(Field(v.name, v.type) for v in shown), frozenset()
    )
    values = tuple(Variable(v.name, v.type, Storage.DATA, v.span) for v in shown)
    states = tuple(
        replace(s, done_data=values) if s.kind is Kind.FINAL and s.parent == 0 else s
        for s in chart.states
    )
    return replace(chart, states=states, events=(*chart.events, done), done=done.index)


def _invoking(choices: Choices, chart: Chart, children: list[tuple[int, Chart]]) -> Chart:
    """Return a chart with slots for others."""
    events = list(chart.events)
    if ERROR not in chart.event_index:
        events.append(Event(len(events), ERROR, (), frozenset()))
    own = len(events)
    invocations = []
    for slot, (state, child) in enumerate(children):
        returns: list[int | None] = []
        for event in child.events:
            if event.index != child.done and not event.directions:
                returns.append(None)
                continue
            name = f"done.invoke.m{slot}" if event.index == child.done else event.name
            while any(e.name == name and e.fields != event.fields for e in events):
                name = f"{name}.m{slot}"  # a script distinguishes events by name
            finalize = _finalize(choices, chart, event) if choices.chance(60) else ()
            returns.append(len(events))
            events.append(
                Event(
                    len(events),
                    name,
                    event.fields,
                    frozenset({Direction.IN}),
                    invocation=slot,
                    finalize=finalize,
                )
            )
        given = tuple(p for p in range(len(child.data)) if choices.chance(30))
        invocations.append(
            Invocation(
                slot, state, f"m{slot}", child, given, (), tuple(returns), choices.chance(30)
            )
        )
    chart = replace(chart, events=tuple(events))
    for slot, invocation in enumerate(invocations):
        passages = tuple(_passage(choices, event, invocation.chart) for event in events)
        invocations[slot] = replace(invocation, passages=passages)
    chart = replace(chart, invocations=tuple(invocations))

    def change(node: Any) -> Any:
        is_sent = isinstance(node, Send) and node.destination is not Destination.INTERNAL
        if is_sent and choices.chance(50):
            slots = choices.some(range(len(invocations)), 2)
            return replace(
                node, destination=Destination.INVOKED, peer="#_m", invocations=tuple(slots)
            )
        return node

    chart = _content(chart, change)
    states = tuple(replace(s, invokes=_invokes(choices, chart, s.index)) for s in chart.states)
    transitions = tuple(_hearing(choices, chart, t, own) for t in chart.transitions)
    return replace(chart, states=states, transitions=transitions)


def _invokes(choices: Choices, chart: Chart, state: int) -> tuple[Block, ...]:
    blocks = []
    for invocation in chart.invocations:
        if invocation.state != state:
            continue
        types = [invocation.chart.data[place].type for place in invocation.given]
        arguments = tuple(
            choices.pick([v for v in (*chart.data, *invocation.chart.data) if v.type == type_])
            for type_ in types
        )
        shown = tuple(
            Variable(v.name, v.type, Storage.DATA, v.span) if v in chart.data else v.init
            for v in arguments
        )
        span = chart.root.span
        blocks.append((Invoke(invocation.index, shown, span),))
    return tuple(blocks)


def _finalize(choices: Choices, chart: Chart, event: Event) -> Block:
    """Keep a part of the event in data, where one has its type."""
    pairs = [(v, f) for v in chart.data for f in event.fields if v.type == f.type]
    if not pairs:
        return ()
    data, field = choices.pick(pairs)
    target = Variable(data.name, data.type, Storage.DATA, data.span)
    return (Assign(target, EventField(field.name, field.type, data.span), chart.root.span),)


def _passage(choices: Choices, event: Event, child: Chart) -> Passage | None:
    heard = [e for e in child.events if Direction.IN in e.directions]
    if not heard or choices.chance(20):
        return None
    same = [e for e in heard if e.name == event.name]
    there = choices.pick(same or heard)
    return Passage(there.index, tuple(_place(choices, event, f) for f in there.fields))


def _place(choices: Choices, event: Event, field: Field) -> int | None:
    places = [p for p, f in enumerate(event.fields) if f.type == field.type]
    return choices.pick(places) if places and choices.chance(80) else None


def _hearing(choices: Choices, chart: Chart, transition: Transition, own: int) -> Transition:
    """Return a transition that is also taken for events of invoked machines."""
    if transition.trigger is not Trigger.EVENT or not choices.chance(60):
        return transition
    reads: set[Field] = set()

    def note(node: Any) -> Any:
        if isinstance(node, EventField):
            reads.add(Field(node.name, node.type))
        return node

    rewritten((transition.guard, transition.content), note)
    heard = [e.index for e in chart.events[own:] if reads <= set(e.fields)]
    if not heard:
        return transition
    more = choices.some(heard, 3)
    return replace(transition, events=tuple(sorted({*transition.events, *more})))
