"""Relations between transitions and states at compile time."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.codegen.python.linking import LINK, resolve_links
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.selection import has_regions
from fsmkit.document.document import Trigger
from fsmkit.emit.lines import one_line
from fsmkit.plan import Plan
from fsmkit.plan.conflicts import conflicts, outer_transitions

LONG = 16
"""The number of states beyond which exit and entry sets are computed at run time."""


def describe(chart: Chart, transition: Transition) -> str:
    """Return ``feeder.yaml:31 idle -> pushing on arrived``."""
    match transition.trigger:
        case Trigger.EVENT:
            cause = "on " + " ".join(transition.descriptors)
        case Trigger.EVENTLESS:
            cause = "always"
        case trigger:
            cause = f"{trigger.value} {transition.delay}"
    targets = ", ".join(chart.states[target].id for target in transition.targets)
    arrow = f"-> {targets} " if targets else ""
    source = chart.states[transition.source].id
    text = _line(transition) + source + f" {arrow}{cause}"
    return one_line(text).replace("\\", "/").replace('"', "'")


def _line(transition: Transition) -> str:
    span = transition.span
    if not span.source.text:
        return ""
    name = span.source.name.replace("\\", "/").split("/")[-1]
    return f"{name}:{span.source.position(span.start)[0]} "


def conflict_tables(plan: Plan) -> dict[str, object]:
    """Return for each transition those with sources outside its own, and its conflicts."""
    if not has_regions(plan.chart):
        return {"OUTER": (), "CLASHES": ()}
    return {"OUTER": outer_transitions(plan), "CLASHES": conflicts(plan)}


def configurations(plan: Plan, names: Names) -> dict[str, str]:
    """Return the constants of a chart without regions: each innermost state's configuration."""
    return {
        configuration(names, state): f"{configuration(names, plan.parents[state])} | "
        + names.states[state]
        for state in plan.regions[0].states
    }


def configuration(names: Names, state: int) -> str:
    """Return the constant of a state: ``C_IDLE`` for ``S_IDLE``."""
    return f"{LINK}C{resolve_links(names.states[state])[1:]}" if state else names.states[0]
