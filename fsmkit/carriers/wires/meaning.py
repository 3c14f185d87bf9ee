"""Convert raw values of wires to their meaning, and words and numbers to raw values."""

from __future__ import annotations

from fsmkit.carriers.wires.board import Kind, Signal
from fsmkit.carriers.wires.signals import WORDS, scaled
from fsmkit.language import BoolType


def meaning(signal: Signal, raw: int) -> str:
    """Return the meaning of a raw value, before any filter; "" if it is invalid."""
    if isinstance(signal.type, BoolType):
        return "on" if bool(raw) != signal.is_low else "off"
    if signal.kind in (Kind.ANALOG_IN, Kind.NUMBER_IN):
        if not signal.valid[0] <= raw <= signal.valid[1]:
            return ""
        return str(scaled(signal.points, raw) if signal.points else raw)
    return str(raw)


def raw_of(signal: Signal, text: str) -> int | None:
    """Return the raw value for ``on``, ``off``, or a number in the range of a signal.

    None for other texts. For a converter the text is the raw value itself.
    """
    if isinstance(signal.type, BoolType):
        found = WORDS.get(text, {"0": 0, "1": 1}.get(text))
        return None if found is None else found ^ signal.is_low
    try:
        number = int(text, 0)
    except ValueError:
        return None
    lo, hi = signal.type.lo, signal.type.hi
    if signal.kind is Kind.ANALOG_IN:
        lo = -(2 ** (signal.bits - 1)) if signal.is_signed else 0
        hi = lo + (1 << signal.bits) - 1
    return number if lo <= number <= hi else None
