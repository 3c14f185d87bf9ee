"""Names in printed Python that are links: what a definition refers to is known, not searched.

While a module is printed, a name of a method, an attribute, a constant or a helper stands behind
a control character, which no text of a chart brings along (`fsmkit.texts.lines`). So a piece knows
all that it refers to, whoever made its lines; what no other piece reaches is left out, and `spelt`
takes the marks away at the very end.
"""

from __future__ import annotations

from collections.abc import Iterator

LINK = "\x01"
"""Before a name of the class or of the module."""
OWN = "\x02"
"""Before an attribute."""
ME = f"self.{OWN}"
"""Before an attribute of the machine."""


def linked(text: str, mark: str = LINK) -> frozenset[str]:
    """Return the names in a text that stand behind a mark."""
    return frozenset("".join(_begin(part)) for part in text.split(mark)[1:])


def _begin(text: str) -> Iterator[str]:
    for char in text:
        if not (char.isalnum() or char == "_"):
            return
        yield char


def spelt(text: str) -> str:
    """Return a text as Python reads it."""
    return text.replace(LINK, "").replace(OWN, "")
