"""Texts in order, of which all but the last ones are packed: a million steps fit in memory."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator

TOGETHER = 64
"""Number of strings per block: similar strings compress well, but a block unpacks as a whole."""
LEVEL = 1
"""Level of zlib: fast, because each step of a running session packs a string."""
OBJECT_SIZE = 41
"""Overhead of an unpacked string in bytes: the object and its reference."""


class Texts:
    """Strings without line breaks in compressed form; the first ones can be dropped.

    Args:
        texts: The initial strings.

    """

    def __init__(self, texts: Iterable[bytes] = ()) -> None:
        self._packed: list[bytes] = []
        self._skipped = 0
        """Texts of the first packed ones that are forgotten."""
        self._last: list[bytes] = []
        self.size = 0
        """Bytes that all of them take."""
        self._seen: tuple[bytes, list[bytes]] = (b"", [])
        for text in texts:
            self.append(text)

    def __len__(self) -> int:
        return TOGETHER * len(self._packed) + len(self._last) - self._skipped

    def __getitem__(self, place: int) -> bytes:
        if not 0 <= place < len(self):
            raise IndexError(place)
        together, within = divmod(place + self._skipped, TOGETHER)
        return self._of(together)[within]

    def __iter__(self) -> Iterator[bytes]:
        return (self[place] for place in range(len(self)))

    def append(self, text: bytes) -> None:
        """Add a text."""
        self._last.append(text)
        self.size += len(text) + OBJECT_SIZE
        if len(self._last) == TOGETHER:
            self.size -= sum(map(len, self._last)) + TOGETHER * OBJECT_SIZE
            self._packed.append(zlib.compress(b"\n".join(self._last), LEVEL))
            self.size += len(self._packed[-1]) + OBJECT_SIZE
            self._last = []

    def forget(self, count: int) -> None:
        """Forget so many of the first."""
        together, within = divmod(self._skipped + count, TOGETHER)
        if together >= len(self._packed):  # few are left
            kept = [self[place] for place in range(count, len(self))]
            self._packed, self._last, self._skipped, self.size = [], [], 0, 0
            for text in kept:
                self.append(text)
            return
        self.size -= sum(map(len, self._packed[:together])) + together * OBJECT_SIZE
        del self._packed[:together]
        self._skipped = within

    def first(self, count: int) -> Texts:
        """Return the first `count` strings; packed blocks are shared."""
        found = Texts()
        together, within = divmod(self._skipped + count, TOGETHER)
        together = min(together, len(self._packed))
        found._packed = self._packed[:together]
        found._skipped = self._skipped
        found.size = sum(map(len, found._packed)) + together * OBJECT_SIZE
        for text in self._of(together)[:within] if within else ():
            found.append(text)
        return found

    def _of(self, together: int) -> list[bytes]:
        """Return the strings of a block."""
        if together >= len(self._packed):
            return self._last
        packed = self._packed[together]
        if self._seen[0] is not packed:
            self._seen = packed, zlib.decompress(packed).split(b"\n")
        return self._seen[1]
