"""Links over ZeroMQ: each node publishes at its endpoint and connects to those of all others.

One thread sends, woken by a semaphore; another receives; the loop never waits for them. A
deterministic link sends and receives when the loop calls it; its only thread exchanges hellos.

A node publishes by a socket of the kind ROUTER, to its known listeners (`introductions`), and not
by PUB or XPUB: these keep all subscriptions, without bound. Everything that others can make a link
keep is bounded: by the size of messages (``MAXMSGSIZE``) and by the gate.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

import zmq
import zmq.auth
from zmq.auth.thread import ThreadAuthenticator

from fsmkit.carriers.zeromq.gate import Gate
from fsmkit.carriers.zeromq.introductions import Introductions
from fsmkit.carriers.zeromq.scheduling import Scheduling
from fsmkit.diagnostics import fail
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import SLOTS, Link, LinkTimeout
from fsmkit.system.deployment.addresses import is_loopback, rejection_of
from fsmkit.system.deployment.event_map import EventMap

PATROL = 0.01
"""Seconds from look to look at what nobody wakes a thread for."""
HELLO_EVERY = 0.05
"""Seconds from hello to hello, unless there is news."""
OPTIONS = {
    zmq.RECONNECT_IVL: 10,
    zmq.RECONNECT_IVL_MAX: 200,
    zmq.TCP_MAXRT: 2000,
    zmq.HANDSHAKE_IVL: 2000,
}
"""Milliseconds, as in ``fsm_link_zmq.c``. No heartbeats of ZeroMQ: see ``WAITING``."""
LINGER = 500
"""Milliseconds for which a closed link goes on to send what waits."""
SMALL = 1024
"""Bytes of a message at least: the handshakes of ZMTP take up to so many."""
WAITING = 1 << 20
"""Messages of one connection that wait to be seen; the gate ends it long before. A limit that can
be reached is no protection: when ZeroMQ has stopped reading a connection and that ends, a PING that
waits behind, or an expired heartbeat, ends the process ("Assertion failed: !_io_error")."""
PARTS = 1024
"""Parts of messages that are taken from the publisher at one look."""
TOGETHER = 1 << 16
"""Frames that may wait to be taken, or to be sent in a deterministic link."""


class ZeroMqLink(Link):
    """A link of a node. ``endpoints``: by node; ``bind``: where this one publishes, if elsewhere.

    ``keys``: a folder with ``<node>.key`` of each node and ``<node>.key_secret`` of this one, as
    `zmq.auth.create_certificates` writes them; only nodes with these keys are accepted and can
    listen.

    ``priority``, ``cpus``: of the threads of the link and of ZeroMQ (see `Scheduling`);
    `not_granted` lists the settings that the system does not grant.
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
        priority: int = 0,
        cpus: Iterable[int] = (),
    ) -> None:
        self._scheduling = Scheduling(priority, frozenset(cpus))
        self._scheduling.require()
        is_proven = keys is not None
        super().__init__(event_map, node, session, faults, slots, is_proven=is_proven)
        self.is_deterministic = is_deterministic
        self._known = Introductions(self.node, len(event_map.nodes), session)
        self._gate: Gate | None = None
        self._heard = _PartReader()
        self._is_flooded = False
        self._said = dict.fromkeys(range(len(event_map.nodes)), (0.0, 0))
        self._within = [False] * len(event_map.nodes)
        self._at = endpoints or dict(zip(event_map.nodes, event_map.endpoints, strict=False))
        own = {place: event_map.nodes[place] for place in event_map.own_nodes}
        missing = [name for name in own.values() if name not in self._at]
        if missing:
            raise fail(
                "link-not-opened",
                f"{', '.join(f'`{name}`' for name in missing)} has no endpoint",
                help="name one in the deployment, under `links: {endpoints: ...}`",
            )
        for name in own.values():
            if (rejection := rejection_of(self._at[name])) is not None:
                raise fail(
                    "link-not-opened",
                    f"the endpoint `{self._at[name]}` of `{name}` {rejection.why}",
                    help=rejection.fix,
                )
        if keys is None and not event_map.is_insecure:
            _reject_remote(bind or self._at[node], node)
            for name in own.values():
                _reject_remote(self._at[name], name)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.not_granted = self._scheduling.apply_to(self._context)
        """The settings of priority and processors that the system rejected, with the reason."""
        self._authenticator: ThreadAuthenticator | None = None
        self._most = TOGETHER if is_deterministic else 4 * slots
        self._stop = threading.Event()
        self._work = threading.Semaphore(0)
        self._turn = threading.Lock()
        self._threads: list[threading.Thread] = []
        self._nodes_by_key: dict[str, int] = {}
        try:
            self._keys = {} if keys is None else self._read_keys(keys)
            self._publisher = self._publish_at(bind or self._at[node])
            self._subscribers = {
                place: self._subscribe(place) for place in own if place != self.node
            }
        except (zmq.ZMQError, OSError, ValueError) as error:
            self.close()
            raise fail(
                "link-not-opened",
                f"the link of `{node}` cannot be opened: {error}",
                help="choose a free endpoint of this computer, and make the keys of all nodes",
            ) from error
        for run in (self._keep_on,) if is_deterministic else (self._send_on, self._receive_on):
            thread = threading.Thread(
                target=self._run_scheduled, args=(run,), name=f"link of {node}", daemon=True
            )
            thread.start()
            self._threads.append(thread)

    # --- opening and closing -----------------------------------------------------------------

    def _read_keys(self, folder: Path) -> dict[str, tuple[bytes, bytes | None]]:
        places = {self.map.nodes[place]: place for place in self.map.own_nodes}
        found = {name: zmq.auth.load_certificate(folder / f"{name}.key") for name in places}
        own = self.map.nodes[self.node]
        self._nodes_by_key = {key.decode(): places[name] for name, (key, _) in found.items()}
        found[own] = zmq.auth.load_certificate(folder / f"{own}.key_secret")
        self._authenticator = ThreadAuthenticator(self._context)
        self._authenticator.start()
        self._authenticator.configure_curve_callback("fsm", _Known({k for k, _ in found.values()}))
        return found

    def _socket(self, kind: int) -> zmq.Socket[bytes]:
        socket = self._context.socket(kind)
        for option, value in OPTIONS.items():
            socket.setsockopt(option, value)
        if self._keys:
            public, secret = self._keys[self.map.nodes[self.node]]
            socket.curve_publickey, socket.curve_secretkey = public, secret or b""
        return socket

    def _publish_at(self, endpoint: str) -> zmq.Socket[bytes]:
        socket = self._socket(zmq.ROUTER)
        socket.setsockopt(zmq.LINGER, LINGER)
        socket.setsockopt(zmq.SNDHWM, self._most)
        socket.setsockopt(zmq.RCVHWM, WAITING)
        socket.setsockopt(zmq.MAXMSGSIZE, SMALL)
        socket.setsockopt(zmq.ROUTER_MANDATORY, 1)  # it reports when a listener has gone
        if self._keys:
            socket.curve_server = True
            socket.zap_domain = b"fsm"
        self._gate = Gate(self._context, socket)
        socket.bind(endpoint)
        return socket

    def _subscribe(self, place: int) -> zmq.Socket[bytes]:
        name = self.map.nodes[place]
        socket = self._socket(zmq.DEALER)
        socket.setsockopt(zmq.LINGER, 0)
        socket.setsockopt(zmq.SNDHWM, 1)
        socket.setsockopt(zmq.RCVHWM, TOGETHER)
        socket.setsockopt(zmq.MAXMSGSIZE, max(SMALL, self.codec.largest))
        if self._keys:
            socket.curve_serverkey = self._keys[name][0]
        socket.connect(self._at[name])
        return socket

    def close(self) -> None:
        """End the threads and close the sockets; waiting frames have `LINGER` ms."""
        super().close()
        self._stop.set()
        self._work.release()
        for thread in self._threads:
            thread.join()
        self._threads.clear()
        if self._gate is not None:
            self._gate.close()
            self._gate = None
        if self._authenticator is not None:
            self._authenticator.stop()
            self._authenticator = None
        self._context.destroy()  # each socket with the linger that it has

    @property
    def dropped(self) -> int:
        """The connections to this node that its gate has ended."""
        return 0 if self._gate is None else self._gate.dropped

    # --- listeners -----------------------------------------------------------------------------

    def _see_listeners(self) -> None:
        now = time.monotonic()
        self._is_flooded = not self._process_hellos(now)
        self._known.pass_time(now)
        if self._gate is not None:
            self._gate.look(now)

    def _process_hellos(self, now: float) -> bool:
        """Process received hellos, but not endlessly: a flood must not hold this thread.

        Returns whether all were processed.
        """
        with suppress(zmq.Again):
            for _ in range(PARTS):
                part = self._publisher.recv(zmq.NOBLOCK, copy=False)
                if (heard := self._heard.take(part)) is not None:
                    self._see_listener(*heard, now)
            return False
        return True

    def _see_listener(self, route: bytes, said: zmq.Frame, now: float) -> None:
        key_of = None
        if self._keys:
            key_of = self._nodes_by_key.get(str(said.get("User-Id")), -1)
        node = self._known.receive(said.bytes, route, key_of, now)
        if node is not None and self._gate is not None:
            self._gate.assign(int(said.get(zmq.SRCFD)), node)

    def _say_hello(self) -> None:
        now = time.monotonic()
        for place, socket in self._subscribers.items():
            said, echo = self._said[place]
            heard = self._known.heard[place]
            if now - said < HELLO_EVERY and echo == heard:
                continue
            with suppress(zmq.Again):
                socket.send(self._known.hello(place), zmq.NOBLOCK)
                self._said[place] = now, heard

    def wait_listeners(self, timeout: float) -> None:
        """Block until all other nodes listen; `LinkTimeout` after so many seconds."""
        until = time.monotonic() + timeout
        for node in self._subscribers:
            while node not in self._known.listeners:
                if time.monotonic() >= until:
                    own, name = self.map.nodes[self.node], self.map.nodes[node]
                    raise LinkTimeout(f"node `{own}` waited {timeout} s for `{name}` to listen")
                time.sleep(0.001)

    # --- carrying ----------------------------------------------------------------------------

    def _send_all(self) -> None:
        self._see_listeners()
        while (frame := self.next_frame()) is not None:
            for node, listener in list(self._known.listeners.items()):
                self._send_to(node, listener.route, frame)

    def _send_to(self, node: int, route: bytes, frame: bytes) -> None:
        try:
            self._publisher.send(route, zmq.NOBLOCK | zmq.SNDMORE)
            self._publisher.send(frame, zmq.NOBLOCK)
        except zmq.Again:
            return  # no room: it counts the frame as lost
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            self._known.forget(node)

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
            while True:
                left = until - time.monotonic()
                if socket.poll(int(max(0.0, min(PATROL, left)) * 1000)):
                    if self._take_part(node, socket):
                        return True
                elif left <= 0:
                    return False
                if left <= 0:
                    return False
                self._use_sockets()

    def _take_part(self, node: int, socket: zmq.Socket[bytes], flags: int = 0) -> bool:
        """Receive a part of a peer's message; a frame has only one. Whether it was a frame."""
        content = socket.recv(flags)
        was_within, self._within[node] = self._within[node], bool(socket.rcvmore)
        is_whole = not was_within and not self._within[node]
        return self.receiver.arrive(node, content if is_whole else b"")

    # --- threads -----------------------------------------------------------------------------

    def _run_scheduled(self, run: Callable[[], None]) -> None:
        self._scheduling.apply()  # its rejections were reported by the trial for ZeroMQ's threads
        run()

    def _keep_on(self) -> None:
        while not self._stop.wait(0 if self._is_flooded else PATROL):
            with self._turn:
                self._use_sockets()

    def _use_sockets(self) -> None:
        self._see_listeners()
        self._say_hello()

    def _send_on(self) -> None:
        while not self._stop.is_set():
            if not self._is_flooded:
                self._work.acquire(timeout=PATROL)
            self._send_all()

    def _receive_on(self) -> None:
        poller = zmq.Poller()
        places = {socket: place for place, socket in self._subscribers.items()}
        for socket in places:
            poller.register(socket, zmq.POLLIN)
        while not self._stop.is_set():
            self._say_hello()
            patrol = 1 if self.receiver.faults is not None else int(PATROL * 1000)
            for socket, _ in poller.poll(patrol):
                self._take_some(places[socket], socket)
            self.receiver.pass_time()

    def _take_some(self, node: int, socket: zmq.Socket[bytes]) -> None:
        with suppress(zmq.Again):
            for _ in range(self.receiver.events.capacity):
                self._take_part(node, socket, zmq.NOBLOCK)


def _reject_remote(endpoint: str, node: str) -> None:
    """Reject an endpoint beyond this computer; for links without keys."""
    if not is_loopback(endpoint):
        raise fail(
            "link-not-opened",
            f"`{endpoint}` of `{node}` is not of this computer only, and there are no keys: "
            "anybody who reaches it could listen, and impersonate any node",
            help="make keys and name their folder, or write `insecure: true` under `links:`",
        )


class _PartReader:
    """Joins the parts of a message to the publisher: a route, and one part."""

    def __init__(self) -> None:
        self._route = b""
        self._count = 0

    def take(self, part: zmq.Frame) -> tuple[bytes, zmq.Frame] | None:
        """Return route and content with the last part of a message that has just these."""
        place, self._count = self._count, self._count + 1 if part.more else 0
        if place == 0:
            self._route = part.bytes
        elif place == 1 and not part.more:
            return self._route, part
        return None


class _Known:
    """Decides for the authenticator which nodes may listen."""

    def __init__(self, keys: set[bytes]) -> None:
        self._keys = keys

    def callback(self, domain: str, key: bytes) -> bool:  # noqa: ARG002  (the protocol of pyzmq)
        """Whether a client's key is one of a node."""
        return key in self._keys
