"""The assumptions of a verdict on the environment of the explored system."""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.system.schedule import schedule_text
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT, ClosedSystem


def assumptions(closed: ClosedSystem) -> Iterator[str]:
    """Yield each assumption as a sentence."""
    most = MAX_PENDING_BEFORE_INPUT
    yield f"the environment posts an event only while at most {most} event is queued"
    if closed.silent:
        yield "transitions marked `watchdog` never fire"
    if closed.untimed:
        yield "an armed timer may fire at any time"
    if closed.system.schedule is not None:
        yield schedule_text(closed.system)
    for sample in closed.samples:
        yield f"{sample} takes sample values only"
