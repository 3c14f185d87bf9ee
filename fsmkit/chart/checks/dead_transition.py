"""``dead-transition``: an earlier transition of its state is always taken instead."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.chart.analysis.effects import can_fail
from fsmkit.chart.analysis.exclusion import Cases, exclude, possible_cases
from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import add_key
from fsmkit.document import keys
from fsmkit.document.document import Origin, Trigger
from fsmkit.language import Literal
from fsmkit.language.walk import calls

MOST_COMPARED = 100
"""A transition is compared with so many before it: a state with more would take for ever."""


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A transition, with the cases of its guard computed once for all comparisons."""

    transition: Transition
    holds: Cases | None = None
    """The cases in which the guard holds; None without a guard."""
    fails: Cases | None = None
    """The cases in which it does not hold; None if it may fail or call an operation."""


def check(chart: Chart, findings: Findings) -> None:
    """Report transitions hidden by earlier ones whose guards are weaker."""
    for transition, hiding in dead_transitions(chart):
        _report(transition, hiding, findings)


def dead_transitions(chart: Chart) -> Iterator[tuple[Transition, Transition]]:
    """Return each transition that is never taken, with an earlier one that is taken instead."""
    for state in chart.states:
        if len(state.transitions) < 2:
            continue
        leaving = [_candidate(chart, chart.transitions[index]) for index in state.transitions]
        for place, candidate in enumerate(leaving):
            hiding = _hiding(chart, candidate, leaving[max(0, place - MOST_COMPARED) : place])
            if hiding is not None:
                yield candidate.transition, hiding


def is_unguarded(transition: Transition) -> bool:
    """Whether a transition is enabled whenever its guard is evaluated."""
    guard = transition.guard
    return guard is None or (isinstance(guard, Literal) and guard.value is True)


def _candidate(chart: Chart, transition: Transition) -> _Candidate:
    guard = transition.guard
    if guard is None:
        return _Candidate(transition)
    is_certain = not (can_fail(guard) or calls(guard))
    return _Candidate(
        transition,
        possible_cases(chart, guard, holds=True),
        possible_cases(chart, guard, holds=False) if is_certain else None,
    )


def _hiding(chart: Chart, later: _Candidate, earlier: list[_Candidate]) -> Transition | None:
    """Return an earlier transition that is enabled whenever this one is."""
    transition = later.transition
    events = set(transition.events)
    is_timed = transition.timer is not None
    if not is_timed and transition.trigger is not (Trigger.EVENT if events else Trigger.EVENTLESS):
        return None
    winning = [
        other.transition
        for other in earlier
        if other.transition.trigger is transition.trigger
        and other.transition.timer == transition.timer
        and (not events or not events.isdisjoint(other.transition.events))
        and _is_weaker(chart, other, later)
    ]
    is_hidden = winning and events.issubset(e for t in winning for e in t.events)
    return winning[-1] if is_hidden else None


def _is_weaker(chart: Chart, earlier: _Candidate, later: _Candidate) -> bool:
    """Return whether the guard of the earlier holds whenever that of the later does."""
    if is_unguarded(earlier.transition):
        return True
    if later.holds is None or earlier.fails is None:
        return False
    return exclude(chart, later.holds, earlier.fails)


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
