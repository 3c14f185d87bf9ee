"""What a machine can enter at all."""

from __future__ import annotations

from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.entries import entry_by_default
from fsmkit.plan.operations import Branch, Enter, Restore
from fsmkit.plan.plan import Plan


def entered(plan: Plan) -> frozenset[int]:
    """Return the states that some start, transition or history can enter."""
    found: set[int] = set()
    chart = plan.chart
    waiting = list(plan.start)
    for transition in chart.transitions:
        if transition.trigger is not Trigger.INITIAL:
            for variant in plan.moves[transition.index].variants:
                waiting += variant.entry
    restored: set[Restore] = set()
    while waiting:
        op = waiting.pop()
        match op:
            case Enter(state):
                found.add(state)
            case Branch(_, recorded, unrecorded):
                waiting += (*recorded, *unrecorded)
            case Restore(history, below) if op not in restored:
                restored.add(op)
                if chart.states[history].kind is Kind.SHALLOW_HISTORY:
                    for child in chart.states[below].children:
                        if not chart.states[child].is_history:
                            waiting += entry_by_default(chart, child)
                else:
                    found |= set(range(below + 1, chart.states[below].last_descendant + 1))
            case _:
                pass
    return frozenset(found)
