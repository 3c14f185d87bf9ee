"""Names in printed Python that are links: what a definition refers to is known, not searched.

While a module is printed, a name of a method, an attribute, a constant or a helper stands behind
a control character, which no text of a chart brings along (`fsmkit.emit.lines`). So a piece knows
all that it refers to, whoever made its lines; what no other piece reaches is left out, and `spelt`
takes the marks away at the very end.
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
"""What names are made of: `emit.identifiers.legal` gives no other."""


def linked(text: str, mark: str = LINK) -> frozenset[str]:
    """Return the names in a text that stand behind a mark."""
    parts = text.split(mark)[1:]
    return frozenset(part[: len(part) - len(part.lstrip(NAME))] for part in parts)


def spelt(text: str) -> str:
    """Return a text as Python reads it."""
    return text.replace(LINK, "").replace(OWN, "")
