"""Indented lines of Python."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fsmkit.emit import Emitter
from fsmkit.texts.python import docstring


class Lines(Emitter):
    """Collects lines at the current depth."""

    def __init__(self, depth: int = 0, *, is_traced: bool = True) -> None:
        """Start empty, inside of that many suites; ``is_traced``: what is told is printed."""
        super().__init__()
        self._depth = depth
        self.is_traced = is_traced

    def tell(self, line: str) -> None:
        """Print that a line is told to the trace, if there is one; it is an expression."""
        if self.is_traced:
            with self.suite("if self.trace is not None:"):
                self.line(f"self._tell({line})")

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
