"""Indented text, line by line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from textwrap import dedent

WIDTH = 100
"""Characters that a line of items has at most."""


class _Block:
    """The block of a ``with`` statement: indents, and adds the closing line unless it raises.

    A class, because a generator takes three times as long and generated code has many blocks.
    """

    __slots__ = ("_closing", "_out")

    def __init__(self, out: Emitter, closing: str | None) -> None:
        self._out = out
        self._closing = closing

    def __enter__(self) -> None:
        self._out._depth += 1  # noqa: SLF001  (its own)

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self._out._depth -= 1  # noqa: SLF001
            if self._closing is not None:
                self._out.line(self._closing)


class Emitter:
    """Collects lines at the current depth."""

    def __init__(self, unit: str = "    ") -> None:
        """Start empty, indenting by ``unit``."""
        self._unit = unit
        self._depth = 0
        self._lines: list[str] = []

    def line(self, text: str = "") -> None:
        """Add one line."""
        self._lines.append(self._unit * self._depth + text if text else "")

    def lines(self, texts: Iterable[str]) -> None:
        """Add several lines."""
        inset = self._unit * self._depth
        self._lines += [inset + text if text else "" for text in texts]

    def wrapped(self, items: Iterable[str]) -> None:
        """Add items, each with a comma, as many on a line as there is room for."""
        row = ""
        for item in items:
            if row and len(row) + len(item) + 2 > WIDTH - len(self._unit) * self._depth:
                self.line(row)
                row = ""
            row += f"{' ' if row else ''}{item},"
        if row:
            self.line(row)

    def text(self, block: str) -> None:
        """Add a block written in place with triple quotes, keeping its relative indentation."""
        self.lines(dedent(block).strip("\n").split("\n"))

    def block(self, opening: str, closing: str = "}") -> AbstractContextManager[None]:
        """Indent the lines added inside, between an opening and a closing line."""
        self.line(opening)
        return _Block(self, closing)

    @contextmanager
    def function(self, head: str) -> Iterator[None]:
        """Add a function of C, whose body is added inside, and an empty line."""
        self.line(head)
        with self.block("{"):
            yield
        self.line()

    def indented(self) -> AbstractContextManager[None]:
        """Indent the lines added inside."""
        return _Block(self, None)

    def open(self, opening: str = "{") -> None:
        """Add a line after which all is indented, until `close`."""
        self.line(opening)
        self._depth += 1

    def close(self, closing: str = "}") -> None:
        """End the block started by `open`."""
        self._depth -= 1
        self.line(closing)

    def turn(self, between: str) -> None:
        """End one indented part and start the next, as ``} else {`` does."""
        self.close(between)
        self._depth += 1

    def collected(self) -> tuple[str, ...]:
        """Return the lines added, but for empty ones at the end."""
        end = len(self._lines)
        while end and not self._lines[end - 1]:
            end -= 1
        return tuple(self._lines[:end])

    def finish(self) -> str:
        """Return everything added, ending in one newline."""
        return "\n".join(self.collected()) + "\n"
