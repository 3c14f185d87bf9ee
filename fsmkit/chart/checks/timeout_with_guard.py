"""``timeout-with-guard``: a timeout that is spent when its guard is false."""

from __future__ import annotations

from fsmkit.analysis.exclusion import are_complementary
from fsmkit.chart.chart import Chart, Transition
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger


def check(chart: Chart, findings: Findings) -> None:
    """Report a guarded ``after`` if nothing of the same delay covers the other case."""
    for state in chart.states:
        timeouts = [
            t
            for t in (chart.transitions[i] for i in state.transitions)
            if t.trigger is Trigger.AFTER and not t.is_open_ended
        ]
        for timeout in timeouts:
            if timeout.guard is not None and not any(
                _covers(chart, timeout, other) for other in timeouts if other is not timeout
            ):
                findings.add(
                    "timeout-with-guard",
                    f"if the guard is false then, this timeout is spent until `{state.id}` is "
                    "entered again",
                    timeout.span,
                    help="add an `after` of the same delay for the other case, or use `every`",
                )


def _covers(chart: Chart, timeout: Transition, other: Transition) -> bool:
    same = (other.least, other.delay) == (timeout.least, timeout.delay)
    if not same or timeout.guard is None:
        return False
    return other.guard is None or are_complementary(chart, timeout.guard, other.guard)
