"""The states that a machine can enter."""

from __future__ import annotations

from fsmkit.document.document import Trigger
from fsmkit.plan.operations import Branch, Enter, Op, Restore, Resume
from fsmkit.plan.plan import Plan


def entered(plan: Plan) -> frozenset[int]:
    """Return the states that a start, a transition or a history can enter."""
    found: set[int] = set()
    waiting: list[Op | Resume] = list(plan.start)
    for transition in plan.chart.transitions:
        if transition.trigger is not Trigger.INITIAL:
            for variant in plan.variants[transition.index]:
                waiting += variant.entry
    restored: set[Restore] = set()
    while waiting:
        op = waiting.pop()
        match op:
            case Enter(state):
                found.add(state)
            case Branch(_, recorded, unrecorded):
                waiting += (*recorded, *unrecorded)
            case Restore() if op not in restored:
                restored.add(op)
                waiting += plan.resumed(op)
            case Resume(_, _, cases):
                waiting += (each for _, ops in cases for each in ops)
            case _:
                pass
    return frozenset(found)
