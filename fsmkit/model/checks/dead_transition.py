"""``dead-transition``: an earlier transition of its state is always taken instead."""

from __future__ import annotations

from fsmkit.diagnostics import Findings
from fsmkit.expressions import Literal
from fsmkit.model.chart import Chart, Transition
from fsmkit.model.document import Origin, Trigger


def check(chart: Chart, findings: Findings) -> None:
    """Report transitions hidden by earlier ones without a guard."""
    for state in chart.states:
        earlier: list[Transition] = []
        for index in state.transitions:
            transition = chart.transitions[index]
            hiding = _hiding(transition, earlier)
            if hiding is not None:
                _report(transition, hiding, findings)
            if is_unguarded(transition):
                earlier.append(transition)


def is_unguarded(transition: Transition) -> bool:
    """Whether a transition is enabled whenever it is looked at."""
    guard = transition.guard
    return guard is None or (isinstance(guard, Literal) and guard.value is True)


def _hiding(transition: Transition, earlier: list[Transition]) -> Transition | None:
    """Return an unguarded transition that leaves this one no event."""
    if transition.trigger is Trigger.EVENTLESS:
        return next((t for t in earlier if t.trigger is Trigger.EVENTLESS), None)
    if transition.trigger is not Trigger.EVENT or not transition.events:
        return None
    hidden = {e for t in earlier if t.trigger is Trigger.EVENT for e in t.events}
    if not set(transition.events) <= hidden:
        return None
    return next(t for t in reversed(earlier) if set(t.events) & set(transition.events))


def _report(transition: Transition, hiding: Transition, findings: Findings) -> None:
    is_inherited = hiding.origin is not Origin.OWN and transition.origin is Origin.OWN
    findings.add(
        "dead-transition",
        "this transition is never taken: an earlier one has no guard",
        transition.span,
        secondary=[(hiding.span, "the earlier one, always taken")],
        help="mark it `first: true`, or override the inherited one"
        if is_inherited
        else "give the earlier one a guard, or swap the two",
    )
