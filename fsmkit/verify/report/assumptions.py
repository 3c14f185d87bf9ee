"""What verdicts assume of the world around what was explored."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.system.schedule import spelled_schedule
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT, ClosedSystem


def assumptions(closed: ClosedSystem) -> Iterator[str]:
    """Yield what is assumed, a sentence each."""
    most = MAX_PENDING_BEFORE_INPUT
    yield f"what may come from outside comes while at most {most} event waits in the queues"
    if closed.silent:
        yield "transitions marked `watchdog` never fire"
    if closed.untimed:
        yield "an armed timer may fire at any time"
    if closed.system.schedule is not None:
        yield spelled_schedule(closed.system)
    for sample in closed.samples:
        yield f"{sample} takes sample values only"
