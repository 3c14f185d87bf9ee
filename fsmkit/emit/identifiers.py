"""Identifiers for names of a chart: unique, legal, and as close to the name as possible."""

from __future__ import annotations

import re
from collections.abc import Iterable
from zlib import crc32

from fsmkit.emit.transliteration import transliterated


def snake(name: str) -> str:
    """Return a name in lower case words: ``FeederBelt`` gives ``feeder_belt``."""
    plain = transliterated(name)
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", plain)
    return legal(spaced).lower()


def legal(name: str) -> str:
    """Return an identifier of ASCII characters: letters are transliterated, others become ``_``."""
    plain = re.sub(r"\W", "_", transliterated(name), flags=re.ASCII)
    return plain if plain and not plain[0].isdigit() else f"_{plain}"


class Namer:
    """Gives each name an identifier of its own, none of them reserved."""

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        """Start with the reserved identifiers."""
        self._reserved = frozenset(reserved)
        self._taken = set(self._reserved)

    def name(self, wanted: str, suffix: str = "", *, source: str | None = None) -> str:
        """Return a unique identifier for a name.

        ``suffix``: appended to a reserved identifier. ``source``: the name in the chart. If
        another name has the identifier, a checksum of ``source`` is appended. Code that uses it
        then no longer compiles when the two names are exchanged. Without ``source``, a number is
        appended.
        """
        base = legal(wanted)
        if base in self._reserved:
            base += suffix
        candidate = base
        if candidate in self._taken and source is not None:
            candidate = self._marked(base, source)
        number = 1
        while candidate in self._taken:
            number += 1
            candidate = f"{base}_{number}"
        self._taken.add(candidate)
        return candidate

    def _marked(self, base: str, source: str) -> str:
        """Return an identifier with a checksum, of four digits if that is unique."""
        mark = f"{crc32(source.encode('utf-8', 'replace')):08x}"
        mark = mark.upper() if base.isupper() else mark
        short = f"{base}_{mark[-4:]}"
        return short if short not in self._taken else f"{base}_{mark}"
