"""Names of machines and properties in other notations: identifiers, all different."""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.export.local_states import word


def identifiers(names: Iterable[str]) -> tuple[str, ...]:
    """Return an identifier for each name: of ``p[1]`` ``p_1``, of another like it ``p_1_``."""
    found: list[str] = []
    for name in names:
        base = word(name)
        while base in found:
            base += "_"
        found.append(base)
    return tuple(found)
