"""What a sequence diagram shows, whatever it is drawn with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from fsmkit.emit import telling


class Way(Enum):
    """How a message travels."""

    DIRECT = "direct"
    VALUE = "value"
    """No event: an output, copied to an input."""
    QUEUED = "queued"
    DELAYED = "delayed"
    LOSSY = "lossy"


class Part(Enum):
    """What an arrow shows of the way of a message."""

    WHOLE = "whole"
    SENT = "sent"
    """It sets out, and arrives later."""
    ARRIVES = "arrives"
    LOST = "lost"


class Cause(Enum):
    """Why a machine moved."""

    START = "start"
    QUEUE = "queue"
    TIMEOUT = "timeout"
    OUTSIDE = "outside"
    ITSELF = "itself"
    """It left a state spontaneously, or an input let it."""


@dataclass(frozen=True, slots=True)
class Lifeline:
    """A machine; ``states`` before its first step are none."""

    name: str
    is_environment: bool = False


@dataclass(frozen=True, slots=True)
class Arrow:
    """A message. ``source`` and ``target`` are numbers of lifelines; None: what is outside."""

    source: int | None
    target: int | None
    text: str
    way: Way = Way.DIRECT
    part: Part = Part.WHOLE

    @property
    @telling
    def label(self) -> str:
        """The text, with how the message travels where it is not at once."""
        state = {Part.SENT: " (on its way)", Part.LOST: " (lost)", Part.ARRIVES: " (arrives)"}
        how = f" ({self.way.value})" if self.way not in (Way.DIRECT, Way.VALUE) else ""
        return f"{self.text}{state.get(self.part, how)}"


@dataclass(frozen=True, slots=True)
class Block:
    """A step of one machine.

    ``lifeline`` None: a message on its way arrives or is lost, and no machine moves. ``number``:
    of the step, from 1 on. ``at``: the time in words, empty where it does not count. ``is_shown``:
    whether the arrow just before is the cause. ``entered``: states
    entered, ``active`` all that are active after it. ``notes``: values that were chosen.
    """

    number: int
    at: str
    lifeline: int | None
    cause: Cause
    text: str
    is_shown: bool
    entered: tuple[str, ...]
    active: tuple[str, ...]
    notes: tuple[str, ...] = ()
    arrows: tuple[Arrow, ...] = ()

    @property
    def reason(self) -> tuple[str, ...]:
        """The cause in words, unless an arrow shows it."""
        is_shown = self.is_shown or self.cause in (Cause.START, Cause.OUTSIDE)
        return () if is_shown else (self.text,)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What stands at the lifeline: the cause unless an arrow shows it, states, notes."""
        entered = (", ".join(self.entered),) if self.entered else ()
        return (*self.reason, *entered, *self.notes)

    @property
    def look(self) -> tuple[object, ...]:
        """What makes two steps alike: all but number and time."""
        return (self.lifeline, self.cause, self.text, self.active, self.notes, self.arrows)


@dataclass(frozen=True, slots=True)
class Repeated:
    """Steps that repeat alike so many times; None: for ever. ``blocks`` are shown once."""

    blocks: tuple[Block, ...]
    times: int | None

    @property
    def heading(self) -> str:
        """The text above them."""
        return "for ever" if self.times is None else f"{self.times} times alike"


@dataclass(frozen=True, slots=True)
class Sequence:
    """A diagram. ``idle``: machines that never move, in words; ``end``: what is wrong at the end.

    ``violated``: the end is a violation; else what was to be reached.
    """

    title: str
    lifelines: tuple[Lifeline, ...]
    parts: tuple[Block | Repeated, ...]
    end: tuple[str, ...]
    violated: bool
    idle: tuple[str, ...] = ()

    @property
    def blocks(self) -> Iterator[Block]:
        """The steps that are shown."""
        for part in self.parts:
            yield from part.blocks if isinstance(part, Repeated) else (part,)

    @property
    def has_outside(self) -> bool:
        """Whether something comes from outside or leaves to it."""
        arrows = (arrow for block in self.blocks for arrow in block.arrows)
        return any(b.cause is Cause.OUTSIDE for b in self.blocks) or any(
            arrow.source is None or arrow.target is None for arrow in arrows
        )

    @property
    def ways(self) -> tuple[Way, ...]:
        """How messages travel here, for a legend."""
        used = {arrow.way for block in self.blocks for arrow in block.arrows}
        return tuple(way for way in Way if way in used)


LONGEST = 60
"""Steps of a part that is looked for to repeat."""
LEAST_SAVED = 4
"""Steps that folding must save."""


def folded(blocks: tuple[Block, ...]) -> tuple[Block | Repeated, ...]:
    """Return steps with those that repeat alike, one after another, shown once."""
    numbers: dict[tuple[object, ...], int] = {}
    looks = [numbers.setdefault(block.look, len(numbers)) for block in blocks]
    found: list[Block | Repeated] = []
    at = 0
    while at < len(blocks):
        saved, period = max(((_repeats(looks, at, n) - 1) * n, -n) for n in range(1, LONGEST + 1))
        period = -period
        if saved < LEAST_SAVED:
            found.append(blocks[at])
            at += 1
            continue
        times = saved // period + 1
        found.append(Repeated(blocks[at : at + period], times))
        at += saved + period
    return tuple(found)


def _repeats(looks: list[int], at: int, period: int) -> int:
    first, times = looks[at : at + period], 1
    while len(first) == period and looks[at + times * period :][:period] == first:
        times += 1
    return times
