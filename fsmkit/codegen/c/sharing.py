"""Regions whose byte holds the record of a history while the region is not active.

A parallel state's entry clears its deep history (`chart.histories`). Such a history is recorded
only while the regions of the parallel state are not active and their bytes would be 0. The byte
then holds ``RECORDED`` plus the number of the last active state.
"""

from __future__ import annotations

from fsmkit.document.document import Kind
from fsmkit.plan import Plan

RECORDED = 0x80


def shared_bytes(plan: Plan) -> dict[int, int]:
    """Return by region the history whose record its byte holds, the first if several do."""
    found: dict[int, int] = {}
    for parent, histories in enumerate(plan.forgotten):
        deep = [h for h in histories if plan.chart.states[h].kind is Kind.DEEP_HISTORY]
        for region in plan.inner[parent] if deep else ():
            if max(region.states) < RECORDED:
                found[region.index] = deep[0]
    return found


def number_of(byte: str) -> str:
    """Return the number of the deepest active state, 0 while the region is not active."""
    return f"{byte} < {RECORDED}u ? {byte} : 0u"
