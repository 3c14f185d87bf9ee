"""A diagram before its labels are read: nodes within nodes, and edges."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.diagnostics import Span, Text


@dataclass
class Node:
    """A shape, with the shapes inside it. ``kind`` is known only in PlantUML."""

    key: str
    label: Text
    span: Span
    kind: str = ""
    children: list[Node] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Edge:
    """An arrow between two nodes; an end that is missing is an empty key."""

    source: str
    target: str
    label: Text
    span: Span


@dataclass
class Diagram:
    """The pages of a file: their shapes and arrows."""

    pages: list[Node] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    lost: list[tuple[str, Span]] = field(default_factory=list)
    """Parts that a chart does not have, such as notes."""


def joined(label: Text, more: list[Text]) -> Text:
    """Return a label and further lines, one below the other, each with its own location."""
    parts = [part for part in (label, *more) if part.value.strip()]
    if len(parts) < 2:
        return parts[0] if parts else label
    value = "\n".join(part.value for part in parts)
    offsets: list[int] = []
    for part in parts:
        offsets += [*part.character_offsets(), part.span.end]
    return Text(value, label.span, tuple(offsets[:-1]))
