"""Serve a hub on one port: the page over HTTP, messages over a WebSocket.

By default it binds to the loopback. A client must know the token in the page's address, have the
page as `Origin` and one of our names as `Host` (against DNS rebinding), and speak `fsmkit.live.1`.
A step never waits for a client: a slow client loses messages, gets their number, and then the
whole state.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Self
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.commands import MOST_BYTES
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.page import Page, page
from fsmkit.inspector.watching import Watcher
from fsmkit.runtime.live.messages import SUBPROTOCOL, Lost, to_json

LOOPBACK = ("127.0.0.1", "::1")
GATHERED = 0.016
"""Seconds from one message to the next, about a picture of a screen: others are gathered."""
MOST_CLIENTS = 8
MOST_COMMANDS = 200
"""Commands of a client in a second; it waits with more."""
MOST_BEHIND = 4_000_000
"""Maximum size of a client's queue in bytes; beyond it, messages except responses are lost."""
PATIENCE = 5.0
"""Seconds after the last read during which a queue may be four times as long.

The client of a busy computer then gets everything. A slow client would only see old steps."""
ANSWERS = (b'{"k":"done"', b'{"k":"refused"', b'{"k":"chart"')
"""Prefix of responses. A chart may exceed `MOST_BEHIND`; a client that does not read is ignored."""
MOST_DRAWINGS = 16
"""Drawings that a client waits for; with more it waits."""
PATH = "/live"
_silent = logging.getLogger("fsmkit.inspector.server")
"""Logger without output: failed connections of strangers are not shown on the terminal."""
_silent.addHandler(logging.NullHandler())
_silent.propagate = False


@dataclass(slots=True)
class _Outbox:
    """The queue of messages for a client."""

    texts: list[bytes] = field(default_factory=list)
    size: int = 0
    """Size of the messages that are not responses, in bytes."""
    answered: int = 0
    """Bytes of answers."""
    lost: int = 0
    last: float = field(default_factory=time.monotonic)
    """When something was taken."""
    wake: asyncio.Event = field(default_factory=asyncio.Event)
    taken: asyncio.Event = field(default_factory=asyncio.Event)
    is_over: bool = False
    """The client has left: messages are dropped, and no thread waits."""

    def put(self, text: bytes) -> None:
        if self.is_over:
            return
        if text.startswith(ANSWERS):
            self.answered += len(text)
        else:
            if self.size + len(text) > self.most and self.size:
                self.lost += self.drop()
            self.size += len(text)
        self.texts.append(text)
        self.wake.set()

    @property
    def most(self) -> int:
        """The bytes that may wait now."""
        is_late = time.monotonic() - self.last > PATIENCE
        return MOST_BEHIND if is_late else 4 * MOST_BEHIND

    def drop(self) -> int:
        """Discard all messages that are not responses; return their number."""
        kept = [text for text in self.texts if text.startswith(ANSWERS)]
        count = len(self.texts) - len(kept)
        self.texts, self.size = kept, 0
        return count

    async def has_room(self) -> None:
        """Wait until not too many answers wait."""
        while self.answered > MOST_BEHIND and not self.is_over:
            self.taken.clear()
            await self.taken.wait()

    def take(self) -> bytes:
        """Return all queued messages as one array."""
        text = b"[" + b",".join(_inner(text) for text in self.texts) + b"]"
        self.texts.clear()
        self.size = self.answered = 0
        self.last = time.monotonic()
        self.taken.set()
        return text

    def close(self) -> None:
        """Discard the queue and wake its waiting thread: the client has left."""
        self.is_over = True
        self.take()


def _inner(text: bytes) -> bytes:
    """Return the messages of a text: of an array without its brackets."""
    return text[1:-1] if text.startswith(b"[") else text


class LiveServer:
    """Serves a hub.

    Args:
        hub: The hub to serve.
        host: The address to bind to; by default both loopbacks.
        port: The port; 0 for any free one.
        origins: Other origins whose pages may connect.
        is_readonly: Whether commands of clients are rejected.
        page: Returns the page.

    """

    def __init__(
        self,
        hub: Hub,
        *,
        host: str | None = None,
        port: int = 0,
        origins: Iterable[str] = (),
        is_readonly: bool = False,
        page: Callable[[], Page] = page,
    ) -> None:
        self.hub = hub
        self._made_page = page
        self.token = secrets.token_hex(16)
        self.port = port
        self._host = host
        self._origins = tuple(origins)
        self.is_readonly = is_readonly
        self._clients = 0
        self._drawing = asyncio.Lock()
        self._servers: list[Server] = []

    @property
    def address(self) -> str:
        """The address of the page; its token follows `#`, which no browser sends."""
        host = self._host or LOOPBACK[0]
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/#{self.token}"

    async def __aenter__(self) -> Self:
        hosts = LOOPBACK if self._host is None else (self._host,)
        for number, host in enumerate(hosts):
            try:
                server = await serve(
                    self._follow,
                    host,
                    self.port,
                    process_request=self._answer,
                    subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
                    max_size=MOST_BYTES,
                    max_queue=16,
                    compression=None,
                    logger=_silent,
                )
            except OSError as error:
                if number:  # there may be no IPv6
                    continue
                raise _not_bound(host, self.port, error) from error
            self._servers.append(server)
            self.port = next(iter(server.sockets)).getsockname()[1]
        return self

    async def __aexit__(self, *_: object) -> None:
        for server in self._servers:
            server.close()
            await server.wait_closed()

    async def run(self) -> None:
        """Let real time pass for the hub until it is cancelled."""
        await run_clock(self.hub)

    # --- HTTP ----------------------------------------------------------------------------------

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Respond to an HTTP request; return None for a valid WebSocket request."""
        try:
            where = urlsplit(request.path)
        except ValueError:  # `http://[::1` is not an address
            return _reject(connection, HTTPStatus.BAD_REQUEST, "the address is wrong")
        if _only(request, "Host") not in self._hosts():
            return _reject(connection, HTTPStatus.FORBIDDEN, "this host is not served here")
        if where.path == "/":
            return self._page(connection)
        if where.path != PATH:
            return _reject(connection, HTTPStatus.NOT_FOUND, "there is nothing")
        given = parse_qs(where.query).get("token", [""])[0]
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            return _reject(connection, HTTPStatus.FORBIDDEN, "the token is wrong")
        origin = _only(request, "Origin")
        if origin is not None and origin not in self._known_origins():
            return _reject(connection, HTTPStatus.FORBIDDEN, "the origin is wrong")
        wanted = ",".join(request.headers.get_all("Sec-WebSocket-Protocol"))
        if SUBPROTOCOL not in (each.strip() for each in wanted.split(",")):
            return _reject(connection, HTTPStatus.BAD_REQUEST, f"speak {SUBPROTOCOL}")
        if self._clients >= MOST_CLIENTS:
            return _reject(connection, HTTPStatus.SERVICE_UNAVAILABLE, "there are too many")
        return None

    def _page(self, connection: ServerConnection) -> Response:
        made = self._made_page()
        response = connection.respond(HTTPStatus.OK, "")
        response.body = made.text
        del response.headers["Content-Length"], response.headers["Content-Type"]
        for name, value in (
            ("Content-Type", "text/html; charset=utf-8"),
            ("Content-Length", str(len(made.text))),
            ("Content-Security-Policy", made.policy),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cache-Control", "no-store"),
        ):
            response.headers[name] = value
        return response

    def _hosts(self) -> tuple[str, ...]:
        names = ("127.0.0.1", "localhost", "[::1]")
        own = (*names, *((self._host,) if self._host else ()))
        return tuple(f"{name}:{self.port}" for name in own) + tuple(
            urlsplit(origin).netloc for origin in self._origins
        )

    def _known_origins(self) -> tuple[str, ...]:
        return (*(f"http://{host}" for host in self._hosts()), *self._origins)

    # --- WebSocket -----------------------------------------------------------------------------

    async def _follow(self, connection: ServerConnection) -> None:
        """Serve a client until it leaves."""
        if self._clients >= MOST_CLIENTS:
            await connection.close(1013, "there are too many")
            return
        self._clients += 1
        outbox = _Outbox()
        client = self.hub.join(outbox.put, may_command=not self.is_readonly)
        sending = asyncio.create_task(self._send(connection, outbox, client))
        try:
            await self._listen(connection, client, outbox)
        finally:
            sending.cancel()
            with suppress(asyncio.CancelledError, ConnectionClosed):
                await sending
            self.hub.leave(client)
            self._clients -= 1

    async def _listen(self, connection: ServerConnection, client: int, outbox: _Outbox) -> None:
        """Obey a client, so many commands in a second."""
        begin, count = time.monotonic(), 0
        drawing: set[asyncio.Task[None]] = set()
        with suppress(ConnectionClosed):
            async for text in connection:
                now = time.monotonic()
                if now - begin >= 1:
                    begin, count = now, 0
                count += 1
                if count > MOST_COMMANDS:
                    await asyncio.sleep(begin + 1 - now)
                await outbox.has_room()
                if self.hub.drawing(text) is None:
                    self.hub.receive(client, text)
                    continue
                drawing = {task for task in drawing if not task.done()}
                if len(drawing) >= MOST_DRAWINGS:
                    await asyncio.wait(drawing, return_when=asyncio.FIRST_COMPLETED)
                drawing.add(asyncio.create_task(self._draw(client, text)))
        for task in drawing:
            task.cancel()

    async def _draw(self, client: int, text: str | bytes) -> None:
        """Execute a command once Graphviz has laid out its drawing, without blocking others."""
        async with self._drawing:  # one drawing at a time
            if (draw := self.hub.drawing(text)) is not None:  # no other client has drawn it
                await asyncio.to_thread(draw)
        self.hub.receive(client, text)

    async def _send(self, connection: ServerConnection, outbox: _Outbox, client: int) -> None:
        sent = 0.0
        with suppress(ConnectionClosed):
            while True:
                await outbox.wake.wait()
                await asyncio.sleep(max(0.0, sent + GATHERED - time.monotonic()))
                outbox.wake.clear()
                sent = time.monotonic()
                if outbox.lost:
                    lost, outbox.lost = outbox.lost, 0
                    outbox.drop()
                    at, n = self.hub.at, self.hub.n
                    outbox.put(to_json(Lost(n=n, at=at, count=lost, where="client")))
                    self.hub.welcome(client)
                await connection.send(outbox.take(), text=True)
        outbox.close()


async def run_clock(hub: Hub) -> None:
    """Let real time pass for a hub until it is cancelled."""
    last = time.monotonic_ns()
    while True:
        await asyncio.sleep(0 if hub.wants_more else GATHERED)
        now = time.monotonic_ns()
        hub.advance((now - last) // 1000)
        last += (now - last) // 1000 * 1000


def _only(request: Request, name: str) -> str | None:
    """Return a header, None if it is missing, or an invalid name if there are several."""
    found = request.headers.get_all(name)
    return found[0] if len(found) == 1 else "" if found else None


def _reject(connection: ServerConnection, status: HTTPStatus, text: str) -> Response:
    return connection.respond(status, f"{text}\n")


def _not_bound(host: str, port: int, error: OSError) -> FsmkitError:
    return fail(
        "port-not-free",
        f"port {port} of `{host}` cannot be served: {error.strerror or error}",
        help="choose another one with `--port`, or none for any that is free",
    )


async def serve_hub(
    server: LiveServer,
    ready: Callable[[str], None],
    *,
    stop: asyncio.Event | None = None,
    watcher: Watcher | None = None,
) -> None:
    """Serve until the task is cancelled or ``stop`` is set; ``ready`` is given the address."""
    async with server:
        ready(server.address)
        tasks = [asyncio.create_task(server.run())]
        if watcher is not None:
            tasks.append(asyncio.create_task(watcher.run()))
        waiting = asyncio.create_task((stop or asyncio.Event()).wait())
        try:
            await asyncio.wait((*tasks, waiting), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (*tasks, waiting):
                task.cancel()
        for task in tasks:
            if task.done() and not task.cancelled():
                task.result()
