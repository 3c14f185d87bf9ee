"""``dead-transition``: an earlier transition of its state is always taken instead."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.analysis.exclusion import implies
from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import add_key
from fsmkit.document import keys
from fsmkit.document.document import Origin, Trigger
from fsmkit.language import Literal
from fsmkit.language.walk import calls

MOST_COMPARED = 100
"""A transition is compared with so many before it: a state with more would take for ever."""


def check(chart: Chart, findings: Findings) -> None:
    """Report transitions hidden by earlier ones whose guards are weaker."""
    for transition, hiding in dead_transitions(chart):
        _report(transition, hiding, findings)


def dead_transitions(chart: Chart) -> Iterator[tuple[Transition, Transition]]:
    """Return each transition that is never taken, with an earlier one that is taken instead."""
    for state in chart.states:
        leaving = [chart.transitions[index] for index in state.transitions]
        for place, transition in enumerate(leaving):
            hiding = _hiding(chart, transition, leaving[max(0, place - MOST_COMPARED) : place])
            if hiding is not None:
                yield transition, hiding


def is_unguarded(transition: Transition) -> bool:
    """Whether a transition is enabled whenever it is looked at."""
    guard = transition.guard
    return guard is None or (isinstance(guard, Literal) and guard.value is True)


def _hiding(chart: Chart, transition: Transition, earlier: list[Transition]) -> Transition | None:
    """Return an earlier transition that is enabled whenever this one is."""
    events = set(transition.events)
    is_timed = transition.timer is not None
    if not is_timed and transition.trigger is not (Trigger.EVENT if events else Trigger.EVENTLESS):
        return None
    rivals = (t for t in earlier if t.trigger is transition.trigger and t.timer == transition.timer)
    same = (t for t in rivals if not events or not events.isdisjoint(t.events))
    winning = [t for t in same if _is_weaker(chart, t, transition)]
    is_hidden = winning and events.issubset(e for t in winning for e in t.events)
    return winning[-1] if is_hidden else None


def _is_weaker(chart: Chart, earlier: Transition, later: Transition) -> bool:
    """Whether the guard of the earlier holds whenever that of the later does."""
    if is_unguarded(earlier) or earlier.guard is None:
        return True
    if later.guard is None or can_fail(earlier.guard) or calls(earlier.guard):
        return False
    return implies(chart, later.guard, earlier.guard)


def _report(transition: Transition, hiding: Transition, findings: Findings) -> None:
    is_inherited = hiding.origin is not Origin.OWN and transition.origin is Origin.OWN
    findings.add(
        "dead-transition",
        "this transition is never taken: an earlier one is taken whenever it could be",
        transition.span,
        secondary=[(hiding.span, "the earlier one")],
        help="mark it `first: true`, or override the inherited one"
        if is_inherited
        else "narrow the guard of the earlier one, or swap the two",
        fixes=add_key(transition.span, "first", "true", keys.LABELLED) if is_inherited else (),
    )
