"""Draw a sequence diagram in characters, for a terminal of a given width."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field

from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Part,
    Repetition,
    Sequence,
    Transport,
)

TIME = 8
"""Columns of the times."""
MARGIN = 13
"""Columns before the first lifeline and after the last."""
LEAST, MOST = 19, 38
"""Columns from one lifeline to the next."""
HEADER_EVERY = 60
"""Lines after which the names of the machines are written again."""
LOST = "\N{MULTIPLICATION SIGN}"
DASHES = {
    Transport.DIRECT: "─",
    Transport.VALUE: "┄",
    Transport.QUEUED: "╌",
    Transport.DELAYED: "╌",
    Transport.LOSSY: "╌",
}


@dataclass
class Line:
    """Characters, and the ranges of their styles."""

    width: int
    characters: list[str] = field(default_factory=list)
    styles: list[tuple[int, int, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Fill the line with blanks."""
        self.characters = [" "] * self.width

    def put(self, at: int, text: str, style: str = "") -> None:
        """Write a text; one that does not fit is moved to the left, or cut."""
        at = max(0, min(at, self.width - len(text)))
        shown = text[: self.width - at]
        self.characters[at : at + len(shown)] = shown
        if style:
            self.styles.append((at, at + len(shown), style))

    @property
    def text(self) -> str:
        """The characters."""
        return "".join(self.characters).rstrip()


def draw(sequence: Sequence, width: int) -> list[Line] | None:
    """Return the lines of a diagram; None if the lifelines do not fit in that width."""
    gaps = len(sequence.lifelines) - 1
    first = TIME + 1 + _margin(sequence)
    pitch = min(MOST, (width - first - MARGIN) // max(1, gaps))
    if pitch < (LEAST if gaps else 0):
        return None
    return _Drawer(sequence, width, first, pitch).lines()


def _margin(sequence: Sequence) -> int:
    """Return the columns before the first lifeline, for messages of the environment."""
    coming = [len(b.text) for b in sequence.blocks if b.cause is Cause.OUTSIDE]
    return max(MARGIN, min(LEAST, max(coming, default=0) + 7))


class _Drawer:
    def __init__(self, sequence: Sequence, width: int, first: int, pitch: int) -> None:
        self._sequence = sequence
        self._width = width
        self._places = [first + pitch * n for n in range(len(sequence.lifelines))]
        self._lines: list[Line] = []
        self._last_header = 0
        self._time = ""

    def lines(self) -> list[Line]:
        self._header()
        for part in self._sequence.parts:
            if not isinstance(part, Repetition):
                self._block(part)
                continue
            self._rule(part.heading, "red" if part.times is None else "dim")
            for block in part.blocks:
                self._block(block)
            self._rule("", "red" if part.times is None else "dim")
            self._time = ""
        return self._lines

    def _new_line(self) -> Line:
        """Append a line that has only the lifelines, and return it."""
        line = Line(self._width)
        for place in self._places:
            line.put(place, "│", "dim")
        self._lines.append(line)
        return line

    def _header(self) -> None:
        line = Line(self._width)
        for place, machine in zip(self._places, self._sequence.lifelines, strict=True):
            line.put(place - len(machine.name) // 2, machine.name, "bold")
        self._lines.append(line)
        self._last_header = len(self._lines)

    def _rule(self, heading: str, style: str) -> None:
        line = self._new_line()
        text = f"── {heading} " if heading else ""
        line.put(0, text + "─" * (self._width - len(text)), style)

    def _block(self, block: Block) -> None:
        if len(self._lines) > self._last_header + HEADER_EVERY:
            self._header()
        count = len(self._lines)
        if block.lifeline is not None:
            self._machine(block, block.lifeline)
        for arrow in block.arrows:
            self._arrow(arrow)
        if block.at and block.at != self._time and len(self._lines) > count:
            self._lines[count].put(0, block.at, "cyan")
            self._time = block.at

    def _machine(self, block: Block, lifeline: int) -> None:
        if block.cause is Cause.OUTSIDE:
            self._arrow(Arrow(None, lifeline, block.text), "yellow")
        remarks = (*block.reason, *block.notes)
        for text in remarks:
            self._on(lifeline, text, "yellow" if block.cause is Cause.TIMEOUT else "dim")
        if block.entered:
            self._on(lifeline, f"[{', '.join(block.entered)}]", "bold")
        elif not remarks and block.cause is not Cause.OUTSIDE:
            self._new_line().put(self._places[lifeline], "┃")

    def _on(self, lifeline: int, text: str, style: str) -> None:
        """Write a text on a lifeline, in as many lines as it needs."""
        room = self._room(lifeline)
        for row in textwrap.wrap(text, room, break_on_hyphens=False)[:4]:
            self._new_line().put(self._places[lifeline] - len(row) // 2, row, style)

    def _room(self, lifeline: int) -> int:
        places = [TIME - 2, *self._places, self._width + 8]
        left = places[lifeline + 1] - places[lifeline]
        right = places[lifeline + 2] - places[lifeline + 1]
        return max(12, 2 * min(left, right) - 6)

    def _arrow(self, arrow: Arrow, style: str = "") -> None:
        first = TIME if arrow.source is None else self._places[arrow.source]
        last = self._width - 2 if arrow.target is None else self._places[arrow.target]
        style = style or ("dim" if arrow.transport is Transport.VALUE else "")
        state = {Part.SENT: ", in transit", Part.LOST: ", lost"}.get(arrow.part, "")
        if (
            arrow.transport not in (Transport.DIRECT, Transport.VALUE)
            and arrow.part is not Part.LOST
        ):
            state = state or f", {arrow.transport.value}"
        text = arrow.text + state
        if first == last:
            self._new_line().put(first, f"├─ {text} ─┐ to itself", style)
            return
        left, right = min(first, last) + 1, max(first, last) - 1
        room = right - left - 3
        rows = textwrap.wrap(text, max(6, room), break_on_hyphens=False) or [""]
        for row in rows[:-1]:
            self._new_line().put((left + right - len(row)) // 2, row, style)
        line = self._new_line()
        dash = DASHES[arrow.transport]
        line.put(left, dash * (right - left + 1), style)
        row = f" {rows[-1]} "
        line.put((left + right + 1 - len(row)) // 2, row, style)
        head = {Part.SENT: "○", Part.LOST: LOST}.get(arrow.part, "▶" if last > first else "◀")
        line.put(right if last > first else left, head, "red" if head == LOST else style)
