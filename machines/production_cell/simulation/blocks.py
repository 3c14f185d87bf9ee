"""Blocks in the ring: pushed, carried by magnets, moved by belts, thrown out by the sorter.

A block is on a belt, in the lane of the feeder, in a hand, or gone. Lengths are in m; positions of
axes are in counts, as in the charts. Hazards are reported by name; nothing prevents them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from .axes import ANGULAR, LINEAR
from .signals import EXTRACTION_BELT, EXTRACTOR, FEEDER, FEEDER_BELT, MOLDER, ROTATOR

LENGTH = 0.04
"""The length of a block."""
PITCH = 0.1
"""From slot to slot of a belt."""
END = {FEEDER_BELT: PITCH + 0.04, EXTRACTION_BELT: 2 * PITCH + 0.04}
"""Beyond it a block falls off."""
CONTACT, CAVITY = 0.06, 0.22
"""Where the feeder meets a block in the pocket; from the pocket to the cavity."""
ARM = 0.3
"""Radius at which an arm carries a block."""
OFFSET = 100
PICK = {EXTRACTOR: 2600, ROTATOR: 3100}
REACH = 40
"""How exactly a hand must be over a block, in counts."""
DROP = {EXTRACTOR: EXTRACTION_BELT, ROTATOR: FEEDER_BELT}
"""The belt on which a robot lays down."""
NEAR = 0.015
"""How exactly a block must lie to be taken by a magnet, or pushed by the feeder."""


class Where(Enum):
    """The holder of a block."""

    BELT = "belt"
    LANE = "lane"
    """Between pocket (0) and cavity."""
    HAND = "hand"
    GONE = "gone"


@dataclass(frozen=True, slots=True)
class Block:
    """A block: what holds it, which belt or robot that is, and where on it, in m."""

    number: int
    where: Where
    holder: int
    at: float
    mass: float
    """In kg."""
    moulded: int = 0
    """How often."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a block, or must not have happened."""

    kind: str
    block: int = 0
    detail: str = ""


COLLISIONS = frozenset(
    {
        "two_blocks", "dropped", "drop_on_occupied", "off_the_end", "feeder_against_door",
        "feeder_beside_block", "door_against_arm", "arm_against_feeder", "belt_under_arm",
        "sorter_in_the_way", "hand_under_arm", "end_stop",
    }
)  # fmt: skip
"""Events that must not happen."""
LOSSES = frozenset({"dropped", "drop_on_occupied", "off_the_end", "taken_away"})
"""Events after which a block is no longer in the ring, though nobody threw it out."""


def belt_moved(blocks: tuple[Block, ...], belt: int, way: float) -> tuple[Block, ...]:
    """Return the blocks after a belt moved by so much."""
    return tuple(
        replace(b, at=b.at + way) if b.where is Where.BELT and b.holder == belt else b
        for b in blocks
    )


def fallen(blocks: tuple[Block, ...]) -> Iterator[tuple[Block, Event]]:
    """Yield the blocks that are beyond the end of their belt."""
    for block in blocks:
        if block.where is Where.BELT and not -0.06 < block.at < END[block.holder]:
            yield block, Event("off_the_end", block.number)


def pushed(block: Block, feeder: float) -> tuple[Block, Event | None]:
    """Return a block with the feeder at a position, in m."""
    front = feeder - CONTACT
    if block.where is Where.LANE:
        was_in = block.at > CAVITY - 0.01
        block = replace(block, at=max(block.at, front))
        if not was_in and block.at > CAVITY - 0.01:
            block = replace(block, moulded=block.moulded + 1)
            return block, Event("moulded", block.number)
    elif block.where is Where.BELT and block.holder == FEEDER_BELT and front > 0:
        aside = abs(block.at - PITCH)
        if aside <= NEAR:
            return replace(block, where=Where.LANE, at=front), None
        if aside < LENGTH:
            return block, Event("feeder_beside_block", block.number)
    return block, None


def is_in_reach(block: Block, robot: int, angle: float) -> bool:
    """Whether the hand of a robot is over a block. ``angle`` in counts."""
    if abs(angle - PICK[robot]) > REACH:
        return False
    if robot == EXTRACTOR:
        return block.where is Where.LANE and abs(block.at - CAVITY) < NEAR
    return (
        block.where is Where.BELT
        and block.holder == EXTRACTION_BELT
        and abs(block.at - 2 * PITCH) < NEAR
    )


def taken(blocks: tuple[Block, ...], robot: int, angle: float) -> tuple[Block, ...]:
    """Return the blocks after the magnet of an empty hand is on."""
    if any(b.where is Where.HAND and b.holder == robot for b in blocks):
        return blocks
    return tuple(
        replace(b, where=Where.HAND, holder=robot, at=0.0) if is_in_reach(b, robot, angle) else b
        for b in blocks
    )


def released(
    blocks: tuple[Block, ...], robot: int, angle: float, error: float
) -> tuple[tuple[Block, ...], Event | None]:
    """Return the blocks after the magnet of a hand is off. ``error``: by how many m it misses."""
    held = next((b for b in blocks if b.where is Where.HAND and b.holder == robot), None)
    if held is None:
        return blocks, None
    others = tuple(b for b in blocks if b is not held)
    if abs(angle - OFFSET) <= REACH:
        belt, at = DROP[robot], (angle - OFFSET) * ANGULAR * ARM + error
        for other in others:
            if other.where is Where.BELT and other.holder == belt and abs(other.at - at) < LENGTH:
                gone = replace(held, where=Where.GONE)
                return (*others, gone), Event("drop_on_occupied", held.number)
        return (*others, replace(held, where=Where.BELT, holder=belt, at=at)), None
    return (*others, replace(held, where=Where.GONE)), Event("dropped", held.number)


def is_out_of_sight(block: Block) -> bool:
    """Whether a block was left on the way to the cavity: unseen, or out of reach of the hand."""
    return block.where is Where.LANE and 0.02 < block.at < CAVITY - NEAR


def crowded(blocks: tuple[Block, ...]) -> Iterator[Event]:
    """Yield pairs of blocks that are in one place."""
    for index, one in enumerate(blocks):
        for other in blocks[index + 1 :]:
            if (
                one.where is other.where
                and one.where in {Where.BELT, Where.LANE}
                and one.holder == other.holder
                and abs(one.at - other.at) < LENGTH - 0.002
            ):
                yield Event("two_blocks", one.number, f"with block {other.number}")


def seen_at(block: Block, arms: Mapping[int, float]) -> tuple[int, float] | None:
    """Return on which belt a sensor can see a block, and where; or the lane, as `FEEDER`.

    A block in a hand is seen where the hand is over a belt or in the mould.
    """
    match block.where:
        case Where.BELT:
            return block.holder, block.at
        case Where.LANE:
            return FEEDER, block.at
        case Where.HAND:
            angle = arms[block.holder]
            aside = (angle - OFFSET) * ANGULAR * ARM
            if abs(aside) < LENGTH:
                return DROP[block.holder], aside
            aside = (angle - PICK[block.holder]) * ANGULAR * ARM
            if abs(aside) > LENGTH:
                return None  # it swings in an arc, away from all sensors
            if block.holder == EXTRACTOR:
                return FEEDER, CAVITY + aside
            return EXTRACTION_BELT, 2 * PITCH + aside
        case Where.GONE:
            return None


def slot_of(block: Block) -> str:
    """Return the slot that a block is nearest to; empty if it is gone."""
    match block.where:
        case Where.BELT if block.holder == FEEDER_BELT:
            return "f0" if block.at < PITCH / 2 else "p"
        case Where.BELT:
            return f"e{min(2, max(0, round(block.at / PITCH)))}"
        case Where.LANE:
            return "p" if block.at < CAVITY / 2 else "m"
        case Where.HAND:
            return "x" if block.holder == EXTRACTOR else "r"
        case Where.GONE:
            return ""


def hazards(at: tuple[float, ...], speed: tuple[float, ...], sorter: float) -> tuple[str, ...]:
    """Return which axes are in each other's way now, whether or not a block is there.

    ``at``: positions of the axes in counts, ``speed`` in counts a second, ``sorter`` 0 (in) to 1.
    """
    found = []
    feeder = at[FEEDER] * LINEAR
    if feeder > CAVITY - 0.02 and at[MOLDER] > 150:
        found.append("feeder_against_door")
    if at[EXTRACTOR] > 2000 and at[MOLDER] < 1400:
        found.append("door_against_arm")
    if at[EXTRACTOR] > 2000 and feeder > CAVITY - 0.02:
        found.append("arm_against_feeder")
    if abs(speed[FEEDER_BELT]) > 100 and at[ROTATOR] < 400:
        found.append("belt_under_arm")
    if abs(speed[EXTRACTION_BELT]) > 100:
        if at[EXTRACTOR] < 400 or at[ROTATOR] > PICK[ROTATOR] - 400:
            found.append("belt_under_arm")
        if sorter > 0.1:
            found.append("sorter_in_the_way")
    return tuple(found)
