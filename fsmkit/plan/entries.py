"""Entry sets: Appendix D, computeEntrySet, carried out when compiling.

Only whether a history is recorded, and what it holds, is left to be tested at run time.
"""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Kind
from fsmkit.plan.operations import Branch, Enter, Op, Restore


def entries_below(chart: Chart, domain: int, targets: tuple[int, ...]) -> tuple[Op, ...]:
    """Return what is entered strictly below a domain (compound or the root), in entry order."""
    return _inside(chart, domain, targets)[1]


def entry_by_default(chart: Chart, state: int) -> tuple[Op, ...]:
    """Return what entering a state enters if nothing below it is a target."""
    return _enter(chart, state, ())


def _default(chart: Chart, state: int) -> Transition:
    initial = chart.states[state].initial
    assert initial is not None  # noqa: S101  (a chart is sound)
    return chart.transitions[initial]


def _enter(chart: Chart, state: int, targets: tuple[int, ...]) -> tuple[Op, ...]:
    """Return how to enter a state and, below it, the targets that lie there, else the default."""
    below = tuple(t for t in targets if chart.is_descendant(t, state))
    kind = chart.states[state].kind
    if kind is Kind.COMPOUND and not below:
        initial = _default(chart, state)
        content = (initial.index,) if initial.content else ()
        return _with(chart, state, content, initial.targets)
    if kind in (Kind.COMPOUND, Kind.PARALLEL):
        return _with(chart, state, (), below)
    return (Enter(state),)


def _with(
    chart: Chart, state: int, content: tuple[int, ...], targets: tuple[int, ...]
) -> tuple[Op, ...]:
    history, inside = _inside(chart, state, targets)
    if history is None:
        return (Enter(state, content), *inside)
    (branch,) = inside
    assert isinstance(branch, Branch)  # noqa: S101
    default = _default(chart, history)
    # its content comes after the handlers of its parent, and only if that is entered (Appendix D)
    both = (*content, *((default.index,) if default.content else ()))
    return (
        Branch(
            history,
            (Enter(state, content), *branch.recorded),
            (Enter(state, both), *branch.unrecorded),
        ),
    )


def _inside(
    chart: Chart, state: int, targets: tuple[int, ...]
) -> tuple[int | None, tuple[Op, ...]]:
    """Return what is entered strictly below an active or just entered state.

    And the history of that very state, where one is a target: it decides all of it.
    """
    history = next((t for t in targets if _is_history_of(chart, t, state)), None)
    if history is not None:
        return history, (_history(chart, state, history, targets),)
    if chart.states[state].kind is Kind.PARALLEL:
        children = [c for c in chart.states[state].children if not chart.states[c].is_history]
        return None, tuple(op for child in children for op in _enter(chart, child, targets))
    towards = [_child_towards(chart, state, t) for t in targets if chart.is_descendant(t, state)]
    return None, _enter(chart, min(towards), targets) if towards else ()


def _child_towards(chart: Chart, state: int, descendant: int) -> int:
    """Return the child of a state that is or holds a descendant; without looking at all of them."""
    child = descendant
    while (parent := chart.states[child].parent) != state:
        assert parent is not None  # noqa: S101
        child = parent
    return child


def _is_history_of(chart: Chart, target: int, state: int) -> bool:
    return chart.states[target].is_history and chart.states[target].parent == state


def _history(chart: Chart, state: int, history: int, targets: tuple[int, ...]) -> Branch:
    rest = tuple(t for t in targets if t != history)
    is_shallow = chart.states[history].kind is Kind.SHALLOW_HISTORY
    if is_shallow and chart.states[state].kind is Kind.PARALLEL:
        recorded = _inside(chart, state, rest)[1]  # all its regions, each by default
    else:
        recorded = (Restore(history, state),)
    default = _default(chart, history).targets
    return Branch(history, recorded, _inside(chart, state, (*default, *rest))[1])
