"""``leaves-all-regions``: a transition from one region of a parallel state into another."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import add_key
from fsmkit.document import keys
from fsmkit.document.document import Kind, Trigger


def check(chart: Chart, findings: Findings) -> None:
    """Report each with the innermost parallel state whose regions it crosses.

    The domain of such a transition is the state around the parallel one (SCXML 3.13), so all
    regions are left and entered. Targets in each region express this intent and are not reported.
    """
    for transition in chart.transitions:
        is_default = transition.trigger is Trigger.INITIAL  # it leaves nothing
        parallel = None if transition.ordered or is_default else _crossed(chart, transition)
        if parallel is None:
            continue
        regions = chart.states[parallel].children
        named = {r for r in regions for t in transition.targets if _is_in(chart, t, r)}
        others = [
            f"`{chart.states[r].id}`" for r in regions if r not in named and _is_real(chart, r)
        ]
        if not others:
            continue
        name = chart.states[parallel].id
        findings.add(
            "leaves-all-regions",
            f"the transition leaves all regions of `{name}`, and {', '.join(others)} restart: "
            "its target is in another region than its source",
            transition.span,
            secondary=[(chart.states[parallel].span, "these regions")],
            help="raise an event that the other region handles, name a target in each region, or "
            "mark the transition as intended: `ordered: true`",
            fixes=add_key(transition.span, "ordered", "true", keys.LABELLED),
        )


def _crossed(chart: Chart, transition: Transition) -> int | None:
    """Return the innermost parallel state of which source and a target are in different regions."""
    below = transition.source
    for above in chart.ancestors(transition.source):
        targets = [t for t in transition.targets if chart.is_descendant(t, above)]
        is_crossing = any(not _is_in(chart, target, below) for target in targets)
        if chart.states[above].kind is Kind.PARALLEL and is_crossing:
            return above
        if len(targets) == len(transition.targets):
            return None
        below = above
    return None


def _is_in(chart: Chart, state: int, region: int) -> bool:
    return state == region or chart.is_descendant(state, region)


def _is_real(chart: Chart, state: int) -> bool:
    return not chart.states[state].is_history
