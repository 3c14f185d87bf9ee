"""What verdicts assume of the world around what was explored."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.system.schedule import spelled_schedule
from fsmkit.verify.statespace.closed_system import PATIENCE, Closed


def assumptions(closed: Closed) -> Iterator[str]:
    """Yield what is assumed, a sentence each."""
    yield f"what may come from outside comes while at most {PATIENCE} event waits in the queues"
    if closed.silent:
        yield "transitions marked `watchdog` never fire"
    if closed.untimed:
        yield "an armed timer may fire at any time"
    if closed.system.schedule is not None:
        yield spelled_schedule(closed.system)
    for sample in closed.samples:
        yield f"{sample} takes sample values only"
