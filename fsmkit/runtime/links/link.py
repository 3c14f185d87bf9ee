"""The link of a node: its interface for programs, and the parts common to all kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from fsmkit.language import Value
from fsmkit.language.values import from_python, to_python
from fsmkit.runtime.links.codec import Codec, Frame
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.receiving import WORD, Counters, Receiver, Ring
from fsmkit.system.deployment.event_map import LEVELS, EventMap, Message

SLOTS = 256
"""Default capacity, in events, of the queue in each direction."""


class LinkTimeout(TimeoutError):  # noqa: N818  (as in other libraries)
    """Frames or a listener did not arrive in time; the message names them."""


class Translator(Protocol):
    """Translate between a link and the native format of a third-party node."""

    node: int
    """The third-party node."""

    def take(self, frame: Frame) -> None:
        """Send the parts of an outgoing frame that concern the third-party node. Must not block."""
        ...

    def poll(self) -> None:
        """Pass received data to `Link.receiver` when a cycle starts. Must not block."""
        ...

    def close(self) -> None:
        """End threads and connections."""
        ...


Answer = Callable[[int, tuple[Value, ...]], tuple[bool, Value | None]]
"""Answers an event, by the number of its message: whether it was handled, and the reply."""


@runtime_checkable
class OperationTranslator(Protocol):
    """A translator for events that are answered, while `Translator.poll` runs."""

    answer: Answer | None
    """Set by the owner of the machines."""


@dataclass(slots=True)
class _Queued:
    number: int
    message: Message


class Link(ABC):
    """The link of a node, used in cycles: begin, receive and send, end. Only `wait_*` blocks.

    All kinds share the rings, sequence numbers, levels and counters. A kind defines `_wake`
    (frames wait), `_take_in` (block for one frame of a peer) and `wait_listeners`, and extends
    `close`.
    """

    def __init__(
        self,
        event_map: EventMap,
        node: str,
        session: int,
        faults: Faults | None,
        slots: int,
        *,
        is_proven: bool,
    ) -> None:
        if not 0 < session < WORD:
            raise ValueError(f"a session is 1 to 2^32 - 1, not {session}")
        self.map = event_map
        self.node = event_map.node(node)
        self.session = session
        self.codec = Codec(event_map)
        self.receiver = Receiver(self.codec, self.node, slots, faults, is_proven=is_proven)
        self._own_levels = event_map.levels_of(self.node)
        self._places = {
            level.name: (sender, place)
            for sender in range(len(event_map.nodes))
            for place, level in enumerate(event_map.levels_of(sender))
        }
        self._out: Ring[_Queued] = Ring(slots)
        self._pending: list[_Queued] = []
        self._levels: tuple[int, tuple[Value, ...]] | None = None
        self._put = 0
        self._put_before = 0
        self._arrived = 0
        self._sequence = 0
        self._events = 0
        self.sent = 0
        """The frames that were sent in this session, for `wait_frames` of a peer."""
        self.completed = 0
        """Number of completed cycles; messages sent outside the loop depend on it (`Watch`)."""
        self._seen = [(0, 0) for _ in event_map.nodes]
        self.translators: tuple[Translator, ...] = ()
        """Receive each outgoing frame; see `fsmkit.runtime.links.opening`."""
        self.bus_errors = 0
        """The error frames of buses that carry frames."""
        self.bus_off = 0
        """Receivers whose controller has left its bus."""

    # --- the loop's end ----------------------------------------------------------------------

    def begin_cycle(self) -> None:
        """Start a cycle: make the received events and levels visible."""
        self.receiver.cycle += 1
        cycle = self.receiver.cycle
        for translator in self.translators:
            translator.poll()
        self._pass_time()
        for node, peer in enumerate(self.receiver.peers):
            if peer.heard != self._seen[node][0]:
                self._seen[node] = peer.heard, cycle
        self._arrived = len(self.receiver.events)

    def receive(self) -> Message | None:
        """Return the oldest event that came in before this cycle; None if there is no more."""
        if self._arrived == 0:
            return None
        self._arrived -= 1
        return self.receiver.events.get()

    def level(self, name: str) -> object:
        """Return the last value of a level of another node; None before the first came."""
        if name not in self._places:
            raise ValueError(f"no level `{name}` crosses nodes")
        sender, place = self._places[name]
        frame = self.receiver.peers[sender].levels
        if frame is None:
            return None
        return to_python(frame.values[place], self.map.levels_of(sender)[place].type)

    def send(self, message: Message) -> bool:
        """Send an event when the cycle ends; False, and counted, if there is no room."""
        if message.type.sender != self.node:
            raise ValueError(f"`{message.name}` is not sent by `{self.map.nodes[self.node]}`")
        number = self._put
        self._put = (self._put + 1) % WORD
        if len(self._out) + len(self._pending) >= self._out.capacity:
            self._out.refused += 1
            return False
        self._pending.append(_Queued(number, message))
        return True

    def end_cycle(self, levels: Mapping[str, object] | None = None) -> None:
        """Send the events of this cycle and all levels of this node."""
        given = {} if levels is None else levels
        names = [level.name for level in self._own_levels]
        if set(given) != set(names):
            raise ValueError(f"the levels of this node are ({', '.join(names)})")
        values = tuple(from_python(given[level.name], level.type) for level in self._own_levels)
        self._levels = self._put_before, values
        for queued in self._pending:
            self._out.put(queued)
        self._pending.clear()
        self._put_before = self._put
        self.completed += 1
        self._wake()

    # --- the sender's end --------------------------------------------------------------------

    def next_frame(self) -> bytes | None:
        """Return the next frame to send, or None. Call it from one thread only."""
        frame = self.next_decoded()
        return None if frame is None else self.codec.encode(frame)

    def next_decoded(self) -> Frame | None:
        """Return the same for a kind that sends other bytes."""
        has_event = len(self._out) > 0
        levels, self._levels = self._levels, None
        if levels is not None:
            before, values = levels
            if len(self._out) == 0:  # all events of earlier cycles were sent or rejected
                self._events = before
            message = LEVELS
        elif has_event and (queued := self._out.get()) is not None:
            self._events = queued.number
            values = queued.message.values
            message = queued.message.type.number
        else:
            return None
        frame = Frame(self.node, self.session, self._sequence, self._events, message, values)
        self._sequence = (self._sequence + 1) % WORD
        self._events = (self._events + (message != LEVELS)) % WORD
        self.sent += 1
        for translator in self.translators:
            translator.take(frame)
        return frame

    # --- counting and waiting ----------------------------------------------------------------

    def counters(self, node: str) -> Counters:
        """Return the counters of a peer."""
        return self.receiver.counters(self.map.node(node))

    def silence(self, node: str) -> int:
        """Return the cycles since the last frame of a peer was seen."""
        return self.receiver.cycle - self._seen[self.map.node(node)][1]

    @property
    def refused(self) -> int:
        """The events for which there was no room."""
        return self._out.refused

    @property
    def malformed(self) -> int:
        """Count the frames that were invalid, truncated, or held illegal values."""
        return self.receiver.malformed

    @property
    def foreign(self) -> int:
        """The frames of another version, another event map, or not of the node they came from."""
        return self.receiver.foreign

    def wait_frames(
        self, node: str, frames: int, *, session: int = 0, timeout: float = 1.0
    ) -> None:
        """Block until `frames` frames of a peer have arrived (deterministic links only).

        ``session``: that of the peer; 0 for any. Raises `LinkTimeout` if no frame arrives within
        `timeout` seconds, and `ValueError` if more frames have arrived.
        """
        place = self.map.node(node)
        counters = self.receiver.peers[place].counters
        while True:
            if session in (0, counters.session):
                if counters.frames == frames:
                    return
                if counters.frames > frames and session != 0:
                    raise ValueError(f"{self._wait_message(node, frames, session)}: too many")
            elif counters.session and (session - counters.session) % WORD >= WORD // 2:
                raise ValueError(f"{self._wait_message(node, frames, session)}: a later session")
            elif frames == 0:
                return
            if not self._take_in(place, timeout):
                if counters.frames > frames and session == 0:
                    raise ValueError(f"{self._wait_message(node, frames, session)}: too many")
                raise LinkTimeout(self._wait_message(node, frames, session))

    def _wait_message(self, node: str, frames: int, session: int) -> str:
        counters = self.counters(node)
        return (
            f"node `{self.map.nodes[self.node]}` waited for `{node}`: {frames} frames of session "
            f"{session}, there are {counters.frames} of session {counters.session}"
        )

    # --- defined by each kind -----------------------------------------------------------------

    @abstractmethod
    def wait_listeners(self, timeout: float) -> None:
        """Block until all other nodes listen; `LinkTimeout` after so many seconds.

        A node listens when it has shown that it is the one at its endpoint, and with keys, that it
        has the key.
        """

    def close(self) -> None:
        """End threads and connections; a kind ends its own, too."""
        for translator in self.translators:
            translator.close()

    def _pass_time(self) -> None:
        """Let delayed frames go on, unless another thread does."""
        self.receiver.pass_time()

    @abstractmethod
    def _wake(self) -> None:
        """Carry the frames that `next_frame` gives."""

    @abstractmethod
    def _take_in(self, node: int, timeout: float) -> bool:
        """Block until a frame of a peer has arrived; False when the time is over."""


@runtime_checkable
class TranslatorKind(Protocol):
    """A plug-in that opens translators for one kind of third-party node."""

    name: str
    """The kind, as a deployment names it."""

    def translator(self, link: Link, node: int, options: Mapping[str, Any]) -> Translator:
        """Return the translator between a link and a third-party node.

        Raises `FsmkitError` if it cannot be opened.
        """
        ...

    def foreign_options(self, deployment: Any, node: str) -> dict[str, dict[str, Any]]:
        """Return the options of a deployment for each third-party node connected to `node`."""
        ...


@dataclass(frozen=True, slots=True)
class LinkRequest:
    """A link to open: of a node in a deployment, with the options of its kind.

    ``session``: greater than that of the node's previous run. ``faults``: frames to lose.
    """

    event_map: EventMap
    node: str
    session: int
    faults: Faults | None = None
    options: Mapping[str, Any] = field(default_factory=dict)


@runtime_checkable
class LinkKind(Protocol):
    """A plug-in that opens links with one kind of transport."""

    name: str
    options: tuple[str, ...]
    """The names of the options that `open` takes."""

    def open(self, request: LinkRequest) -> Link:
        """Return a link of a node; `FsmkitError` where it cannot be opened."""
        ...

    def link_options(self, deployment: Any) -> dict[str, Any]:
        """Return the options that a deployment has for links of this kind.

        They are empty where the deployment names another kind: a program may override it.
        """
        ...
