"""Choose identifiers of other notations: legal, distinct, and similar to the names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from zlib import crc32

from fsmkit.emit import transliterated

SIGN = re.compile(r"(?<![A-Za-z0-9_])-(?=[0-9])")
"""The sign of a number."""
LONGEST = 80
"""Characters of an identifier: SPIN 6 breaks off where it joins two of some 200."""


def word(text: str) -> str:
    """Return a text as an identifier: ASCII letters, digits and single underscores.

    A sign is a word, ``k = -1`` becomes ``k_minus_1``, and so is a range, ``0..2`` ``0_to_2``. A
    text longer than `LONGEST` ends with a checksum of all of it, so that others with the same start
    have distinct names.
    """
    found = SIGN.sub("minus_", transliterated(text).replace("..", " to "))
    found = re.sub(r"[^A-Za-z0-9]+", "_", found).strip("_")
    if not found or found[0].isdigit():
        found = f"s_{found}"
    if len(found) <= LONGEST:
        return found
    return f"{found[: LONGEST - 9].strip('_')}_{crc32(text.encode('utf-8', 'replace')):08x}"


class Names:
    """Creates distinct identifiers, none of which is reserved or in ``outer``."""

    def __init__(
        self, reserved: Iterable[str] = (), outer: Names | None = None, prefix: str = ""
    ) -> None:
        """Take the ``reserved`` names, which would otherwise be redefined.

        ``prefix``: the prefix by which a reader of the notation makes each name global; the result
        is unique in ``outer``, too.
        """
        self._reserved = frozenset(reserved)
        self._taken: set[str] = set()
        self._outer = outer
        self._prefix = prefix

    def take(self, text: str) -> str:
        """Return an identifier: ``p_1`` for ``p[1]``, ``p_1_2`` for a similar one."""
        base = word(text)
        base += "_" if base in self._reserved else ""
        found, number = base, 1
        while self._is_taken(found):
            number += 1
            found = f"{base}_{number}"
        self._taken.add(found)
        if self._outer is not None and self._prefix:
            self._outer._taken.add(self._prefix + found)  # noqa: SLF001
        return found

    def _is_taken(self, name: str) -> bool:
        outside = {name, self._prefix + name}
        is_outside = self._outer is not None and any(map(self._outer._is_taken, outside))  # noqa: SLF001
        return is_outside or name in self._taken or name in self._reserved
