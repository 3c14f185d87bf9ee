"""Where the lifelines of a sequence diagram stand, and how its texts are broken into lines."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from fsmkit.diagram.sequences.model import Block, Cause, Sequence

CHARACTER, LINE = 6.3, 14.0
"""Width and height of a character; the width fits a wide sans serif."""
TIME = 64.0
"""Width of the column of times."""
LEAST_GAP, MOST_GAP = 96.0, 270.0
"""Distance of two lifelines."""
BOX_WIDTH = 26
"""Characters of a line in a box."""
MOST_LINES = 4
"""Lines of one text; what is longer is cut."""
PADDING = 12.0


@dataclass(frozen=True, slots=True)
class Box:
    """What stands on a lifeline at a step: why it moved, and the states that it entered."""

    soft: tuple[str, ...]
    strong: tuple[str, ...]

    @property
    def width(self) -> float:
        """Width with its margins."""
        longest = max((len(line) for line in (*self.soft, *self.strong)), default=0)
        return longest * CHARACTER + PADDING

    @property
    def height(self) -> float:
        """Height with its margins."""
        lines = len(self.soft) + len(self.strong)
        return lines * LINE + 7 if lines else 14


def box_of(block: Block) -> Box:
    """Return the box of a step; an empty one where the arrow before it tells everything."""
    untold = not block.told and block.cause not in (Cause.START, Cause.OUTSIDE)
    soft = wrapped(block.text, BOX_WIDTH) if untold else []
    for note in block.notes:
        soft += wrapped(note, BOX_WIDTH)
    return Box(tuple(soft), tuple(wrapped(", ".join(block.entered), BOX_WIDTH)))


def wrapped(text: str, width: int) -> list[str]:
    """Return a text as lines, at most `MOST_LINES` of them."""
    clean = "".join(c if c.isprintable() else " " for c in text)
    lines = textwrap.wrap(clean, max(6, width), break_on_hyphens=False)
    if len(lines) > MOST_LINES:
        lines = [*lines[: MOST_LINES - 1], f"{lines[MOST_LINES - 1][: max(5, width - 1)]}…"]
    return lines


def lifelines(sequence: Sequence) -> tuple[float, ...]:
    """Return where the lifelines stand, and before them what is outside, if it is there."""
    count = len(sequence.lifelines) + 1
    gaps = [LEAST_GAP] * count
    halves = [0.0] * count
    for place, line in enumerate(sequence.lifelines, 1):
        halves[place] = (min(len(line.name), BOX_WIDTH) * CHARACTER + PADDING) / 2
    for block in sequence.blocks:
        if block.lifeline is not None:
            place = block.lifeline + 1
            halves[place] = max(halves[place], box_of(block).width / 2)
            if block.cause is Cause.OUTSIDE:
                _widen(gaps, 0, place, block.text)
        for arrow in block.arrows:
            ends = [0 if end is None else end + 1 for end in (arrow.source, arrow.target)]
            _widen(gaps, min(ends), max(ends), arrow.text)
    has_outside = sequence.has_outside
    at = TIME + (16.0 if has_outside else halves[1] + 14)
    found = [at] if has_outside else [0.0, at]
    for place in range(len(found), count):
        room = halves[place - 1] + halves[place] + 14
        at += max(gaps[place - 1], room)
        found.append(at)
    return tuple(found)


def _widen(gaps: list[float], first: int, last: int, text: str) -> None:
    """Make room for half of a text at least, so that it takes two lines."""
    if last == first:
        return
    longest = max(map(len, text.split()), default=0)
    wanted = max(longest, min(len(text), max(20, len(text) // 2 + 4))) * CHARACTER + 40
    each = min(MOST_GAP, wanted / (last - first))
    for gap in range(first, last):
        if last - first == 1:
            gaps[gap] = max(gaps[gap], each)
