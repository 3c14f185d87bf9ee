"""Which region keeps in its own byte what a history recorded of it, while it is not active.

A deep history of a parallel state that is forgotten when that is entered (`chart.histories`) holds
something exactly while the regions of the parallel state are not active, when their bytes would be
0. So such a byte holds ``RECORDED`` plus the number of what was active last.
"""

from __future__ import annotations

from fsmkit.document.document import Kind
from fsmkit.emit import Emitter
from fsmkit.plan import Plan

RECORDED = 0x80


def shared_bytes(plan: Plan) -> dict[int, int]:
    """Return by region the history whose record its byte holds; the first of several does so."""
    found: dict[int, int] = {}
    for parent, histories in enumerate(plan.forgotten):
        deep = [h for h in histories if plan.chart.states[h].kind is Kind.DEEP_HISTORY]
        for region in plan.inner[parent] if deep else ():
            if len(region.states) < RECORDED:
                found[region.index] = deep[0]
    return found


def number_of(byte: str) -> str:
    """Return the number of the deepest active state, 0 while the region is not active."""
    return f"{byte} < {RECORDED}u ? {byte} : 0u"


def record_of(byte: str) -> str:
    """Return the number of what was recorded, 0 while the region is active."""
    return f"{byte} > {RECORDED}u ? {byte} - {RECORDED}u : 0u"


def take_record(out: Emitter, byte: str, most: int) -> None:
    """Print how the record is read from a saved machine, after what is active."""
    with out.block("{"):
        out.line(f"const uint32_t was = fsm_take(r, 2u, 0u, {most}u);")
        out.line(f"if ({byte} == 0u && was != 0u)")
        out.line(f"    {byte} = (uint8_t)(was + {RECORDED}u);")
