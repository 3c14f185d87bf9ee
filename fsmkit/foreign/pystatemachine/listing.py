"""A machine as a text of one line for each state and transition, to which findings refer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fsmkit.diagnostics import Source, Span, Text


class Listing:
    """The text of a machine and the location of each of its objects."""

    def __init__(self, machine: Any, name: str) -> None:
        """List the states of a machine with their transitions."""
        lines: list[str] = []
        lengths: list[tuple[object, int, int]] = []
        start = 0
        for depth, found, line in _lines(machine):
            text = "  " * depth + line
            lengths.append((found, start + 2 * depth, start + len(text)))
            lines.append(text)
            start += len(text) + 1
        self.source = Source(name, "\n".join(lines) + "\n")
        self._spans = {id(found): Span(self.source, a, b) for found, a, b in lengths}

    def span(self, found: object) -> Span:
        """Return the line of a state or transition."""
        return self._spans.get(id(found), Span(self.source, 0, 0))

    def text(self, value: str, found: object) -> Text:
        """Return a string with the location of a state or transition."""
        return Text(value, self.span(found), ())


def _lines(machine: Any) -> Iterator[tuple[int, object, str]]:
    yield 0, machine, f"machine {type(machine).__name__}"
    waiting = [(1, state) for state in reversed(list(machine.states))]
    while waiting:
        depth, state = waiting.pop()
        kind = "parallel " if state.parallel else "final " if state.final else ""
        yield depth, state, f"{kind}state {state.id}"
        for transition in state.transitions:
            targets = ", ".join(target.id for target in transition.targets)
            event = "initial" if transition.initial else transition.event or "always"
            yield depth + 1, transition, f"{event} -> {targets}" if targets else event
        inner = [*state.states, *state.history]
        waiting.extend((depth + 1, child) for child in reversed(inner))
