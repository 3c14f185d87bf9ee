"""``deferred-elsewhere``: a transition on an event that a state of another region defers."""

from __future__ import annotations

from fsmkit.chart.analysis.reachability import reachable_states
from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Kind


def check(chart: Chart, findings: Findings) -> None:
    """Report each transition once, with the first state that defers its event."""
    deferring = [state for state in chart.states if state.defer]
    if not deferring:
        return
    reached = reachable_states(chart)
    deferring = [state for state in deferring if state.index in reached]
    for transition in chart.transitions:
        if transition.source not in reached:
            continue
        for state in deferring:
            event = next((e for e in transition.events if _defers(chart, state, e)), None)
            if event is not None and _is_beside(chart, state, transition):
                name = chart.events[event].name
                findings.add(
                    "deferred-elsewhere",
                    f"while `{state.id}`, in another region, is active, it defers `{name}`: "
                    "then no region takes it",
                    transition.span,
                    secondary=[(state.span, f"`{name}` is deferred here")],
                    help="defer it in the parallel state around both, or give the regions "
                    "events of their own",
                )
                break


def _defers(chart: Chart, state: State, event: int) -> bool:
    """Whether a state defers an event on which it has no transition that is always enabled."""
    own = (chart.transitions[index] for index in state.transitions)
    is_taken = any(t.guard is None and event in t.events for t in own)
    return event in state.defer and not is_taken


def _is_beside(chart: Chart, state: State, transition: Transition) -> bool:
    """Whether a state and the source of a transition lie in different regions."""
    source = transition.source
    above = {state.index, *chart.ancestors(state.index)}
    meeting = next(s for s in (source, *chart.ancestors(source)) if s in above)
    return meeting not in (state.index, source) and chart.states[meeting].kind is Kind.PARALLEL
