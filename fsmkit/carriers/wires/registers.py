"""A window of registers from the other side: the bytes that ``fsm_io_map`` reads and writes in C.

``board_a_io.json`` describes the wires. The window is a mapped file, as in C.
"""

from __future__ import annotations

import mmap
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self


@dataclass(frozen=True, slots=True)
class Place:
    """The location of a wire: ``bits`` from ``shift`` on, of a register of ``access`` bits."""

    offset: int
    access: int
    shift: int
    bits: int
    is_signed: bool
    is_output: bool
    """Whether the board writes the register, and others read it."""


def places_of(description: Mapping[str, Any]) -> dict[str, Place]:
    """Return the locations of the wires of a ``board_a_io.json``. Raises `ValueError` without."""
    found = {}
    for signal in description["signals"]:
        if "register" not in signal:
            raise ValueError(f"`{signal['name']}` has no register")
        found[signal["name"]] = Place(**signal["register"], is_output=signal["is_output"])
    return found


def size_of(places: Iterable[Place]) -> int:
    """Return the bytes of a window."""
    return max((place.offset + place.access // 8 for place in places), default=0)


class Registers:
    """A window of a file; a context that closes it."""

    def __init__(
        self, path: Path, places: Mapping[str, Place], *, create: bool = False, start: int = 0
    ) -> None:
        """Map the file; ``create``: create it, or overwrite it with zeros.

        ``start``: the offset of the window in it, a multiple of the page size. Raises `OSError`,
        `ValueError` or `OverflowError` if it cannot be mapped, or is too short.
        """
        size = size_of(places.values())
        self.places = places
        if create:
            path.write_bytes(bytes(size))
        with path.open("r+b") as file:
            self._window = mmap.mmap(file.fileno(), size, offset=start)

    def __enter__(self) -> Self:
        """Return the window."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the window."""
        self.close()

    def close(self) -> None:
        """Close the window; no other call is possible then."""
        self._window.close()

    def get(self, name: str) -> int:
        """Return the raw value of a wire. Raises `KeyError` for an unknown name."""
        place = self.places[name]
        bits = (self._word(place) >> place.shift) & ((1 << place.bits) - 1)
        is_negative = place.is_signed and bits >= 1 << (place.bits - 1)
        found = bits - (1 << place.bits) if is_negative else bits
        return found - 2**32 if found > 2**31 - 1 else found

    def set(self, name: str, value: int) -> None:
        """Set the raw value of a wire, without bits beyond its own ones."""
        place = self.places[name]
        mask = (1 << place.bits) - 1
        word = self._word(place) & ~(mask << place.shift)
        self._put(place, word | (value & mask) << place.shift)

    def _word(self, place: Place) -> int:
        size = place.access // 8
        return int.from_bytes(self._window[place.offset : place.offset + size], sys.byteorder)

    def _put(self, place: Place, word: int) -> None:
        size = place.access // 8
        content = word.to_bytes(size, sys.byteorder)
        self._window[place.offset : place.offset + size] = content
