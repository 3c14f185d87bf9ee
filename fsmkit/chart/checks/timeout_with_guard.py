"""``timeout-with-guard``: a timeout that is spent when its guards are false."""

from __future__ import annotations

from fsmkit.chart.analysis.exclusion import can_hold_together
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger


def check(chart: Chart, findings: Findings) -> None:
    """Report an ``after`` once, at its first transition, if all its guards can be false together.

    Other timeouts of the state with an equal delay expire at the same time, so their transitions
    count, too.
    """
    for state in chart.states:
        timeouts = [
            t
            for t in (chart.transitions[i] for i in state.transitions)
            if t.trigger is Trigger.AFTER and not t.is_open_ended
        ]
        for first in timeouts:
            if not first.has_timer:
                continue
            together = [t for t in timeouts if (t.least, t.delay) == (first.least, first.delay)]
            guards = [t.guard for t in together if t.guard is not None]
            if len(guards) < len(together):
                continue
            if can_hold_together(chart, [(guard, False) for guard in guards]):
                several = len(together) > 1
                findings.add(
                    "timeout-with-guard",
                    f"if {'all guards are' if several else 'the guard is'} false then, this "
                    f"timeout is spent until `{state.id}` is entered again",
                    first.span,
                    help="add an alternative for the other case to the list of this delay, or "
                    "use `every`",
                )
