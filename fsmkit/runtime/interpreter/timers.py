"""Arming and cancelling the timers of states."""

from __future__ import annotations

from fsmkit.chart.chart import OPEN_ENDED
from fsmkit.document.document import Trigger
from fsmkit.runtime.interpreter.globals import Globals
from fsmkit.runtime.interpreter.snapshot import Chance, Delayed, Timeout, Timer


def arm(g: Globals, state: int) -> None:
    """Arm the ``after`` and ``every`` of a state that is being entered, in document order."""
    for transition in g.index.timed[state]:
        delay = transition.delay
        if transition.least is not None and isinstance(g.host, Chance):
            delay = g.host.delay(transition.least, delay)
        g.insert_timer(Timer(g.now + delay, Timeout(transition.index)))


def disarm(g: Globals, state: int) -> None:
    """Cancel the timers of a state that is being left: none of them fires any more."""
    for transition in g.index.timed[state]:
        timeout = Timeout(transition.index)
        g.timers = [timer for timer in g.timers if timer.what != timeout]


def rearm(g: Globals, timeout: Timeout) -> None:
    """Arm an ``every`` again, relative to its expired deadline."""
    transition = g.chart.transitions[timeout.transition]
    if transition.trigger is Trigger.EVERY:
        g.insert_timer(Timer(g.now + transition.delay, timeout))


def postpone(g: Globals, timeout: Timeout) -> bool:
    """Arm an interval without an end again: its transition is tried later."""
    transition = g.chart.transitions[timeout.transition]
    if not transition.is_open_ended:
        return False
    later = g.host.delay(0, OPEN_ENDED) if isinstance(g.host, Chance) else 0
    g.insert_timer(Timer(g.now + 1 + later, timeout))
    return True


def cancel(g: Globals, name: str) -> None:
    """Drop the pending delayed sends of an id (SCXML 6.3)."""
    g.timers = [
        timer
        for timer in g.timers
        if not (isinstance(timer.what, Delayed) and timer.what.id == name)
    ]


def pending_sends(g: Globals) -> int:
    """Return how many delayed sends wait."""
    return sum(isinstance(timer.what, Delayed) for timer in g.timers)
