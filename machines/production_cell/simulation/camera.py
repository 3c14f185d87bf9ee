"""The camera above the extraction belt: pictures, verdicts, and positions of the seen blocks.

A block is judged each time it passes, because it was moulded anew. The verdict depends only on the
seed, the block and the number of its passes, so runs can be compared.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

FRAME = 33
"""From picture to picture, in ms."""
GOOD, BAD, UNKNOWN = 1, 2, 3
SORTER = 1000
"""From the first slot to the sorter, in counts of the belt."""
WINDOW = 200
"""How near the sorter a block is to be there, in counts."""


@dataclass(frozen=True)
class Judgement:
    """How blocks are judged: shares of bad and of unreadable ones; latency in ms.

    ``drift``: by this share of it, what the estimator takes for the way of the belt is too long.
    """

    seed: int = 1
    bad: float = 0.05
    unreadable: float = 0.01
    latency: int = 120
    drift: float = 0.0

    def verdict(self, block: int, passed: int) -> int:
        """Return the verdict on a block that passes for the ``passed``-th time."""
        chance = random.Random(f"{self.seed}/{block}/{passed}").random()  # noqa: S311
        if chance < self.bad:
            return BAD
        return UNKNOWN if chance < self.bad + self.unreadable else GOOD


@dataclass(frozen=True)
class Sighting:
    """A block that was seen: where, and what the encoder of the belt said then; in counts."""

    block: int
    at: int
    encoder: int
    verdict: int


@dataclass(frozen=True)
class CameraState:
    """The last picture of the camera."""

    frames: int = 0
    block: int = 0
    verdict: int = 0
    since: int = 0
    """When the block came into view, in ms."""
    passed: tuple[tuple[int, int], ...] = ()
    """How often each block was seen."""
    sightings: tuple[Sighting, ...] = ()
    """The last sighting of each block that may still be on the belt."""


Detector = Callable[[int, int], int]
"""Finds the number of a block in its picture, made from number and position; 0: it is not found."""


def itself(block: int, position: int) -> int:
    """See every block for what it is."""
    del position
    return block


def picture(
    rule: Judgement,
    state: CameraState,
    now: int,
    view: tuple[int, int],
    encoder: int,
    detect: Detector = itself,
) -> CameraState:
    """Take a picture. ``view``: the block before the camera, or 0, and where, in 0.1 mm."""
    block, at = view
    state = replace(state, frames=state.frames + 1)
    if not block:
        return replace(state, block=0, verdict=0) if state.block else state
    found = detect(block, at)
    if not found:
        return state  # a picture in which nothing can be read says nothing
    if found != state.block:
        passed = dict(state.passed)
        passed[found] = passed.get(found, 0) + 1
        state = replace(
            state, block=found, verdict=0, since=now, passed=tuple(sorted(passed.items()))
        )
    verdict = state.verdict
    if now - state.since >= rule.latency:
        verdict = rule.verdict(found, dict(state.passed)[found])
    seen = Sighting(found, at, encoder, verdict)
    return replace(state, verdict=verdict, sightings=with_seen(state.sightings, seen, rule.drift))


class Estimate(NamedTuple):
    """The block before the sorter; all 0 for none."""

    block: int = 0
    verdict: int = 0
    """0 also of a block that left the view before it was judged."""

    @property
    def is_sighted(self) -> bool:
        """Whether it is known what to do with the block."""
        return self.verdict != 0

    @property
    def is_reject(self) -> bool:
        """Whether the block is to be pushed out."""
        return self.verdict in {BAD, UNKNOWN}


def where(sighting: Sighting, encoder: int, drift: float = 0.0) -> int:
    """Return where a block is by now, in counts from the first slot, if it was not taken away."""
    return sighting.at + round((encoder - sighting.encoder) * (1 + drift))


def with_seen(
    sightings: tuple[Sighting, ...], seen: Sighting, drift: float = 0.0
) -> tuple[Sighting, ...]:
    """Return the sightings with a new one, without those of blocks that are beyond the sorter."""
    others = (
        s
        for s in sightings
        if s.block != seen.block and where(s, seen.encoder, drift) < SORTER + WINDOW
    )
    return (*others, seen)


def at_sorter(sightings: tuple[Sighting, ...], encoder: int, drift: float = 0.0) -> Estimate:
    """Return which block is before the sorter.

    The camera does not see it there: this is estimated from its last sighting and the encoder.
    """
    for sighting in sightings:
        if abs(where(sighting, encoder, drift) - SORTER) <= WINDOW:
            return Estimate(sighting.block, sighting.verdict)
    return Estimate()
