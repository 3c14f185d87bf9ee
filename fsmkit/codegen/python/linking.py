"""Names in printed Python that are links, so the references of a definition are known.

The printed module contains a control character before each name of a method, an attribute, a
constant or a helper (`fsmkit.emit.lines`: no text of a chart contains it). A piece therefore has
all names that it refers to, whatever printed its lines. Unreferenced pieces are omitted, and
`resolve_links` finally removes the marks.
"""

from __future__ import annotations

from string import ascii_letters, digits

LINK = "\x01"
"""Before a name of the class or of the module."""
OWN = "\x02"
"""Before an attribute."""
ME = f"self.{OWN}"
"""Before an attribute of the machine."""
NAME = f"{ascii_letters}{digits}_"
"""The characters of names: `emit.identifiers.legal` returns no others."""


def linked(text: str, mark: str = LINK) -> frozenset[str]:
    """Return the names in a text that follow a mark."""
    parts = text.split(mark)[1:]
    return frozenset(part[: len(part) - len(part.lstrip(NAME))] for part in parts)


def resolve_links(text: str) -> str:
    """Return a text without marks, as valid Python."""
    return text.replace(LINK, "").replace(OWN, "")
