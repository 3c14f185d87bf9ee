"""A message of a bus, as the frames of a link have it."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.carriers.can.dbc import Message, Signal


@dataclass(frozen=True, slots=True)
class CanWire:
    """A message of the bus, as the frames of a link have it.

    ``parts``: its signals, each with its place among the values of the payload, or None; a signal
    that is connected twice is here twice.
    """

    message: Message
    number: int | None
    """Of the event map, or `LEVELS`; None: nothing takes it, but it is known."""
    parts: tuple[tuple[Signal, int | None], ...]
