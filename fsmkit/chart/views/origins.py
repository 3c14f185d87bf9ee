"""Origins of the items of a chart that the Chart itself does not record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import Document, Origin


@dataclass(frozen=True, slots=True)
class ItemOrigin:
    """The origin of an item, and the location of the declaration that takes effect.

    ``copy``: the name of the copy of a used chart that contains the item, or an empty string.
    """

    origin: Origin
    span: Span | None
    copy: str = ""

    @property
    def place(self) -> str:
        """The name of the file without its folder, and the line; `platform` without a span."""
        if self.span is None:
            return "platform"
        return f"{Path(self.span.source.name).name}:{self.span.source.position(self.span.start)[0]}"

    def __str__(self) -> str:
        location = self.place if self.span is None else f"{self.origin.value} {self.place}"
        return f"{location} as {self.copy}" if self.copy else location


@dataclass(frozen=True, slots=True)
class Origins:
    """The origins of types, constants, capacities and functions, by name."""

    types: Mapping[str, ItemOrigin]
    constants: Mapping[str, ItemOrigin]
    capacities: Mapping[str, ItemOrigin]
    functions: Mapping[str, ItemOrigin]


def origins(documents: tuple[Document, ...]) -> Origins:
    """Return the origins; ``documents`` are the chart's own and then its bases'."""
    return Origins(
        _origins_by_name([{t.name.value: t.name for t in d.types} for d in documents]),
        _origins_by_name([{c.name.value: c.name for c in d.constants} for d in documents]),
        _origins_by_name([{c.name.value: c.name for c in d.capacities} for d in documents]),
        _origins_by_name([{f.name.value: f.name for f in d.functions} for d in documents]),
    )


def _origins_by_name(declared: list[dict[str, Text]]) -> dict[str, ItemOrigin]:
    """Return the origin of each name; a declaration in a nearer chart takes precedence."""
    own, *bases = declared
    inherited: dict[str, Text] = {}
    for base in reversed(bases):
        inherited |= base
    found = {name: ItemOrigin(Origin.INHERITED, text.span) for name, text in inherited.items()}
    for name, text in own.items():
        origin = Origin.OVERRIDDEN if name in inherited else Origin.OWN
        found[name] = ItemOrigin(origin, text.span)
    return found
