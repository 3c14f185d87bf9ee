"""Links over ZeroMQ: each node publishes at its endpoint and subscribes to all others.

One thread sends, woken by a semaphore; another receives; the loop never waits for them. A
deterministic link sends and receives when the loop says so; its only thread lets ZeroMQ subscribe
again when a peer comes back, which a socket does only when it is used.
"""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import zmq
import zmq.auth
from zmq.auth.thread import ThreadAuthenticator

from fsmkit.diagnostics import fail
from fsmkit.runtime.channels.codec import MAGIC
from fsmkit.runtime.channels.event_map import EventMap
from fsmkit.runtime.channels.faults import Faults
from fsmkit.runtime.channels.link import SLOTS, Endpoint, LinkTimeout

PATROL = 0.01
"""Seconds from look to look at what nobody wakes a thread for."""
TOPIC = struct.Struct("<BBI")
"""A subscription that nothing is sent to: a mark, the subscriber, its session."""
TOPIC_MARK = 0x3F
OPTIONS = {
    zmq.RECONNECT_IVL: 10,
    zmq.RECONNECT_IVL_MAX: 200,
    zmq.HEARTBEAT_IVL: 500,
    zmq.HEARTBEAT_TIMEOUT: 2000,
}
"""Milliseconds, as in ``fsm_link_zmq.c``."""
LINGER = 500


class ZeroMqLink(Endpoint):
    """A link of a node. ``endpoints``: by node; ``bind``: where this one publishes, if elsewhere.

    ``keys``: a folder with ``<node>.key`` of each node and ``<node>.key_secret`` of this one, as
    `zmq.auth.create_certificates` writes them; only nodes with these keys are heard and can listen.
    """

    def __init__(
        self,
        event_map: EventMap,
        node: str,
        *,
        session: int,
        faults: Faults | None = None,
        endpoints: Mapping[str, str] | None = None,
        bind: str | None = None,
        is_deterministic: bool = False,
        keys: Path | None = None,
        slots: int = SLOTS,
    ) -> None:
        super().__init__(event_map, node, session, faults, slots)
        self.is_deterministic = is_deterministic
        self._listeners: dict[int, int] = {}
        self._at = endpoints or dict(zip(event_map.nodes, event_map.endpoints, strict=False))
        missing = [name for name in event_map.nodes if name not in self._at]
        if missing:
            raise fail(
                "link-not-opened",
                f"{', '.join(f'`{name}`' for name in missing)} has no endpoint",
                help="name one in the deployment, under `links: {endpoints: ...}`",
            )
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._authenticator: ThreadAuthenticator | None = None
        self._most = 0 if is_deterministic else 4 * slots
        self._stop = threading.Event()
        self._work = threading.Semaphore(0)
        self._turn = threading.Lock()
        self._threads: list[threading.Thread] = []
        try:
            self._keys = {} if keys is None else self._read_keys(keys)
            self._publisher = self._publish_at(bind or self._at[node])
            self._subscribers = {
                place: self._subscribe(place)
                for place in range(len(event_map.nodes))
                if place != self.node
            }
        except (zmq.ZMQError, OSError, ValueError) as error:
            self.close()
            raise fail(
                "link-not-opened",
                f"the link of `{node}` cannot be opened: {error}",
                help="choose a free endpoint of this computer, and make the keys of all nodes",
            ) from error
        for run in (self._keep_on,) if is_deterministic else (self._send_on, self._receive_on):
            thread = threading.Thread(target=run, name=f"link of {node}", daemon=True)
            thread.start()
            self._threads.append(thread)

    # --- opening and closing -----------------------------------------------------------------

    def _read_keys(self, folder: Path) -> dict[str, tuple[bytes, bytes | None]]:
        found = {name: zmq.auth.load_certificate(folder / f"{name}.key") for name in self.map.nodes}
        own = self.map.nodes[self.node]
        found[own] = zmq.auth.load_certificate(folder / f"{own}.key_secret")
        self._authenticator = ThreadAuthenticator(self._context)
        self._authenticator.start()
        self._authenticator.configure_curve_callback("fsm", _Known({k for k, _ in found.values()}))
        return found

    def _socket(self, kind: int) -> zmq.Socket[bytes]:
        socket = self._context.socket(kind)
        for option, value in OPTIONS.items():
            socket.setsockopt(option, value)
        socket.setsockopt(zmq.LINGER, LINGER if self.is_deterministic else 0)
        socket.setsockopt(zmq.SNDHWM, self._most)
        socket.setsockopt(zmq.RCVHWM, self._most)
        if self._keys:
            public, secret = self._keys[self.map.nodes[self.node]]
            socket.curve_publickey, socket.curve_secretkey = public, secret or b""
        return socket

    def _publish_at(self, endpoint: str) -> zmq.Socket[bytes]:
        socket = self._socket(zmq.XPUB)
        socket.setsockopt(zmq.XPUB_VERBOSE, 1)
        if self._keys:
            socket.curve_server = True
            socket.zap_domain = b"fsm"
        socket.bind(endpoint)
        return socket

    def _subscribe(self, place: int) -> zmq.Socket[bytes]:
        name = self.map.nodes[place]
        socket = self._socket(zmq.SUB)
        if self._keys:
            socket.curve_serverkey = self._keys[name][0]
        socket.setsockopt(zmq.SUBSCRIBE, MAGIC)
        socket.setsockopt(zmq.SUBSCRIBE, TOPIC.pack(TOPIC_MARK, self.node, self.session))
        socket.connect(self._at[name])
        return socket

    def close(self) -> None:
        """End the threads and close what is open."""
        self._stop.set()
        self._work.release()
        for thread in self._threads:
            thread.join()
        self._threads.clear()
        if self._authenticator is not None:
            self._authenticator.stop()
            self._authenticator = None
        self._context.destroy(LINGER if self.is_deterministic else 0)

    # --- carrying ----------------------------------------------------------------------------

    def _send_all(self) -> None:
        self._see_listeners()
        while (frame := self.next_frame()) is not None:
            self._publisher.send(frame)

    def _see_listeners(self) -> None:
        while self._publisher.poll(0):
            said = self._publisher.recv()
            if len(said) != 1 + TOPIC.size or said[1] != TOPIC_MARK:
                continue
            _, node, session = TOPIC.unpack(said[1:])
            if said[0]:
                self._listeners[node] = session
            elif self._listeners.get(node) == session:
                del self._listeners[node]

    def _wake(self) -> None:
        if self.is_deterministic:
            with self._turn:
                self._send_all()
        else:
            self._work.release()

    def _pass_time(self) -> None:
        if self.is_deterministic:
            self.receiver.pass_time()

    def _take_in(self, node: int, timeout: float) -> bool:
        if not self.is_deterministic:
            raise ValueError("only a deterministic link waits for frames")
        socket = self._subscribers[node]
        until = time.monotonic() + timeout
        with self._turn:
            while not socket.poll(int(max(0.0, min(PATROL, until - time.monotonic())) * 1000)):
                if time.monotonic() >= until:
                    return False
                self._use_sockets()
            self.receiver.arrive(socket.recv())
        return True

    def wait_listeners(self, timeout: float) -> None:
        """Block until all other nodes listen; `LinkTimeout` after so many seconds."""
        until = time.monotonic() + timeout
        for node in self._subscribers:
            while node not in self._listeners:
                if time.monotonic() >= until:
                    own, name = self.map.nodes[self.node], self.map.nodes[node]
                    raise LinkTimeout(f"node `{own}` waited {timeout} s for `{name}` to listen")
                time.sleep(0.001)

    # --- threads -----------------------------------------------------------------------------

    def _keep_on(self) -> None:
        while not self._stop.wait(PATROL):
            with self._turn:
                self._use_sockets()

    def _use_sockets(self) -> None:
        self._see_listeners()
        for socket in self._subscribers.values():
            socket.getsockopt(zmq.EVENTS)

    def _send_on(self) -> None:
        while not self._stop.is_set():
            self._work.acquire(timeout=PATROL)
            self._send_all()

    def _receive_on(self) -> None:
        poller = zmq.Poller()
        for socket in self._subscribers.values():
            poller.register(socket, zmq.POLLIN)
        while not self._stop.is_set():
            patrol = 1 if self.receiver.faults is not None else int(PATROL * 1000)
            for socket, _ in poller.poll(patrol):
                self._take_some(socket)
            self.receiver.pass_time()

    def _take_some(self, socket: zmq.Socket[bytes]) -> None:
        for _ in range(self.receiver.events.capacity):
            try:
                content = socket.recv(zmq.NOBLOCK)
            except zmq.Again:
                return
            self.receiver.arrive(content)


class _Known:
    """Tells the authenticator who may listen."""

    def __init__(self, keys: set[bytes]) -> None:
        self._keys = keys

    def callback(self, domain: str, key: bytes) -> bool:  # noqa: ARG002  (the protocol of pyzmq)
        """Whether a client's key is one of a node."""
        return key in self._keys
