"""``endless-loop``: eventless transitions without guards that lead back to themselves."""

from __future__ import annotations

from fsmkit.chart.analysis.reachability import entered
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.checks.dead_transition import is_unguarded
from fsmkit.chart.structure import lcca
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger

LONGEST = 100
"""States of a cycle: a longer one is not looked for."""


def check(chart: Chart, findings: Findings) -> None:
    """Report each cycle once, at its first transition in document order."""
    always = {s.index: t for s in chart.states if (t := _always(chart, s.index)) is not None}
    reported: set[int] = set()
    for start, first in always.items():
        cycle = _cycle(chart, always, start)
        if cycle is None or reported & set(cycle):
            continue
        reported |= set(cycle)
        names = " -> ".join(f"`{chart.states[s].id}`" for s in (*cycle, start))
        findings.add(
            "endless-loop",
            f"the machine never comes to rest: {names}",
            first.span,
            secondary=[(always[s].span, "and from here") for s in cycle[1:]],
            help="give one of these transitions an event or a guard",
        )


def _always(chart: Chart, state: int) -> Transition | None:
    """Return the transition a state is left by at once, whatever holds.

    None too where a descendant might be left by an eventless transition first.
    """
    last = chart.states[state].last_descendant
    for below in chart.states[state + 1 : last + 1]:
        if any(chart.transitions[t].trigger is Trigger.EVENTLESS for t in below.transitions):
            return None
    eventless = [
        t
        for t in (chart.transitions[i] for i in chart.states[state].transitions)
        if t.trigger is Trigger.EVENTLESS
    ]
    return eventless[0] if eventless and is_unguarded(eventless[0]) else None


def _cycle(chart: Chart, always: dict[int, Transition], start: int) -> list[int] | None:
    """Return the states passed on the way from a state back to it."""
    path = [start]
    while len(path) <= LONGEST:
        transition = always[path[-1]]
        if any(chart.states[t].is_history for t in transition.targets):
            return None
        if not transition.targets:
            return path if path == [start] else None
        domain = lcca(chart, (transition.source, *transition.targets))
        reached = entered(chart, transition.targets, domain)
        if start in reached:
            return path
        following = sorted(s for s in reached if s in always and s not in path)
        if not following:
            return None
        path.append(following[0])
    return None
