"""Indented lines of Python."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class Lines:
    """Collects lines at the current depth."""

    def __init__(self, depth: int = 0) -> None:
        """Start empty."""
        self._depth = depth
        self._lines: list[str] = []

    def line(self, text: str = "") -> None:
        """Add one line."""
        self._lines.append("    " * self._depth + text if text else "")

    def lines(self, texts: Iterable[str]) -> None:
        """Add several lines."""
        for text in texts:
            self.line(text)

    def raw(self, text: str) -> None:
        """Add a text that is indented already."""
        self._lines += text.split("\n")

    @contextmanager
    def block(self, opening: str) -> Iterator[None]:
        """Indent what is added inside; nothing inside becomes ``pass``."""
        self.line(opening)
        self._depth += 1
        size = len(self._lines)
        yield
        if len(self._lines) == size:
            self.line("pass")
        self._depth -= 1

    @contextmanager
    def method(
        self, name: str, doc: str, arguments: str = "", result: str = "None"
    ) -> Iterator[None]:
        """Open a method with its docstring, after an empty line."""
        self.line()
        passed = f"self, {arguments}" if arguments else "self"
        with self.block(f"def {name}({passed}) -> {result}:"):
            self.line(f'"""{doc}"""')
            yield

    def finish(self) -> str:
        """Return everything added, ending in one newline."""
        return "\n".join(self._lines).rstrip("\n") + "\n"
