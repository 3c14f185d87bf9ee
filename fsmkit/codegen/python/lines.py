"""Indented lines of Python."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fsmkit.emit import Emitter
from fsmkit.texts.python import docstring


class Lines(Emitter):
    """Collects lines at the current depth."""

    def __init__(self, depth: int = 0) -> None:
        """Start empty, inside of that many suites."""
        super().__init__()
        self._depth = depth

    @contextmanager
    def suite(self, opening: str) -> Iterator[None]:
        """Indent what is added inside; nothing inside becomes ``pass``."""
        self.line(opening)
        with self.indented():
            size = len(self._lines)
            yield
            if len(self._lines) == size:
                self.line("pass")

    @contextmanager
    def method(
        self, name: str, doc: str, arguments: str = "", result: str = "None"
    ) -> Iterator[None]:
        """Open a method with its docstring, after an empty line."""
        self.line()
        passed = f"self, {arguments}" if arguments else "self"
        with self.suite(f"def {name}({passed}) -> {result}:"):
            self.line(f'"""{docstring(doc)}"""')
            yield
