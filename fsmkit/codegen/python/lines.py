"""Indented lines of Python, in pieces that are linked by the names that stand in them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

from fsmkit.codegen.python.linking import ME, OWN, linked
from fsmkit.emit import Emitter
from fsmkit.emit.python import docstring


@dataclass(frozen=True)
class Uses:
    """The names that a definition uses, and those of them that are not attributes."""

    names: frozenset[str] = frozenset()
    outside: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Piece:
    """A method, a table or a constant: its name and its text, with the empty line before it."""

    name: str
    text: str
    read: Uses = Uses()
    """What it uses beside its links: of a text that is not printed here."""

    @cached_property
    def names(self) -> frozenset[str]:
        """All names that it uses."""
        return linked(self.text) | linked(self.text, OWN) | self.read.names

    @cached_property
    def outside(self) -> frozenset[str]:
        """Those that are not attributes: of its class or of the module."""
        return linked(self.text) | self.read.outside


class Lines(Emitter):
    """Collects lines at the current depth."""

    def __init__(
        self,
        depth: int = 0,
        *,
        is_traced: bool = True,
        is_recorded: bool = False,
        first_transition: int | None = None,
    ) -> None:
        """Start empty, inside of that many suites.

        ``is_traced``: what is told is printed; ``is_recorded``: it is told whoever listens, and
        what has a record is recorded; ``first_transition``: the counter of the first one, where
        what is reached is counted (`plan.counting`).
        """
        super().__init__()
        self._depth = depth
        self._starts: list[tuple[str, int]] = []
        self.is_traced = is_traced
        self.is_recorded = is_recorded
        self._first_transition = first_transition

    def tell(self, line: str) -> None:
        """Print that a line is told to the trace, if there is one; it is an expression."""
        if self.is_recorded:
            self.line(f"{ME}_tell({line})")
        elif self.is_traced:
            with self.suite(f"if {ME}trace is not None:"):
                self.line(f"{ME}_tell({line})")

    def came(self, state: int, name: str) -> None:
        """Print that the entry of a state is told, and counted; ``name``: the line, a literal."""
        self.tell(name)
        if self._first_transition is not None:
            self.line(f"{ME}_count({state})")

    def took(self, transition: int) -> None:
        """Print that a transition is told, and recorded."""
        self.tell(f'"t {transition}"')
        if self.is_recorded:
            self.line(f"{ME}_record_taken({transition})")
        if self._first_transition is not None:
            self.line(f"{ME}_count({self._first_transition + transition})")

    @contextmanager
    def suite(self, opening: str) -> Iterator[None]:
        """Indent what is added inside; nothing inside becomes ``pass``."""
        self.line(opening)
        with self.indented():
            size = len(self._lines)
            yield
            if len(self._lines) == size:
                self.line("pass")

    def piece(self, name: str) -> None:
        """Begin a piece; it ends where the next begins."""
        self._starts.append((name, len(self._lines)))

    def pieces(self) -> list[Piece]:
        """Return what was added, piece by piece."""
        ends = [start for _, start in self._starts[1:]] + [len(self._lines)]
        return [
            Piece(name, "\n".join(self._lines[start:end]))
            for (name, start), end in zip(self._starts, ends, strict=True)
        ]

    @contextmanager
    def method(
        self, name: str, doc: str, arguments: str = "", result: str = "None"
    ) -> Iterator[None]:
        """Open a method with its docstring, after an empty line."""
        self.piece(name)
        self.line()
        passed = f"self, {arguments}" if arguments else "self"
        with self.suite(f"def {name}({passed}) -> {result}:"):
            self.line(f'"""{docstring(doc)}"""')
            yield
