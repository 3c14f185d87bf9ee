"""Receive frames: order, sessions and counters, step by step as in ``fsm_link.c``."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from fsmkit.runtime.links.codec import Codec, Frame, Rejected
from fsmkit.runtime.links.faults import Faults
from fsmkit.system.deployment.event_map import LEVELS, Message

Item = TypeVar("Item")
WORD = 2**32
WINDOW = 64
"""Number of past frames within which repeated and late frames are distinguished."""
SESSIONS = 2**28
"""Number of sessions that a peer without a key may advance immediately."""
QUIET = 200
"""Cycles without a frame of a peer's present session after which any other may start."""


def is_at_least(number: int, other: int) -> bool:
    """Whether a number is another or later, modulo 2^32."""
    return (number - other) % WORD < WORD // 2


class Ring(Generic[Item]):
    """A bounded queue between two threads, one at each end; neither waits.

    Items that do not fit are counted.
    """

    __slots__ = ("_items", "capacity", "refused")

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.refused = 0
        self._items: deque[Item] = deque()

    def __len__(self) -> int:
        return len(self._items)

    def put(self, item: Item) -> bool:
        """Put in an item; False, and counted, if there is no room."""
        if len(self._items) >= self.capacity:
            self.refused += 1
            return False
        self._items.append(item)
        return True

    def get(self) -> Item | None:
        """Remove and return the oldest item, or None if the ring is empty."""
        try:
            return self._items.popleft()
        except IndexError:
            return None


@dataclass(slots=True)
class Counters:
    """The counters of a peer since the link was opened."""

    session: int = 0
    """The present one; 0: no frame yet."""
    frames: int = 0
    """Frames received in the present session, including those dropped by seeded faults."""
    lost_frames: int = 0
    """Frames that never arrived, or arrived after a later one."""
    lost_events: int = 0
    """The events among them, and those that found a ring full at the peer."""
    missed: int = 0
    """Events before the first received frame."""
    late: int = 0
    """Frames that arrived after a later one; dropped to keep the order."""
    doubled: int = 0
    """Repeated frames; dropped."""
    overflow: int = 0
    """Found the ring full here: dropped."""
    restarts: int = 0
    """Sessions after the first."""


@dataclass(slots=True)
class Peer:
    """The receiver's state for one peer."""

    counters: Counters
    taken: int = 0
    sequence: int = 0
    events: int = 0
    window: int = 0
    heard: int = 0
    spoke: int = 0
    """The cycle of the last frame of the present session, faults counted as well."""
    levels: Frame | None = None

    def is_present(self, session: int, cycle: int, *, is_proven: bool) -> bool:
        """Count a frame, and return whether it belongs to the present session or starts a new one.

        A later session starts immediately; if the peer has shown no key, only the next `SESSIONS`
        do. Any other session starts after `QUIET` silent cycles of the present one. So a forged
        session locks the peer out for at most that time.
        """
        counters = self.counters
        if session != counters.session:
            ahead = (session - counters.session) % WORD
            is_next = ahead < (WORD // 2 if is_proven else SESSIONS)
            if counters.session != 0 and not is_next and cycle - self.spoke < QUIET:
                counters.late += 1
                return False
            counters.frames = 0
            counters.session = session
        self.spoke = cycle
        counters.frames += 1
        return True

    def is_in_order(self, frame: Frame) -> bool:
        """Return whether a frame is the next or a later one; count gaps and repetitions."""
        counters = self.counters
        if frame.session != self.taken:  # `is_present` has let it in; faults keep the order
            if self.taken == 0:
                counters.missed += frame.events
                self.sequence, self.events = frame.sequence, frame.events
            else:
                counters.restarts += 1
                self.sequence, self.events = 0, 0
            self.window = 0
            self.taken = frame.session
        if not is_at_least(frame.sequence, self.sequence):
            self._count_repetition(frame.sequence)
            return False
        newer = (frame.sequence - self.sequence) % WORD
        counters.lost_frames += newer
        self.window = ((self.window << (newer + 1)) | 1) % 2**WINDOW if newer < WINDOW else 1
        self.sequence = (frame.sequence + 1) % WORD
        if is_at_least(frame.events, self.events):
            counters.lost_events += (frame.events - self.events) % WORD
        self.events = frame.events
        return True

    def _count_repetition(self, sequence: int) -> None:
        age = (self.sequence - 1 - sequence) % WORD
        bit = 1 << age if age < WINDOW else 0
        if self.window & bit:
            self.counters.doubled += 1
        else:
            self.counters.late += 1
        self.window |= bit


class Receiver:
    """Receives the frames of a node. Threads that call `arrive` and `pass_time` take turns.

    ``is_proven``: the transport has authenticated the peer by a key.
    """

    def __init__(
        self,
        codec: Codec,
        node: int,
        slots: int,
        faults: Faults | None,
        *,
        is_proven: bool = False,
    ) -> None:
        self.codec = codec
        self.node = node
        self.faults = faults
        self.is_proven = is_proven
        self.events: Ring[Message] = Ring(slots)
        self.peers = tuple(Peer(Counters()) for _ in codec.map.nodes)
        self.malformed = 0
        self.foreign = 0
        self.cycle = 0
        self._turn = threading.Lock()

    def arrive(self, peer: int, content: bytes) -> bool:
        """Receive bytes from the endpoint of a peer.

        Return whether they were a frame of the peer's present session, even if a fault drops it.
        """
        with self._turn:
            return self._arrive(peer, content)

    def _arrive(self, peer: int, content: bytes) -> bool:
        frame = self.codec.decode(content, self.node)
        if frame is Rejected.MALFORMED:
            self.malformed += 1
        elif frame is Rejected.FOREIGN or (isinstance(frame, Frame) and frame.sender != peer):
            self.foreign += 1
        elif isinstance(frame, Frame) and self.peers[peer].is_present(
            frame.session, self.cycle, is_proven=self.is_proven
        ):
            passed = [frame] if self.faults is None else self.faults.transmit(frame, self.cycle)
            for each in passed:
                self._take(each)
            return True
        return False

    def reject_foreign(self) -> None:
        """Count a frame of another map, whose bytes are no frame of a link."""
        with self._turn:
            self.foreign += 1

    def pass_time(self) -> None:
        """Release the delayed frames whose delay has passed."""
        if self.faults is not None:
            with self._turn:
                for frame in self.faults.due(self.cycle):
                    self._take(frame)

    def _take(self, frame: Frame) -> None:
        peer = self.peers[frame.sender]
        if not peer.is_in_order(frame):
            return
        peer.heard += 1
        if frame.message == LEVELS:
            peer.levels = frame
            return
        peer.events = (peer.events + 1) % WORD
        type_ = self.codec.map.messages[frame.message - 1]
        if type_.receiver == self.node and not self.events.put(Message(type_, frame.values)):
            peer.counters.overflow += 1

    def counters(self, node: int) -> Counters:
        """Return a copy of the counters of a peer."""
        return replace(self.peers[node].counters)
