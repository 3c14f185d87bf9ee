"""Elaborate invoked charts together with the chart that invokes them.

A loose dialect does not declare the types of exchanged events and data. Each chart is therefore
elaborated with the types known of the other one, until nothing changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from fsmkit.chart.chart import Chart, Event
from fsmkit.chart.content import all_statements
from fsmkit.chart.passes.collect_events import Events, Returned
from fsmkit.chart.passes.collect_names import Names
from fsmkit.chart.passes.infer_types import infer_types, type_of
from fsmkit.chart.passes.number_states import Tree, places
from fsmkit.chart.passes.plan_invocations import Slot, targets
from fsmkit.chart.statements import Destination, Send
from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import Direction, DocInvoke, Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.language.statements.tree import DocSend, statements

MOST_ROUNDS = 8


class Elaborate(Protocol):
    """Elaborates one chart (`fsmkit.chart.elaborate`)."""

    def __call__(
        self,
        documents: tuple[Document, ...],
        findings: Findings,
        *,
        strict: bool,
        given: InvocationContext,
    ) -> Chart | None:
        """Return the chart, or None if it has errors."""
        ...


@dataclass(frozen=True, slots=True)
class Draft:
    """An incomplete chart: its names, events and slots before its types are known."""

    document: Document
    tree: Tree
    names: Names
    events: Events
    slots: tuple[Slot, ...]
    given: InvocationContext | None

    def typed(self, returned: tuple[Returned, ...], findings: Findings) -> tuple[Names, Events]:
        """Return names and events of known types, events of invoked machines among them."""
        events = self.events.with_returned(returned)
        return infer_types(
            self.document, self.tree, self.names, events, findings, self.given, self.slots
        )


def invoke_charts(
    draft: Draft, elaborate: Elaborate, findings: Findings, *, strict: bool
) -> tuple[Chart, ...] | None:
    """Return the chart of each slot, or None if one has errors, which are reported."""
    if not draft.slots:
        return ()
    charts: tuple[Chart, ...] = ()
    contexts: tuple[InvocationContext, ...] = ()
    for _ in range(MOST_ROUNDS):
        names, events = draft.typed(returned(draft.slots, charts), Findings())
        before, contexts = (
            contexts,
            tuple(_given(slot, draft, names, events) for slot in draft.slots),
        )
        if before == contexts:
            break
        tried = [
            elaborate(slot.documents, Findings(), strict=strict, given=given)
            for slot, given in zip(draft.slots, contexts, strict=True)
        ]
        charts = tuple(chart for chart in tried if chart is not None)
        if len(charts) < len(tried):
            break
    final = [
        elaborate(slot.documents, findings, strict=strict, given=given)
        for slot, given in zip(draft.slots, contexts, strict=True)
    ]
    charts = tuple(chart for chart in final if chart is not None)
    return charts if len(charts) == len(final) else None


def returned(slots: tuple[Slot, ...], charts: tuple[Chart, ...]) -> tuple[Returned, ...]:
    """Return the events that invoked charts send to the one that invokes them."""
    found = []
    for slot, chart in zip(slots, charts, strict=False):
        has_id: dict[int, bool] = {}
        for statement in all_statements(chart):
            if isinstance(statement, Send) and statement.destination is Destination.INVOKER:
                known = has_id.get(statement.event, False)
                has_id[statement.event] = known or statement.id is not None
        for event, may_have_id in sorted(has_id.items()):
            sent = chart.events[event]
            found.append(_returned(slot, sent.name, sent, has_id=may_have_id))
        if chart.done is not None:
            found.append(_returned(slot, f"done.invoke.{slot.id}", chart.events[chart.done]))
    return tuple(found)


def _returned(slot: Slot, name: str, event: Event, *, has_id: bool = False) -> Returned:
    return Returned(slot.index, slot.id, slot.session, name, event.fields, event.index, has_id)


def _given(slot: Slot, draft: Draft, names: Names, events: Events) -> InvocationContext:
    depth = draft.given.depth + 1 if draft.given is not None else 1
    passed = [events.all[i] for i in sent_events(slot, draft, events)]
    fields = {event.name: event.fields for event in passed}
    known = top_level(slot.documents)
    data = [
        (name, type_of(value, names.scope))
        for name, value in given_values(slot.invoke)
        if name in known
    ]
    session = draft.given.session if draft.given is not None else draft.document.name.value
    return InvocationContext(slot.session, session, tuple(fields.items()), tuple(data), depth)


def sent_events(slot: Slot, draft: Draft, events: Events) -> Iterator[int]:
    """Yield the events that are sent to an invoked machine, or all if it gets all."""
    if slot.invoke.autoforward:
        for event in events.all:
            if Direction.IN in event.directions or event.invocation is not None:
                yield event.index
        return
    reached = [target for target, found in targets(draft.slots).items() if slot.index in found]
    for place in places(draft.document, draft.tree):
        for statement in statements(place.block):
            match statement:
                case DocSend(event=name, target=target, target_expr=computed) if name is not None:
                    is_named = target is not None and target.value in reached
                    if (is_named or computed is not None) and name.value in events.index:
                        yield events.index[name.value]
                case _:
                    pass


def given_values(invoke: DocInvoke) -> list[tuple[str, Text]]:
    """Return the values for data of the invoked chart, by name (SCXML 6.4.1)."""
    listed = [(name.value.strip(), name) for name in invoke.name_list]
    return [*((a.name.value.strip(), a.value) for a in invoke.arguments), *listed]


def top_level(documents: tuple[Document, ...]) -> set[str]:
    """Return the data that an invoker can set: those of the chart, not of its states (6.4)."""
    return {data.name.value for document in documents for data in document.data}
