"""The states that transitions can enter, ignoring guards and events."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind


def reachable_states(chart: Chart) -> frozenset[int]:
    """Return the states that some sequence of transitions enters; an upper bound."""
    reached: set[int] = set()
    by_default: set[int] = set()
    """Those of them whose default entry, or all of whose regions, have been looked at."""
    pending = [0]
    while pending:
        index = pending.pop()
        if index in by_default:
            continue
        by_default.add(index)
        pending += _by_default(chart, index)
        above: int | None = index
        while above is not None and above not in reached:
            reached.add(above)
            around = chart.states[above]
            if around.kind is Kind.PARALLEL:
                pending.append(above)
            for transition in around.transitions:
                pending += chart.transitions[transition].targets
            above = around.parent
    return frozenset(reached)


def _by_default(chart: Chart, index: int) -> list[int]:
    """Return the targets of the initial transition of a state, or all of its regions."""
    state = chart.states[index]
    found = [] if state.initial is None else list(chart.transitions[state.initial].targets)
    if state.kind is Kind.PARALLEL:
        found += [c for c in state.children if not chart.states[c].is_history]
    return found


def entered(chart: Chart, targets: Iterable[int], domain: int | None = None) -> frozenset[int]:
    """Return every state that entering the targets can make active, default entry included.

    Given the ``domain`` of the transition, which lies above all targets: only the states below it.
    The domain and all around it stay active (SCXML Appendix D, exitStates), so none of it is
    looked at. A history adds its default; what it remembers has been entered before (SCXML 3.10).
    """
    found: set[int] = set()
    pending = list(targets)
    while pending:
        index = pending.pop()
        if index in found:
            continue
        found.add(index)
        pending += _by_default(chart, index)
        above = chart.states[index].parent
        while above is not None and above != domain and above not in found:
            if chart.states[above].kind is Kind.PARALLEL:
                pending.append(above)
            else:
                found.add(above)
            above = chart.states[above].parent
    return frozenset(found)
