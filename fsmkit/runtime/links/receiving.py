"""What comes in: order, sessions, and what is counted; step by step as ``fsm_link.c`` does it."""

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
"""So many frames back a doubled frame is distinguished from a late one."""
SESSIONS = 2**28
"""A peer that has shown no key can go on by so many sessions at once."""
QUIET = 200
"""After so many cycles without a frame of the present session of a peer, any other may begin."""


def reached(number: int, other: int) -> bool:
    """Whether a number is another or later, modulo 2^32."""
    return (number - other) % WORD < WORD // 2


class Ring(Generic[Item]):
    """A bounded queue between two threads, one at each end; neither waits.

    What finds no room is counted.
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
        """Take out the oldest item; None if there is none."""
        try:
            return self._items.popleft()
        except IndexError:
            return None


@dataclass(slots=True)
class Counters:
    """What is counted of a peer since the link was made."""

    session: int = 0
    """The present one; 0: no frame yet."""
    frames: int = 0
    """Came in, in the present session; those that seeded faults drop count as well."""
    lost_frames: int = 0
    """Never came, or came when a later one had come."""
    lost_events: int = 0
    """The events among them, and those that found a ring full at the peer."""
    missed: int = 0
    """Events before the first frame that came."""
    late: int = 0
    """Came when a later one had come: dropped, for order."""
    doubled: int = 0
    """Came again: dropped."""
    overflow: int = 0
    """Found the ring full here: dropped."""
    restarts: int = 0
    """Sessions after the first."""


@dataclass(slots=True)
class Peer:
    """What is known of another node."""

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
        """Count a frame of the present session, or one that begins a new one.

        A later session begins at once; of a peer that has shown no key only the next `SESSIONS`.
        Any other begins when the present one has been silent for `QUIET` cycles, so that whoever
        forges a session, and goes, does not lock the peer out for longer than that.
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
        """Whether a frame is the next or a later one; count what is between, or what it is."""
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
        if not reached(frame.sequence, self.sequence):
            self._count_again(frame.sequence)
            return False
        newer = (frame.sequence - self.sequence) % WORD
        counters.lost_frames += newer
        self.window = ((self.window << (newer + 1)) | 1) % 2**WINDOW if newer < WINDOW else 1
        self.sequence = (frame.sequence + 1) % WORD
        if reached(frame.events, self.events):
            counters.lost_events += (frame.events - self.events) % WORD
        self.events = frame.events
        return True

    def _count_again(self, sequence: int) -> None:
        age = (self.sequence - 1 - sequence) % WORD
        bit = 1 << age if age < WINDOW else 0
        if self.window & bit:
            self.counters.doubled += 1
        else:
            self.counters.late += 1
        self.window |= bit


class Receiver:
    """Takes in what comes to a node. Threads that call `arrive` and `pass_time` take turns.

    ``is_proven``: what carries the frames has made sure, by a key, which peer they come from.
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
        """Take bytes that came from the endpoint of a peer, perhaps a frame of it, perhaps not.

        Whether they were a frame of the present session of the peer, also one that faults drop.
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
            passed = [frame] if self.faults is None else self.faults.through(frame, self.cycle)
            for each in passed:
                self._take(each)
            return True
        return False

    def reject_foreign(self) -> None:
        """Count a frame of another map, whose bytes are no frame of a link."""
        with self._turn:
            self.foreign += 1

    def pass_time(self) -> None:
        """Let delayed frames go on whose time has come."""
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
        """Return a copy of what is counted of a peer."""
        return replace(self.peers[node].counters)
