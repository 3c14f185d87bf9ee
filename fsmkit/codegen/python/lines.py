"""Indented lines of Python in pieces, which the names in them link."""

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
    """A method, a table or a constant: its name, and its text after an empty line."""

    name: str
    text: str
    read: Uses = Uses()
    """The unlinked names that a copied text uses."""

    @cached_property
    def names(self) -> frozenset[str]:
        """All names that it uses."""
        return linked(self.text) | linked(self.text, OWN) | self.read.names

    @cached_property
    def outside(self) -> frozenset[str]:
        """The names that are not attributes, of the class or of the module."""
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
        """Start empty, at a depth of that many suites.

        ``is_traced``: print trace statements; ``is_recorded``: print them unconditionally, together
        with records; ``first_transition``: the counter of the first transition, if coverage is
        counted (`plan.counting`).
        """
        super().__init__()
        self._depth = depth
        self._starts: list[tuple[str, int]] = []
        self.is_traced = is_traced
        self.is_recorded = is_recorded
        self._first_transition = first_transition

    def print_trace(self, line: str) -> None:
        """Print a trace statement for an expression, if the machine has a trace."""
        if self.is_recorded:
            self.line(f"{ME}_tell({line})")
        elif self.is_traced:
            with self.suite(f"if {ME}trace is not None:"):
                self.line(f"{ME}_tell({line})")

    def print_entered(self, state: int, name: str) -> None:
        """Print the trace and count of entering a state; ``name``: the trace line, a literal."""
        self.print_trace(name)
        if self._first_transition is not None:
            self.line(f"{ME}_count({state})")

    def print_taken(self, transition: int) -> None:
        """Print the trace, the record and the count of taking a transition."""
        self.print_trace(f'"t {transition}"')
        if self.is_recorded:
            self.line(f"{ME}_record_taken({transition})")
        if self._first_transition is not None:
            self.line(f"{ME}_count({self._first_transition + transition})")

    @contextmanager
    def suite(self, opening: str) -> Iterator[None]:
        """Indent the lines added inside; an empty suite becomes ``pass``."""
        self.line(opening)
        with self.indented():
            size = len(self._lines)
            yield
            if len(self._lines) == size:
                self.line("pass")

    def piece(self, name: str) -> None:
        """Start a piece, which ends where the next starts."""
        self._starts.append((name, len(self._lines)))

    def pieces(self) -> list[Piece]:
        """Return the pieces that were added."""
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
