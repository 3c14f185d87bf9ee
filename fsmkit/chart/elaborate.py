"""From Documents to a Chart: the passes, in order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.chart.checks import run_checks
from fsmkit.chart.copies.copy import NO_CONSTANTS, Copy, Used
from fsmkit.chart.copies.declarations import joined_capacities
from fsmkit.chart.copies.expand import expand, has_copies
from fsmkit.chart.copies.reports import check_copies
from fsmkit.chart.copies.splicing import check_binding, splicer_of
from fsmkit.chart.ecmascript.bound_arrays import bound_arrays
from fsmkit.chart.ecmascript.hoist_increments import hoist_increments
from fsmkit.chart.ecmascript.inline_functions import inline_functions
from fsmkit.chart.ecmascript.logged_calls import log_calls
from fsmkit.chart.ecmascript.lower import lower_ecmascript
from fsmkit.chart.ecmascript.spread_objects import spread_objects
from fsmkit.chart.ecmascript.spread_params import spread_params
from fsmkit.chart.inheritance.resolve import resolve_inheritance
from fsmkit.chart.limits import check_document, check_limits
from fsmkit.chart.passes.as_globals import as_globals
from fsmkit.chart.passes.bind_late import bind_late, name_sends
from fsmkit.chart.passes.build_chart import build_chart, context_of
from fsmkit.chart.passes.check_narrowing import check_narrowing
from fsmkit.chart.passes.check_nesting import check_nesting, report_unsupported
from fsmkit.chart.passes.collect_events import collect_events
from fsmkit.chart.passes.collect_names import collect_names, constant_scope, declare_loops
from fsmkit.chart.passes.context import REPLACING, Context
from fsmkit.chart.passes.invoke_charts import Draft, invoke_charts, returned
from fsmkit.chart.passes.number_states import Tree, number_states
from fsmkit.chart.passes.plan_invocations import plan_invocations
from fsmkit.chart.passes.read_capacities import read_capacities
from fsmkit.chart.passes.resolve_targets import resolve_entries, resolve_targets
from fsmkit.chart.passes.type_states import exit_points
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Document
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.document.survey import Survey
from fsmkit.language import Literal


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
    found = _elaborate(documents, findings, strict=strict, given=given)
    if found is not None:
        check_limits(found.chart, findings)
    if found is not None and not findings.has_errors:
        check_copies(found.chart, run_checks, findings)
    return None if found is None or findings.has_errors else found.chart


def elaborate_used(
    documents: tuple[Document, ...],
    findings: Findings,
    *,
    strict: bool,
    constants: dict[str, Literal],
) -> Used | None:
    """Return a used chart, which fills a state of another, with its bound constants.

    Checks report findings on its copies, where bindings may avoid problems that it has alone.
    """
    found = _elaborate(documents, findings, strict=strict, constants=constants, is_used=True)
    if found is None or findings.has_errors:
        return None
    return Used(
        chart=found.chart,
        datamodel=found.document.datamodel,
        is_late=found.is_late,
        exits=exit_points(found.tree, found.context),
        depth=1 + max((copy.used.depth for copy in found.copies), default=0),
    )


@dataclass(frozen=True, slots=True)
class _Elaborated:
    chart: Chart
    document: Document
    tree: Tree
    context: Context
    copies: tuple[Copy, ...]
    is_late: bool


def _elaborate(
    documents: tuple[Document, ...],
    findings: Findings,
    *,
    strict: bool,
    given: InvocationContext | None = None,
    constants: Mapping[str, Literal] = NO_CONSTANTS,
    is_used: bool = False,
) -> _Elaborated | None:
    """Return a chart without running the checks; it is valid only if no error was found."""
    resolved = resolve_inheritance(documents, findings)
    survey = as_globals(Survey(inline_functions(resolved.document)))
    resolved = replace(resolved, document=survey.document)
    is_late = resolved.document.late_binding
    survey = hoist_increments(log_calls(bind_late(name_sends(survey))))
    survey = spread_objects(spread_params(survey), given)
    survey = bound_arrays(survey, given, findings)
    document = lower_ecmascript(survey, given)
    copies: tuple[Copy, ...] = ()
    known: Mapping[str, Literal] = NO_CONSTANTS
    if has_copies(document):
        tick = read_capacities(document, Findings()).tick
        scope = constant_scope(document, tick, Findings(), given, constants)
        document, copies = expand(document, scope, elaborate_used, findings, strict=strict)
        check_binding(copies, findings, is_late=is_late)
        if findings.has_errors:
            return None
        known = scope.constants
    tree = number_states(document, findings)
    if not check_document(document, [node.state for node in tree.nodes], findings):
        return None
    check_nesting(tree, findings, is_loose=document.datamodel != "fsmkit")
    report_unsupported(tree, findings, strict=strict)
    arrows = resolve_targets(document, tree, findings, copies, known)
    entries = resolve_entries(document, tree, findings, copies)
    capacities = joined_capacities(document, read_capacities(document, findings), copies)
    names = collect_names(document, tree, capacities.tick, findings, given, copies, constants)
    events = collect_events(document, tree, names.scope, findings, given, is_used=is_used)
    slots = plan_invocations(document, tree, given, findings)
    check_narrowing(resolved.base, names, capacities.tick, findings)
    if findings.has_errors:
        return None
    names = declare_loops(document, tree, names)
    splicer = splicer_of(copies, tree, names, len(slots), findings)
    events = splicer.with_events(events)
    draft = Draft(document, tree, names, events, slots, given)
    charts = invoke_charts(draft, elaborate, findings, strict=strict)
    if charts is None:
        return None
    names, events = draft.typed(returned(slots, charts), findings)
    events = splicer.with_events(events)
    spliced = splicer.spliced(names.scope, events.all, names.operations) if copies else None
    if copies and spliced is None:
        return None
    if spliced is not None:
        names = replace(names, scope=spliced.readable(names.scope))
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
        copies=spliced,
        entries=entries,
    )
    if strict:
        findings.escalate(REPLACING)
    context = context_of(document, names, events, findings, strict=strict)
    return _Elaborated(chart, document, tree, replace(context, copies=spliced), copies, is_late)
