"""Entry sets (Appendix D, computeEntrySet), computed at compile time.

Only the tests of histories and of their records are left to run time.
"""

from __future__ import annotations

from fsmkit.chart.chart import Chart, Transition
from fsmkit.document.document import Kind
from fsmkit.plan.operations import Branch, Enter, Op, Restore


def entries_below(chart: Chart, domain: int, targets: tuple[int, ...]) -> tuple[Op, ...]:
    """Return the operations that enter states strictly below a domain, in entry order.

    The domain is compound or the root.
    """
    return _inside(chart, domain, targets)[1]


def entry_by_default(chart: Chart, state: int) -> tuple[Op, ...]:
    """Return the entries of a state that has no targets below it."""
    return _enter(chart, state, ())


def _default(chart: Chart, state: int) -> Transition:
    initial = chart.states[state].initial
    assert initial is not None  # noqa: S101  (a chart is sound)
    return chart.transitions[initial]


def _enter(chart: Chart, state: int, targets: tuple[int, ...]) -> tuple[Op, ...]:
    """Return the entries of a state and of the targets below it, or of its default."""
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
    """Return the entries strictly below an active or just entered state.

    A history of that state that is a target decides all of them.
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
    """Return the child that is or contains a descendant, found upwards from the descendant."""
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
