"""A message of a bus, in terms of the frames of a link."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.carriers.can.dbc import Message, Signal


@dataclass(frozen=True, slots=True)
class CanWire:
    """A message of the bus, in terms of the frames of a link.

    ``parts``: its signals, each with its index among the values of the payload, or None; a signal
    that is connected twice occurs twice.
    """

    message: Message
    number: int | None
    """The number in the event map, or `LEVELS`; None: known, but without a receiver."""
    parts: tuple[tuple[Signal, int | None], ...]
