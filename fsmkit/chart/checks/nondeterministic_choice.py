"""``nondeterministic-choice``: an event or timeout can enable two transitions of one state."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.chart.analysis.exclusion import are_exclusive, implies
from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.checks.dead_transition import MOST_COMPARED
from fsmkit.diagnostics import Findings
from fsmkit.diagnostics.fixes import add_key
from fsmkit.document import keys
from fsmkit.document.document import Kind, Trigger


def check(chart: Chart, findings: Findings) -> None:
    """Report overlapping guards of transitions that are not marked as ordered.

    A special case before the general one, whose guard it implies (or which has none), is the usual
    way to say "otherwise"; the alternatives of a choice are read in order. Neither is reported.
    """
    for state in chart.states:
        if state.kind is Kind.CHOICE:
            continue
        leaving = [chart.transitions[i] for i in state.transitions]
        for earlier, later in neighbours(leaving):
            if _overlap(chart, earlier, later):
                findings.add(
                    "nondeterministic-choice",
                    f"both guards can hold at once in `{state.id}`; the earlier one wins",
                    later.span,
                    secondary=[(earlier.span, "the earlier one")],
                    help="make the guards exclude each other, or mark the order as intended: "
                    "`ordered: true`",
                    fixes=add_key(later.span, "ordered", "true", keys.LABELLED),
                )


def neighbours(leaving: list[Transition]) -> Iterator[tuple[Transition, Transition]]:
    """Return pairs of transitions of a state; each with those near enough after it."""
    for place, earlier in enumerate(leaving):
        for later in leaving[place + 1 : place + 1 + MOST_COMPARED]:
            yield earlier, later


def _overlap(chart: Chart, earlier: Transition, later: Transition) -> bool:
    if earlier.guard is None or later.guard is None or earlier.ordered or later.ordered:
        return False
    if earlier.trigger is not later.trigger:
        return False
    if _effect(earlier) == _effect(later):
        return False
    match earlier.trigger:
        case Trigger.EVENT:
            if not set(earlier.events) & set(later.events):
                return False
        case Trigger.EVENTLESS:
            pass
        case _:
            if earlier.timer is None or earlier.timer != later.timer:
                return False
    return not (
        are_exclusive(chart, earlier.guard, later.guard)
        or implies(chart, earlier.guard, later.guard)
        or implies(chart, later.guard, earlier.guard)  # that is a `dead-transition`
    )


def _effect(transition: Transition) -> object:
    return transition.targets, transition.content, transition.internal
