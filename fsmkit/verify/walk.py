"""Every node below a node of a chart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

from fsmkit.diagnostics import Source, Span


def nodes(node: object) -> Iterator[object]:
    """Yield a node and all below it: dataclasses and tuples, in order, places left out."""
    if isinstance(node, tuple):
        for part in node:
            yield from nodes(part)
    elif is_dataclass(node) and not isinstance(node, Span | Source | type):
        yield node
        for part in fields(node):
            yield from nodes(getattr(node, part.name))
