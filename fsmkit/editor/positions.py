"""Places in a text as editors count them: lines from zero, columns in code units."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

from lsprotocol import types

from fsmkit.diagnostics import Source

BREAK = re.compile(r"\r\n|\n|\r")


def width(text: str, encoding: types.PositionEncodingKind) -> int:
    """Return the code units of a text (LSP 3.17, position encodings)."""
    if text.isascii() or encoding is types.PositionEncodingKind.Utf32:
        return len(text)
    if encoding is types.PositionEncodingKind.Utf8:
        return len(text.encode("utf-8", errors="replace"))
    return len(text) + sum(char > "\uffff" for char in text)


@dataclass(frozen=True)
class Lines:
    """The lines of a source; converts character offsets to positions and back."""

    text: str
    encoding: types.PositionEncodingKind

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The offset of the first character of each line."""
        return (0, *(match.end() for match in BREAK.finditer(self.text)))

    def line(self, number: int) -> str:
        """Return a line, with its break; empty beyond the last."""
        if not 0 <= number < len(self.starts):
            return ""
        end = self.starts[number + 1] if number + 1 < len(self.starts) else len(self.text)
        return self.text[self.starts[number] : end]

    def position(self, offset: int) -> types.Position:
        """Return the position of an offset, which is kept within the text."""
        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self.starts, offset) - 1
        before = self.text[self.starts[line] : offset]
        return types.Position(line, width(before, self.encoding))

    def offset(self, position: types.Position) -> int:
        """Return the offset of a position; one beyond a line is at its end."""
        if position.line >= len(self.starts):
            return len(self.text)
        line = self.line(position.line).rstrip("\r\n")
        start = self.starts[position.line]
        if line.isascii() or self.encoding is types.PositionEncodingKind.Utf32:
            return start + min(position.character, len(line))
        units = 0
        for place, char in enumerate(line):
            if units >= position.character:
                return start + place
            units += width(char, self.encoding)
        return start + len(line)

    def range(self, start: int, end: int) -> types.Range:
        """Return the range between two offsets."""
        return types.Range(self.position(start), self.position(max(start, end)))

    @property
    def whole(self) -> types.Range:
        """The range of the whole file."""
        return self.range(0, len(self.text))


_KEPT: dict[tuple[int, str], tuple[Source, Lines]] = {}
MOST_KEPT = 256


def lines_of(source: Source, encoding: types.PositionEncodingKind) -> Lines:
    """Return the lines of a source."""
    key = id(source), encoding.value
    kept = _KEPT.get(key)
    if kept is None or kept[0] is not source:
        if len(_KEPT) >= MOST_KEPT:
            _KEPT.clear()
        kept = _KEPT[key] = source, Lines(source.text, encoding)
    return kept[1]
