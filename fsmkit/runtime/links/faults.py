"""Inject seeded faults between arrival and receipt; equals `fsm_link_faults` in C."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsmkit.runtime.links.codec import Frame

WHOLE = 1 << 16
"""Chances are in 1/65536."""
HELD = 64
"""Maximum number of delayed frames; one more releases the oldest."""
MASK = 2**64 - 1


def split_mix(state: int) -> tuple[int, int]:
    """Return the next state and a number of 64 bits (SplitMix64; Steele, Lea, Flood 2014)."""
    state = (state + 0x9E3779B97F4A7C15) & MASK
    z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return state, z ^ (z >> 31)


@dataclass(slots=True)
class Faults:
    """Random faults of frames; the same seed does the same to the same frames.

    ``loss``, ``duplication`` and ``delay`` are probabilities. A delayed frame, and every later
    frame of its peer, waits for some cycles of the receiver. ``is_cut``: all frames are lost.
    """

    seed: int = 0
    loss: float = 0.0
    duplication: float = 0.0
    delay: float = 0.0
    delay_cycles: int = 0
    is_cut: bool = False
    lost: int = 0
    duplicated: int = 0
    delayed: int = 0
    _states: dict[int, int] = field(default_factory=dict)
    _held: list[tuple[int, Frame]] = field(default_factory=list)

    def transmit(self, frame: Frame, now: int) -> list[Frame]:
        """Return the frames that pass when `frame` arrives in cycle `now` of the receiver."""
        state = self._states.get(frame.sender)
        if state is None:
            state = split_mix((self.seed + frame.sender) & MASK)[1]
        self._states[frame.sender], chance = split_mix(state)
        if self.is_cut or (chance & 0xFFFF) < self._chance(self.loss):
            self.lost += 1
            return []
        is_late = ((chance >> 32) & 0xFFFF) < self._chance(self.delay) and self.delay_cycles > 0
        self.delayed += is_late
        copies = 1 + (((chance >> 16) & 0xFFFF) < self._chance(self.duplication))
        self.duplicated += copies - 1
        found = []
        for _ in range(copies):
            if not is_late and all(held.sender != frame.sender for _, held in self._held):
                found.append(frame)
                continue
            if len(self._held) == HELD:
                found.append(self._held.pop(0)[1])
            self._held.append((now + self.delay_cycles if is_late else now, frame))
        return found

    def due(self, now: int) -> list[Frame]:
        """Return the delayed frames whose delay has passed, in order of arrival."""
        waiting: set[int] = set()
        kept, found = [], []
        for due, frame in self._held:
            if frame.sender in waiting or due > now:
                waiting.add(frame.sender)
                kept.append((due, frame))
            else:
                found.append(frame)
        self._held = kept
        return found

    @staticmethod
    def _chance(probability: float) -> int:
        return round(probability * WHOLE)
