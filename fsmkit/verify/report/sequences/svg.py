"""Write a sequence diagram as SVG, without a library.

A long diagram is cut into bands one below the other. Each band starts with the names of the
machines and their states.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from fsmkit.chart.drawing.states.dot.draw import (
    ACTIVE_AREA,
    ACTIVE_BORDER,
    AREAS,
    FONT,
    GREY,
    INK,
    SOFT,
    WATCHDOG,
)
from fsmkit.emit import notating
from fsmkit.emit.svg import with_dark_colours
from fsmkit.emit.xml import escaped
from fsmkit.verify.report.sequences.model import (
    Arrow,
    Block,
    Cause,
    Part,
    Repetition,
    Sequence,
    Transport,
)

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
BAND = 1150.0
"""Height of a band, about that of a page or a screen on its side."""
WRONG, WRONG_AREA = "#b91c1c", "#fef2f2"
GOOD, GOOD_AREA = "#15803d", "#f0fdf4"
MARGIN, RIGHT = 14.0, 40.0
LOOKS = {
    Transport.DIRECT: (INK, "", True),
    Transport.VALUE: (GREY, "2 3", False),
    Transport.QUEUED: (INK, "9 3", False),
    Transport.DELAYED: (INK, "9 3 2 3", False),
    Transport.LOSSY: (WATCHDOG, "5 4", False),
}
"""The look of an arrow: color, dashes, and whether its head is filled."""
LEGEND = {
    Transport.DIRECT: "event",
    Transport.VALUE: "output to input",
    Transport.QUEUED: "event, by a connection that queues",
    Transport.DELAYED: "event, by a connection that delays",
    Transport.LOSSY: "event, by a connection that can lose it",
}


@notating
def draw(sequence: Sequence) -> str:
    """Return the text of an SVG file."""
    return with_dark_colours(_Drawer(sequence).text())


class _Drawer:
    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self._places = lifelines(sequence)
        boxes = [box_of(b).width for b in sequence.blocks if b.lifeline is not None]
        self._width = self._places[-1] + max([60.0, *(w / 2 for w in boxes)]) + RIGHT
        if any(a.target is None for b in sequence.blocks for a in b.arrows):
            self._width += 130
        self._under: list[str] = []
        self._over: list[str] = []
        self._y = MARGIN
        self._band = 0.0
        self._frame: float | None = None
        self._heading = ""
        self._active: dict[int, tuple[str, ...]] = {}
        self._time = ""
        self._starts: float | None = None

    def text(self) -> str:
        sequence = self._sequence
        self._text(MARGIN, self._y + 12, sequence.title, size=14, weight="bold")
        self._y += 26
        self._header()
        for part in sequence.parts:
            if isinstance(part, Repetition):
                self._repeated(part)
            else:
                self._block(part)
        self._lifelines()
        self._end()
        self._legend()
        width, height = round(self._width), round(self._y + MARGIN)
        size = f'width="{width}" height="{height}"'
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {width} {height}">',
                f'<g font-family="{FONT}" font-size="11">',
                f"<title>{escaped(sequence.title)}</title>",
                f'<rect width="{width}" height="{height}" fill="white"/>',
                *self._under,
                *self._over,
                "</g>",
                "</svg>",
                "",
            ]
        )

    # --- bands -----------------------------------------------------------------------------------

    def _header(self) -> None:
        """Write the names of the machines, and their states."""
        texts = [
            wrap_lines(", ".join(self._active.get(n, ())), BOX_WIDTH)
            for n in range(len(self._sequence.lifelines))
        ]
        lines = max(map(len, texts))
        for number, line in enumerate(self._sequence.lifelines):
            x = self._places[number + 1]
            name = wrap_lines(line.name, BOX_WIDTH)[0]
            width = len(name) * CHARACTER * 1.1 + PADDING + 4
            dashes = ' stroke-dasharray="4 3"' if line.is_environment else ""
            self._rect(x - width / 2, self._y, width, 22, AREAS[0], INK, dashes)
            self._text(x, self._y + 15, name, anchor="middle", weight="bold", size=12)
            for row, state in enumerate(texts[number]):
                at = self._y + 36 + row * LINE
                self._text(x, at, state, anchor="middle", fill=SOFT, size=10)
        if self._sequence.has_outside:
            self._text(self._places[0], self._y + 15, "outside", anchor="middle", fill=WATCHDOG)
        self._band = self._y + 22
        self._y += 30 + lines * LINE
        if lines:
            self._band = self._y
        self._y += 8

    def _lifelines(self) -> None:
        """Draw the lifelines of the band that ends here."""
        top, bottom = self._band, self._y
        for place, x in enumerate(self._places):
            if place > 0:
                self._line(x, top, x, bottom, "#9aa5b1", "", under=True)
            elif self._sequence.has_outside:
                self._line(x, top, x, bottom, WATCHDOG, "2 4", under=True)

    def _room(self, height: float) -> None:
        """Start a new band if this one has no space of that height."""
        if self._y + height < self._band + BAND:
            return
        self._close_frame()
        self._lifelines()
        self._y += 26
        self._header()
        self._time = ""
        if self._heading:
            self._open_frame(f"{self._heading} (goes on)")

    # --- steps -----------------------------------------------------------------------------------

    def _repeated(self, part: Repetition) -> None:
        self._room(60)
        self._heading = part.heading
        self._open_frame(part.heading)
        for block in part.blocks:
            self._block(block)
        self._close_frame()
        self._heading = ""
        self._time = ""

    def _open_frame(self, heading: str) -> None:
        self._frame = self._y
        color = WRONG if heading.startswith("for ever") else SOFT
        width = len(heading) * CHARACTER + 14
        self._rect(TIME - 8, self._y, width, 18, "white", color, "")
        self._text(TIME - 1, self._y + 13, heading, fill=color, weight="bold")
        self._y += 28

    def _close_frame(self) -> None:
        if self._frame is None:
            return
        color = WRONG if self._heading.startswith("for ever") else SOFT
        width = self._width - TIME + 8 - MARGIN
        height = self._y - self._frame + 4
        self._rect(TIME - 8, self._frame, width, height, "none", color, ' stroke-width="1.2"')
        self._y += 12
        self._frame = None

    def _block(self, block: Block) -> None:
        box = box_of(block)
        arrows = [(arrow, self._label(arrow)) for arrow in block.arrows]
        height = sum(len(label) * LINE + 12 for _, label in arrows) + box.height + 12
        self._room(height + (30 if block.cause is Cause.OUTSIDE else 0))
        self._stamp(block)
        if block.lifeline is not None:
            if block.cause is Cause.OUTSIDE:
                self._arrow(Arrow(None, block.lifeline, block.text), WATCHDOG)
            self._start_row(block)
            self._box(block.lifeline, box, block)
            self._active[block.lifeline] = block.active
        for arrow, _ in arrows:
            self._arrow(arrow)

    def _start_row(self, block: Block) -> None:
        """Put machines that start one after another without messages beside each other."""
        if block.cause is Cause.START and self._starts is not None:
            self._y = self._starts
        self._starts = self._y if block.cause is Cause.START and not block.arrows else None

    def _stamp(self, block: Block) -> None:
        if not block.at or block.at == self._time:
            return
        if self._time:
            self._y += 6
        self._time = block.at
        y = self._y + 4
        self._line(TIME - 12, y, self._width - MARGIN, y, "#dbe2ea", "", under=True)
        text = block.at
        self._text(TIME - 16, y + 4, text, anchor="end", fill=SOFT, weight="bold")
        self._y += 12

    def _box(self, lifeline: int, box: Box, block: Block) -> None:
        x = self._places[lifeline + 1]
        if not (box.soft or box.strong):
            self._rect(x - 4, self._y, 8, 12, "white", SOFT, "")
            self._y += 16
            return
        area, border = (ACTIVE_AREA, ACTIVE_BORDER) if box.strong else ("white", "#9aa5b1")
        if box.strong and block.cause is Cause.START:
            area, border = "white", ACTIVE_BORDER
        self._rect(x - box.width / 2, self._y, box.width, box.height, area, border, ' rx="5"')
        y = self._y + 13
        late = block.cause is Cause.TIMEOUT
        for line in box.soft:
            self._text(x, y, line, anchor="middle", fill=WATCHDOG if late else SOFT, size=10)
            y += LINE
        for line in box.strong:
            self._text(x, y, line, anchor="middle", weight="bold")
            y += LINE
        self._y += box.height + 5

    # --- arrows ----------------------------------------------------------------------------------

    def _ends(self, arrow: Arrow) -> tuple[float, float]:
        first = self._places[0 if arrow.source is None else arrow.source + 1]
        if arrow.target is None:
            return first, self._width - MARGIN
        return first, self._places[arrow.target + 1]

    def _label(self, arrow: Arrow) -> list[str]:
        first, last = self._ends(arrow)
        width = abs(last - first) or 150.0
        return wrap_lines(arrow.text, int((width - 22) / (CHARACTER * 0.92)))

    def _arrow(self, arrow: Arrow, color: str = "") -> None:
        first, last = self._ends(arrow)
        look, dashes, filled = LOOKS[arrow.transport]
        color = color or look
        lines = self._label(arrow)
        middle = (first + last) / 2
        size = 10 if arrow.transport is Transport.VALUE else 11
        if first == last:
            self._hook(first, lines, color)
            return
        if arrow.part is Part.LOST:
            middle = first + (last - first) * 0.4
        for line in lines:
            self._y += LINE
            width = len(line) * CHARACTER * 0.92
            self._rect(
                middle - width / 2, self._y - 10, width, 12, "white", "none", ' opacity="0.8"'
            )
            self._text(middle, self._y, line, anchor="middle", fill=color, size=size)
        self._y += 6
        y, step = self._y, 1 if last > first else -1
        begin = first + (last - first) * 0.5 if arrow.part is Part.ARRIVES else first
        end = last
        if arrow.part in (Part.SENT, Part.LOST):
            end = first + (last - first) * 0.8
        self._line(begin, y, end, y, color, dashes)
        if arrow.part is Part.ARRIVES:
            self._circle(begin, y, color)
        if arrow.part is Part.SENT:
            self._circle(end, y, color)
        elif arrow.part is Part.LOST:
            for slope in (-5, 5):
                self._line(end - 5, y - slope, end + 5, y + slope, WRONG, "", width=2)
            self._text(
                end + step * 9, y + 4, "lost", anchor="start" if step > 0 else "end", fill=WRONG
            )
        else:
            self._head(end, y, step, color, filled=filled)
        self._y += 8

    def _hook(self, x: float, lines: list[str], color: str) -> None:
        """Draw a message to the machine itself."""
        y = self._y + 4
        self._over.append(f'<path d="M{x:.0f} {y:.0f} h34 v14 h-34" fill="none" stroke="{color}"/>')
        self._head(x, y + 14, -1, color, filled=True)
        for line in lines:
            self._text(x + 40, y + 11, line, fill=color)
            y += LINE
        self._y = y + 14

    def _head(self, x: float, y: float, step: int, color: str, *, filled: bool) -> None:
        points = f"{x - 8 * step:.1f},{y - 4:.1f} {x:.1f},{y:.1f} {x - 8 * step:.1f},{y + 4:.1f}"
        shape = "polygon" if filled else "polyline"
        fill = color if filled else "none"
        self._over.append(
            f'<{shape} points="{points}" fill="{fill}" stroke="{color}" stroke-width="1.2"/>'
        )

    # --- the end ---------------------------------------------------------------------------------

    def _end(self) -> None:
        """Write the final remark, and the states of all machines at the end."""
        self._y += 8
        self._header()
        violated = self._sequence.violated
        color, area = (WRONG, WRONG_AREA) if violated else (GOOD, GOOD_AREA)
        width = self._width - 2 * MARGIN
        most = int(width / CHARACTER)
        lines = [line for text in self._sequence.end for line in wrap_lines(text, most)]
        self._rect(MARGIN, self._y, width, len(lines) * 16 + 12, area, color, ' rx="5"')
        for row, line in enumerate(lines):
            weight = "bold" if row == 0 else "normal"
            self._text(MARGIN + 10, self._y + 18 + row * 16, line, fill=color, weight=weight)
        self._y += len(lines) * 16 + 18
        if self._sequence.idle:
            text = f"never move: {', '.join(self._sequence.idle)}"
            for line in wrap_lines(text, int(width / CHARACTER)):
                self._text(MARGIN, self._y + 10, line, fill=SOFT, size=10)
                self._y += LINE

    def _legend(self) -> None:
        transports = self._sequence.transports
        if set(transports) <= {Transport.DIRECT}:
            return
        for transport in transports:
            color, dashes, filled = LOOKS[transport]
            y = self._y + 8
            self._line(MARGIN, y, MARGIN + 44, y, color, dashes)
            self._head(MARGIN + 44, y, 1, color, filled=filled)
            self._text(MARGIN + 54, y + 4, LEGEND[transport], fill=SOFT, size=10)
            self._y += LINE + 2

    # --- shapes ----------------------------------------------------------------------------------

    def _text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        anchor: str = "start",
        fill: str = INK,
        size: int = 11,
        weight: str = "normal",
    ) -> None:
        look = f'text-anchor="{anchor}" fill="{fill}" font-size="{size}" font-weight="{weight}"'
        self._over.append(f'<text x="{x:.1f}" y="{y:.1f}" {look}>{escaped(text)}</text>')

    def _rect(
        self, x: float, y: float, width: float, height: float, fill: str, stroke: str, more: str
    ) -> None:
        place = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}"'
        self._over.append(f'<rect {place} fill="{fill}" stroke="{stroke}"{more}/>')

    def _line(
        self,
        x: float,
        y: float,
        to_x: float,
        to_y: float,
        color: str,
        dashes: str,
        *,
        under: bool = False,
        width: float = 1.2,
    ) -> None:
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        place = f'x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}"'
        line = f'<line {place} stroke="{color}" stroke-width="{width}"{dash}/>'
        (self._under if under else self._over).append(line)

    def _circle(self, x: float, y: float, color: str) -> None:
        self._over.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="white" stroke="{color}"/>'
        )


# --- layout of lifelines and text -----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Box:
    """The text on a lifeline at a step: the cause, and the entered states."""

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
    """Return the box of a step; an empty one if the arrow before it shows everything."""
    soft = [line for text in (*block.reason, *block.notes) for line in wrap_lines(text, BOX_WIDTH)]
    return Box(tuple(soft), tuple(wrap_lines(", ".join(block.entered), BOX_WIDTH)))


def wrap_lines(text: str, width: int) -> list[str]:
    """Return a text as lines, at most `MOST_LINES` of them."""
    clean = "".join(c if c.isprintable() else " " for c in text)
    lines = textwrap.wrap(clean, max(6, width), break_on_hyphens=False)
    if len(lines) > MOST_LINES:
        lines = [*lines[: MOST_LINES - 1], f"{lines[MOST_LINES - 1][: max(5, width - 1)]}…"]
    return lines


def lifelines(sequence: Sequence) -> tuple[float, ...]:
    """Return the positions of the lifelines, and before them that of the environment, if shown."""
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
    """Increase gaps until at least half of a text fits, so that it takes two lines."""
    if last == first:
        return
    longest = max(map(len, text.split()), default=0)
    wanted = max(longest, min(len(text), max(20, len(text) // 2 + 4))) * CHARACTER + 40
    each = min(MOST_GAP, wanted / (last - first))
    for gap in range(first, last):
        if last - first == 1:
            gaps[gap] = max(gaps[gap], each)
