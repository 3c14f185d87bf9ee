"""A session of an endurance run again, in the interpreter: its figures and its digest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import IntEnum

from fsmkit.chart.chart import Chart
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.trace import CLOCK
from fsmkit.runtime.script import Player, script_texts

BASIS, PRIME, MASK = 14695981039346656037, 1099511628211, 2**64 - 1
"""FNV-1a with 64 bits."""


class Note(IntEnum):
    """The content of the digest; as in endurance.c."""

    BEGAN_EVENT = 1
    BEGAN_TIMEOUT = 2
    BEGAN_START = 3
    BEGAN_EVENTLESS = 4
    EXITED = 5
    TAKEN = 6
    ENTERED = 7
    UNHANDLED = 8
    RAISED = 9
    SENT = 10
    LEFT = 11
    FULL = 12
    FAULTED = 13
    CALLED = 14


def replay(chart: Chart, script: Sequence[str]) -> dict[str, int]:
    """Return the figures that endurance.c prints of a session, by name."""
    player = Player(chart)
    found: Counter[str] = Counter()
    digest = BASIS
    for line in script_texts(script):
        for told in player.play(line):
            if isinstance(told, str):
                found["rejected"] += told == "full queue"
                continue
            _count(chart, told, found)
            for kind, value in _notes(chart, told):
                digest = ((digest ^ kind) * PRIME) & MASK
                for byte in value.to_bytes(4, "little"):
                    digest = ((digest ^ byte) * PRIME) & MASK
    return {"digest": digest, **found}


def _count(chart: Chart, done: snap.Macrostep, found: Counter[str]) -> None:
    found["fired"] += isinstance(done.event, snap.Timeout)
    if isinstance(done.event, snap.Occurrence):
        found["taken"] += any(m.event is done.event and m.transitions for m in done.microsteps)
    is_first = isinstance(done.event, snap.Occurrence)
    for effect in done.effects:
        match effect:
            case snap.Unhandled(event):
                own = (
                    is_first
                    and isinstance(done.event, snap.Occurrence)
                    and event == done.event.event
                )
                found["unhandled" if own else "unhandled_raised"] += 1
                is_first = False
            case snap.Taken():
                found["transitions"] += 1
                is_first = False
            case snap.Called():
                found["operations"] += 1
            case snap.Deferred():
                found["deferrals"] += 1
                is_first = False
            case snap.Overflowed("queue"):
                found["rejected"] += 1
            case snap.Faulted():
                found["faults"] += 1
            case _:
                pass
    del chart


def _notes(chart: Chart, done: snap.Macrostep) -> Iterator[tuple[Note, int]]:
    match done.event:
        case snap.Occurrence(event):
            yield Note.BEGAN_EVENT, event + 1
        case snap.Timeout(transition):
            yield Note.BEGAN_TIMEOUT, transition
        case snap.Start():
            yield Note.BEGAN_START, done.at % CLOCK
        case None:
            yield Note.BEGAN_EVENTLESS, done.at % CLOCK
        case _:
            pass
    operations = {operation.name: n for n, operation in enumerate(chart.operations)}
    for effect in done.effects:
        found = _note(effect, operations)
        if found is not None:
            yield found


def _note(effect: snap.Effect, operations: dict[str, int]) -> tuple[Note, int] | None:
    match effect:
        case snap.Exited(state):
            return Note.EXITED, state
        case snap.Taken(transition):
            return Note.TAKEN, transition
        case snap.Entered(state):
            return Note.ENTERED, state
        case snap.Unhandled(event):
            return Note.UNHANDLED, event + 1
        case snap.Raised(occurrence):
            return Note.RAISED, occurrence.event + 1
        case snap.Sent(occurrence):
            return Note.SENT, occurrence.event + 1
        case snap.Emitted(occurrence):
            return Note.LEFT, occurrence.event + 1
        case snap.Overflowed():
            return Note.FULL, 0
        case snap.Faulted():
            return Note.FAULTED, 0
        case snap.Called(operation):
            return Note.CALLED, operations[operation]
        case _:
            return None
