"""Origins of the items of a chart that the Chart itself does not record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import Document, Origin


@dataclass(frozen=True, slots=True)
class Where:
    """Whether an item is inherited, and its place: that of the text that counts.

    ``copy``: the copy of a used chart that it is in, if it is in one.
    """

    origin: Origin
    span: Span | None
    copy: str = ""

    @property
    def place(self) -> str:
        """The file, by its last name, and the line."""
        if self.span is None:
            return "platform"
        return f"{Path(self.span.source.name).name}:{self.span.source.position(self.span.start)[0]}"

    def __str__(self) -> str:
        told = self.place if self.span is None else f"{self.origin.value} {self.place}"
        return f"{told} as {self.copy}" if self.copy else told


@dataclass(frozen=True, slots=True)
class Origins:
    """The origins of types, constants, capacities and functions, by name."""

    types: Mapping[str, Where]
    constants: Mapping[str, Where]
    capacities: Mapping[str, Where]
    functions: Mapping[str, Where]


def origins(documents: tuple[Document, ...]) -> Origins:
    """Return the origins; ``documents`` are the chart's own and then its bases'."""
    return Origins(
        _of([{t.name.value: t.name for t in d.types} for d in documents]),
        _of([{c.name.value: c.name for c in d.constants} for d in documents]),
        _of([{c.name.value: c.name for c in d.capacities} for d in documents]),
        _of([{f.name.value: f.name for f in d.functions} for d in documents]),
    )


def _of(declared: list[dict[str, Text]]) -> dict[str, Where]:
    """Return the origin of each name; a declaration in a nearer chart takes precedence."""
    own, *bases = declared
    inherited: dict[str, Text] = {}
    for base in reversed(bases):
        inherited |= base
    found = {name: Where(Origin.INHERITED, text.span) for name, text in inherited.items()}
    for name, text in own.items():
        origin = Origin.OVERRIDDEN if name in inherited else Origin.OWN
        found[name] = Where(origin, text.span)
    return found
