"""From Documents to a Chart: the passes, in order."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.chart.chart import Chart
from fsmkit.chart.checks import run_checks
from fsmkit.chart.inheritance.resolve import resolve_inheritance
from fsmkit.chart.passes.as_globals import as_globals
from fsmkit.chart.passes.bind_late import bind_late, name_sends
from fsmkit.chart.passes.build_chart import build_chart
from fsmkit.chart.passes.check_narrowing import check_narrowing
from fsmkit.chart.passes.check_nesting import check_nesting, report_unsupported
from fsmkit.chart.passes.collect_events import collect_events
from fsmkit.chart.passes.collect_names import collect_names, declare_loops
from fsmkit.chart.passes.context import REPLACING
from fsmkit.chart.passes.invoke_charts import Draft, invoke_charts, returned
from fsmkit.chart.passes.number_states import number_states
from fsmkit.chart.passes.plan_invocations import plan_invocations
from fsmkit.chart.passes.read_capacities import read_capacities
from fsmkit.chart.passes.resolve_targets import resolve_targets
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.scxml.ecmascript.bound_arrays import bound_arrays
from fsmkit.scxml.ecmascript.hoist_increments import hoist_increments
from fsmkit.scxml.ecmascript.lower import lower_ecmascript
from fsmkit.scxml.ecmascript.spread_objects import spread_objects


def elaborate(
    documents: tuple[Document, ...],
    findings: Findings,
    *,
    strict: bool = False,
    given: InvocationContext | None = None,
) -> Chart | None:
    """Return the Chart of a document (the first) and its bases (nearest first).

    None where an error was found. With ``strict``, content that lenient dialects keep as
    ``error.execution`` at run time is an error now. ``given`` says what an invoked chart has from
    the one that invokes it; the charts that this one invokes are elaborated with it.
    """
    resolved = resolve_inheritance(documents, findings)
    resolved = replace(resolved, document=as_globals(resolved.document))
    document = hoist_increments(bind_late(name_sends(resolved.document)))
    document = spread_objects(document, given)
    document = bound_arrays(document, given, findings)
    document = lower_ecmascript(document, given)
    tree = number_states(document, findings)
    check_nesting(tree, findings, is_loose=document.datamodel != "fsmkit")
    report_unsupported(tree, findings, strict=strict)
    arrows = resolve_targets(document, tree, findings)
    capacities = read_capacities(document, findings)
    names = collect_names(document, tree, capacities.tick, findings, given)
    events = collect_events(document, tree, names.scope, findings, given)
    slots = plan_invocations(document, tree, given, findings)
    check_narrowing(resolved.base, names, capacities.tick, findings)
    if findings.has_errors:
        return None
    names = declare_loops(document, tree, names)
    draft = Draft(document, tree, names, events, slots, given)
    charts = invoke_charts(draft, elaborate, findings, strict=strict)
    if charts is None:
        return None
    names, events = draft.typed(returned(slots, charts), findings)
    chart = build_chart(
        documents,
        document,
        tree,
        arrows,
        names,
        events,
        capacities,
        findings,
        strict=strict,
        draft=draft,
        charts=charts,
    )
    if strict:
        findings.escalate(REPLACING)
    if chart is not None and not findings.has_errors:
        run_checks(chart, findings)
    return None if findings.has_errors else chart
