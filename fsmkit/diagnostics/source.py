"""Sources, locations in them, and pieces of source text with their location."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from urllib.parse import unquote

from fsmkit.diagnostics.fast_init import fast_init
from fsmkit.diagnostics.paths import is_file


@dataclass(frozen=True)
class Source:
    """One input text, under the name that the user gave (``<string>`` without a file)."""

    name: str
    text: str

    @cached_property
    def _line_starts(self) -> tuple[int, ...]:
        """The offset of the first character of each line."""
        return tuple(accumulate((len(line) + 1 for line in self.text.split("\n")[:-1]), initial=0))

    def position(self, offset: int) -> tuple[int, int]:
        """Return the one-based line and column of an offset."""
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    def offset(self, line: int, column: int = 1) -> int:
        """Return the offset of a one-based line and column, clipped to the source."""
        starts = self._line_starts
        if line > len(starts):
            return len(self.text)
        return min(starts[max(line, 1) - 1] + column - 1, len(self.text))

    def beside(self, src: str) -> Path | None:
        """Return the path that a `src` in this source names; None if it leaves the folder.

        The file must be in the folder of this source or below, after links are resolved. A prefix
        ``file:`` is ignored. A URI may encode characters (RFC 3986, 2.1): ``a%20b`` is ``a b``
        unless a file has the name as written.
        """
        try:
            here = Path(self.name)
            folder = here.resolve().parent
            if here.parent.resolve() == folder:
                folder = here.parent
            name = src.strip().removeprefix("file:")
            path = folder / name
            if "%" in name and not is_file(path):
                path = folder / unquote(name)
            is_inside = path.resolve().is_relative_to(folder.resolve())
        except (OSError, ValueError, RuntimeError):  # RuntimeError: circular links
            return None
        return path if is_inside else None

    def line(self, number: int) -> str:
        """Return the text of a one-based line, without its newline."""
        start = self._line_starts[number - 1]
        end = self.text.find("\n", start)
        return self.text[start : len(self.text) if end < 0 else end].rstrip("\r")


@fast_init
@dataclass(frozen=True, slots=True)
class Span:
    """The half-open range ``start:end`` of a source, in characters."""

    source: Source
    start: int
    end: int

    def __repr__(self) -> str:
        return f"Span({self})"

    def __str__(self) -> str:
        line, column = self.source.position(self.start)
        return f"{self.source.name}:{line}:{column}"


@fast_init
@dataclass(frozen=True, slots=True)
class Text:
    """A piece of source text as a value, with its location, which equality ignores.

    ``offsets`` maps each character of ``value`` to its offset in the source. It is present where
    the two are not parallel (a YAML block scalar, an XML attribute with entities). Without it, the
    source contains the value literally from ``span.start`` on.
    """

    value: str
    span: Span = field(compare=False)
    offsets: tuple[int, ...] | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return self.value

    def span_of(self, start: int, end: int) -> Span:
        """Return the location of ``value[start:end]``."""
        if self.offsets is None and 0 <= start <= end <= self.span.end - self.span.start:
            return Span(self.span.source, self.span.start + start, self.span.start + end)
        start, end = max(0, start), max(start, end)
        if self.offsets is None:
            first = min(self.span.start + start, self.span.end)
            return Span(
                self.span.source, first, max(first, min(self.span.start + end, self.span.end))
            )
        if not self.offsets:
            return self.span
        first = self.offsets[min(start, len(self.offsets) - 1)]
        last = self.offsets[min(max(start, end - 1), len(self.offsets) - 1)] + 1
        return Span(self.span.source, first, max(first, last))

    def character_offsets(self) -> Iterable[int]:
        """Return the offset in the source of each character of the value."""
        size = len(self.value)
        if self.offsets is not None and len(self.offsets) == size:
            return self.offsets
        if self.offsets is None and size <= self.span.end - self.span.start:
            return range(self.span.start, self.span.start + size)
        return [self.span_of(n, n + 1).start for n in range(size)]

    def part(self, start: int, end: int) -> Text:
        """Return ``value[start:end]`` with its location."""
        size = len(self.value)
        if start == 0 and end == size == self.span.end - self.span.start and self.offsets is None:
            return self
        offsets = None if self.offsets is None else self.offsets[start:end]
        return Text(self.value[start:end], self.span_of(start, end), offsets)

    def with_value(self, value: str) -> Text:
        """Return another value with the location of this text."""
        return Text(value, self.span, ())

    def strip(self) -> Text:
        """Return the text without white space at its ends."""
        size = len(self.value.strip())
        if self.offsets is None and size == len(self.value) == self.span.end - self.span.start:
            return self
        start = len(self.value) - len(self.value.lstrip())
        return self.part(start, max(start, len(self.value.rstrip())))
