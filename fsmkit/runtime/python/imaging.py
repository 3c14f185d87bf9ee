"""Encode the states and values of a machine as bytes (`fsmkit.plan.image`)."""

from __future__ import annotations

import struct
from typing import Any, ClassVar

from fsmkit.runtime.python.machine import Machine


class Imaging(Machine):
    """The parts common to saving and recording."""

    _HEAD: ClassVar[bytes]
    _REGIONS: ClassVar[tuple[tuple[int, ...], ...]]
    _ABOVE: ClassVar[tuple[int, ...]]
    _RECORDED: ClassVar[tuple[tuple[int, int, int, bool], ...]]
    _EVENT_TYPES: ClassVar[tuple[tuple[Any, ...], ...]]
    _TEXTS: ClassVar[tuple[str, ...]]
    _SLOT_BYTES: ClassVar[tuple[int, ...]]

    _children: tuple[Any, ...]

    # --- copied from here on into each generated class --------------------------------------------

    # --- states and values as bytes ---------------------------------------------------------------

    _FAULTS: ClassVar[tuple[str, ...]] = (
        "", "microsteps", "internal", "range", "error.*", "invoked",
    )  # fmt: skip

    def _recorded(self) -> tuple[int, ...]:
        """Return the value of each history, once for each of its entries in `_RECORDED`."""
        return ()

    def _fault_number(self) -> int:
        """Return the number of the fault, 0 for none; an exception of the host has none."""
        fault = self._fault or ""
        return self._FAULTS.index("error.*" if fault.startswith("error.") else fault)

    def _state_numbers(self) -> list[int]:
        """Return the deepest state of each region, then those that histories recorded."""
        found = [self._deepest(states, self._active) for states in self._REGIONS]
        pairs = zip(self._RECORDED, self._recorded(), strict=True)
        for (region, below, _, _), held in pairs:
            found.append(self._deepest(self._REGIONS[region], self._path(held) & below))
        return found

    def _deepest(self, states: tuple[int, ...], active: int) -> int:
        """Return the last of some states that is active, 0 for none."""
        return next((state for state in reversed(states) if active >> state & 1), 0)

    def _path(self, recorded: int) -> int:
        """Return the state that a history recorded, with all its ancestors."""
        found = state = 0
        while recorded >> state:
            if recorded >> state & 1:
                found |= self._ABOVE[state]
            state += 1
        return found

    def _put_value(self, data: bytearray, type_: Any, value: Any) -> None:
        if type_[0] == "[":
            for place, part in enumerate(type_[1:]):
                self._put_value(data, part, value[place])
        elif type_[0] == "text":
            data += struct.pack("<I", self._TEXTS.index(value))
        else:
            number = value if value == value else float("nan")
            data += struct.pack("<" + type_[0], number)
