"""Composite states drawn as one box: their inner states are omitted.

The resulting chart is for drawings only. States and transitions keep their numbers. A folded state
has no children. A transition from or to an inner state starts or ends at the border. A transition
within the state is on no list and has no target.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.document.document import Kind, Trigger

COMPOSITE = (Kind.COMPOUND, Kind.PARALLEL)
MOST_UNFOLDED = 300
"""States of a chart that opens unfolded."""
MOST_OPENED = 100
"""Boxes that a larger chart has when it opens, if it can be folded so far."""


def composites(chart: Chart) -> frozenset[int]:
    """Return the states that can be folded: all with states in them but the root."""
    return frozenset(state.index for state in chart.states[1:] if state.kind in COMPOSITE)


def opening_folds(chart: Chart) -> frozenset[int]:
    """Return the states that are folded when a chart is first shown: none of a small chart.

    A large chart opens with its outer states. Whole levels are unfolded while few boxes are drawn.
    """
    if len(chart.states) - 1 <= MOST_UNFOLDED:
        return frozenset()
    folded = [s.index for s in chart.states[1:] if s.parent == 0 and s.kind in COMPOSITE]
    count = len(chart.states[0].children)
    while folded:
        inner = [child for state in folded for child in chart.states[state].children]
        if count + len(inner) > MOST_OPENED:
            break
        count += len(inner)
        folded = [child for child in inner if chart.states[child].kind in COMPOSITE]
    return frozenset(folded)


def is_box(state: State) -> bool:
    """Whether a state of a chart that is drawn has states in it that are not."""
    return state.kind in COMPOSITE and not state.children


def shown(chart: Chart, folded: Collection[int] = ()) -> frozenset[int]:
    """Return the states that are drawn if some are folded, the root among them."""
    found, waiting = set[int](), [0]
    while waiting:
        state = waiting.pop()
        found.add(state)
        if state not in folded:
            waiting += chart.states[state].children
    return frozenset(found)


def boxed(chart: Chart, states: Iterable[int]) -> Chart:
    """Return a chart to be drawn, in which composite states are folded."""
    wanted = frozenset(states) & composites(chart)
    if not wanted:
        return chart
    ends = _ends(chart, wanted)
    hidden = {index for index, end in enumerate(ends) if index != end}
    closed = hidden | wanted
    transitions = tuple(_moved(each, ends, closed) for each in chart.transitions)
    lists: list[list[int]] = [[] for _ in chart.states]
    for state in chart.states:
        lists[ends[state.index]] += (
            t for t in state.transitions if state.index not in hidden or transitions[t].targets
        )
    made = (
        replace(
            state,
            children=() if state.index in closed else state.children,
            initial=None if state.index in closed else state.initial,
            transitions=tuple(lists[state.index]),
        )
        for state in chart.states
    )
    return replace(chart, states=tuple(made), transitions=transitions)


def _ends(chart: Chart, folded: frozenset[int]) -> list[int]:
    """Return for each state that at which its arrows end: the outermost folded one around it."""
    ends = [0] * len(chart.states)
    for state in chart.states[1:]:
        above = ends[state.parent or 0]
        ends[state.index] = above if above in folded else state.index
    return ends


def _moved(transition: Transition, ends: list[int], closed: set[int]) -> Transition:
    """Return a transition between the ends; one that stays within a folded state has no target."""
    source = ends[transition.source]
    targets = tuple(dict.fromkeys(ends[target] for target in transition.targets))
    is_inner = source != transition.source or transition.trigger is Trigger.INITIAL
    if is_inner and source in closed and set(targets) <= {source}:
        targets = ()
    if transition.trigger is Trigger.INITIAL and transition.source in closed:
        targets = ()
    return replace(transition, source=source, targets=targets)
