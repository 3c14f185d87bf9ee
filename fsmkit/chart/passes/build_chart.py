"""Type all content and put the Chart together."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.chart.chart import Capacities, Chart
from fsmkit.chart.copies.splicing import Spliced
from fsmkit.chart.passes.collect_events import DONE, Events
from fsmkit.chart.passes.collect_names import Names
from fsmkit.chart.passes.context import Context
from fsmkit.chart.passes.invoke_charts import Draft
from fsmkit.chart.passes.number_states import Tree
from fsmkit.chart.passes.plan_invocations import targets
from fsmkit.chart.passes.resolve_targets import Arrows
from fsmkit.chart.passes.type_content import type_block
from fsmkit.chart.passes.type_invokes import (
    build_invocations,
    invoker_targets,
    type_invokes,
    with_finalize,
)
from fsmkit.chart.passes.type_states import check_abstract, type_states
from fsmkit.chart.passes.type_transitions import type_transitions
from fsmkit.chart.passes.type_transitions import with_copies as copied_transitions
from fsmkit.chart.statements import Block, Raise
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document


def build_chart(
    documents: tuple[Document, ...],
    document: Document,
    tree: Tree,
    arrows: Arrows,
    names: Names,
    events: Events,
    capacities: Capacities,
    findings: Findings,
    *,
    strict: bool,
    draft: Draft,
    charts: tuple[Chart, ...],
    copies: Spliced | None = None,
    entries: tuple[tuple[str, tuple[int, ...]], ...] = (),
) -> Chart:
    """Return the chart of a resolved document; sound only if no error was found.

    ``charts`` are those that it invokes, ``copies`` what it uses, ``entries`` its entry points.
    """
    slots, given = draft.slots, draft.given
    context = context_of(document, names, events, findings, strict=strict)
    context = replace(context, invoked=targets(slots), invoker=invoker_targets(given))
    context = replace(context, copies=copies)
    chart = Chart(
        name=document.name.value,
        states=type_states(tree, arrows, type_invokes(tree, slots, charts, context), context),
        transitions=type_transitions(arrows, context),
        events=with_finalize(events, slots, context),
        data=names.data,
        inputs=names.inputs,
        outputs=names.outputs,
        operations=names.operations,
        capacities=capacities,
        types=names.types,
        functions=names.functions,
        constants=names.constants,
        script=(*_failures(names, events), *type_block(document.script, context)),
        lenient=document.datamodel != "fsmkit",
        abstract=check_abstract(
            tree,
            documents[0].source,
            findings,
            is_abstract=document.abstract,
            is_derived=len(documents) > 1,
        ),
        doc=document.doc,
        req=tuple(dict.fromkeys(document.req)),
        base=documents[1].name.value if len(documents) > 1 else None,
        invocations=build_invocations(draft, events, charts, findings),
        done=None if given is None else events.index.get(DONE),
        entries=entries,
        properties=document.properties,
        environment=document.environment,
        sources=tuple(d.source for d in documents),
    )
    return chart if copies is None else with_copies(chart, copies, tree, arrows)


def with_copies(chart: Chart, copies: Spliced, tree: Tree, arrows: Arrows) -> Chart:
    """Return a chart with the transitions, events and data of its copies."""
    return replace(
        chart,
        transitions=copied_transitions(chart.transitions, arrows, tree, copies),
        events=copies.finalized(chart.events),
        functions=(*copies.functions(), *chart.functions),
        data=(*chart.data, *copies.data("data")),
        inputs=(*chart.inputs, *copies.data("inputs")),
        outputs=(*chart.outputs, *copies.data("outputs")),
        operations=(*chart.operations, *copies.operations()),
        constants=(*chart.constants, *copies.constants()),
        script=(*copies.script(), *chart.script),
        invocations=(*chart.invocations, *copies.invocations()),
        copies=tuple(copies.described()),
    )


def _failures(names: Names, events: Events) -> Block:
    """Return an error for each start value of no meaning; the script goes on (SCXML 5.3, 5.8)."""
    error = events.index["error.execution"]
    return tuple(Raise(error, (), failure.span) for failure in names.failures)


def context_of(
    document: Document, names: Names, events: Events, findings: Findings, *, strict: bool
) -> Context:
    """Return the context of content that belongs to no event: entry, exit, script."""
    is_loose = document.datamodel != "fsmkit"
    return Context(
        scope=replace(names.scope, event_fields={} if is_loose else None),
        events=events,
        findings=findings,
        lenient=is_loose and not strict,
        replies=tuple(e.reply for e in events.all if e.reply is not None),
    )
