"""What transitions and states have to do with each other, as far as it is known when compiling."""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.codegen.python.linking import LINK, spelt
from fsmkit.codegen.python.names import Names
from fsmkit.codegen.python.selection import has_regions
from fsmkit.document.document import Trigger
from fsmkit.emit.lines import one_line
from fsmkit.plan import Plan

LONG = 16
"""Of more states than these, what a transition leaves or enters is found when it is taken."""


def is_dynamic(plan: Plan, transition: Transition) -> bool:
    """Whether the domain of a transition depends on what a history holds."""
    return transition.trigger is not Trigger.INITIAL and not plan.moves[transition.index].is_static


def domain_of(plan: Plan, transition: Transition) -> int | None:
    """Return the domain of a transition, None for one without or whose domain is not known yet."""
    if transition.trigger is Trigger.INITIAL or is_dynamic(plan, transition):
        return None
    return plan.moves[transition.index].variants[0].domain


def real_children(chart: Chart, state: int) -> tuple[int, ...]:
    """Return the children without histories (getChildStates)."""
    return tuple(c for c in chart.states[state].children if not chart.states[c].is_history)


def real_below(chart: Chart, state: int) -> tuple[int, ...]:
    """Return the descendants without histories."""
    last = chart.states[state].last_descendant
    return tuple(s for s in range(state + 1, last + 1) if not chart.states[s].is_history)


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
    """Return for each transition those whose sources lie outside its own, and those it meets.

    Exit sets meet where one domain is the other or an ancestor of it: both are active and compound.
    """
    chart = plan.chart
    if not has_regions(chart):
        return {"OUTER": (), "CLASHES": ()}
    domains = [domain_of(plan, t) for t in chart.transitions]
    by_source = [0] * len(chart.states)
    by_domain = dict.fromkeys(sorted({d for d in domains if d is not None}), 0)
    for t, domain in zip(chart.transitions, domains, strict=True):
        by_source[t.source] |= 1 << t.index
        if domain is not None:
            by_domain[domain] |= 1 << t.index
    outer = _sums_above(chart, by_source)
    met = meeting(chart, by_domain)
    clashes = [0 if domain is None else met[domain] for domain in domains]
    return {"OUTER": tuple(outer[t.source] for t in chart.transitions), "CLASHES": tuple(clashes)}


def _sums_above(chart: Chart, sets: list[int]) -> list[int]:
    """Return for each state the union of the sets of its ancestors."""
    found = [0] * len(sets)
    for state in chart.states[1:]:
        assert state.parent is not None  # noqa: S101
        found[state.index] = found[state.parent] | sets[state.parent]
    return found


def meeting(chart: Chart, sets: dict[int, int]) -> dict[int, int]:
    """Return for each state the union of its set and those of its ancestors and descendants.

    ``sets`` has states in document order; those that are not there have none.
    """
    found = dict.fromkeys(sets, 0)
    open_: list[int] = []
    for state, own in sets.items():
        while open_ and not chart.is_descendant(state, open_[-1]):
            open_.pop()
        found[state] |= own
        for ancestor in open_:
            found[ancestor] |= own
            found[state] |= sets[ancestor]
        open_.append(state)
    return found


def configurations(chart: Chart, names: Names) -> dict[str, str]:
    """Return the constants of a chart without regions: what is active with a state innermost."""
    return {
        configuration(names, state.index): f"{configuration(names, state.parent)} | "
        + names.states[state.index]
        for state in chart.states
        if state.parent is not None and not state.is_history
    }


def configuration(names: Names, state: int) -> str:
    """Return the constant of a state: ``C_IDLE`` for ``S_IDLE``."""
    return f"{LINK}C{spelt(names.states[state])[1:]}" if state else names.states[0]
