"""The content of a sequence diagram, independent of its notation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from fsmkit.emit import telling


class Transport(Enum):
    """How a message travels."""

    DIRECT = "direct"
    VALUE = "value"
    """No event: an output, copied to an input."""
    QUEUED = "queued"
    DELAYED = "delayed"
    LOSSY = "lossy"


class Part(Enum):
    """The part of a message's transport that an arrow shows."""

    WHOLE = "whole"
    SENT = "sent"
    """It sets out, and arrives later."""
    ARRIVES = "arrives"
    LOST = "lost"


class Cause(Enum):
    """The reason why a machine moved."""

    START = "start"
    QUEUE = "queue"
    TIMEOUT = "timeout"
    OUTSIDE = "outside"
    ITSELF = "itself"
    """It left a state spontaneously, or an input let it."""


@dataclass(frozen=True, slots=True)
class Lifeline:
    """A machine; ``states`` are those before its first step."""

    name: str
    is_environment: bool = False


@dataclass(frozen=True, slots=True)
class Arrow:
    """A message. ``source`` and ``target`` are numbers of lifelines; None: the environment."""

    source: int | None
    target: int | None
    text: str
    transport: Transport = Transport.DIRECT
    part: Part = Part.WHOLE

    @property
    @telling
    def label(self) -> str:
        """The text, with the transport if it is not immediate."""
        state = {Part.SENT: " (in transit)", Part.LOST: " (lost)", Part.ARRIVES: " (arrives)"}
        how = (
            f" ({self.transport.value})"
            if self.transport not in (Transport.DIRECT, Transport.VALUE)
            else ""
        )
        return f"{self.text}{state.get(self.part, how)}"


@dataclass(frozen=True, slots=True)
class Block:
    """A step of one machine.

    ``lifeline`` None: a delayed message arrives or is lost, and no machine moves. ``number``: of
    the step, from 1. ``at``: the time in words, empty without time. ``is_shown``: whether the arrow
    just before is the cause. ``entered``: the entered states; ``active``: all active states after
    it. ``notes``: chosen values.
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
        """The text at the lifeline: the cause unless an arrow shows it, states, notes."""
        entered = (", ".join(self.entered),) if self.entered else ()
        return (*self.reason, *entered, *self.notes)

    @property
    def look(self) -> tuple[object, ...]:
        """The part that two equal steps have in common: all but number and time."""
        return (self.lifeline, self.cause, self.text, self.active, self.notes, self.arrows)


@dataclass(frozen=True, slots=True)
class Repetition:
    """Steps that repeat so many times; None: forever. ``blocks`` are shown once."""

    blocks: tuple[Block, ...]
    times: int | None

    @property
    def heading(self) -> str:
        """The text above them."""
        return "for ever" if self.times is None else f"{self.times} times alike"


@dataclass(frozen=True, slots=True)
class Sequence:
    """A diagram. ``idle``: machines that never move, in words; ``end``: the final remark.

    ``violated``: the end is a violation; otherwise it is the goal.
    """

    title: str
    lifelines: tuple[Lifeline, ...]
    parts: tuple[Block | Repetition, ...]
    end: tuple[str, ...]
    violated: bool
    idle: tuple[str, ...] = ()

    @property
    def blocks(self) -> Iterator[Block]:
        """The shown steps."""
        for part in self.parts:
            yield from part.blocks if isinstance(part, Repetition) else (part,)

    @property
    def has_outside(self) -> bool:
        """Whether there are messages from or to the environment."""
        arrows = (arrow for block in self.blocks for arrow in block.arrows)
        return any(b.cause is Cause.OUTSIDE for b in self.blocks) or any(
            arrow.source is None or arrow.target is None for arrow in arrows
        )

    @property
    def transports(self) -> tuple[Transport, ...]:
        """The kinds of transport in the diagram, for a legend."""
        used = {arrow.transport for block in self.blocks for arrow in block.arrows}
        return tuple(transport for transport in Transport if transport in used)


LONGEST = 60
"""Steps of a part that is looked for to repeat."""
LEAST_SAVED = 4
"""Steps that folding must save."""


def fold_repetitions(blocks: tuple[Block, ...]) -> tuple[Block | Repetition, ...]:
    """Return steps with equal successive steps shown once."""
    numbers: dict[tuple[object, ...], int] = {}
    looks = [numbers.setdefault(block.look, len(numbers)) for block in blocks]
    found: list[Block | Repetition] = []
    at = 0
    while at < len(blocks):
        saved, period = max(((_repeats(looks, at, n) - 1) * n, -n) for n in range(1, LONGEST + 1))
        period = -period
        if saved < LEAST_SAVED:
            found.append(blocks[at])
            at += 1
            continue
        times = saved // period + 1
        found.append(Repetition(blocks[at : at + period], times))
        at += saved + period
    return tuple(found)


def _repeats(looks: list[int], at: int, period: int) -> int:
    first, times = looks[at : at + period], 1
    while len(first) == period and looks[at + times * period :][:period] == first:
        times += 1
    return times
