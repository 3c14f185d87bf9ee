"""Adapters behind streams: standard input and output, or connections to a port of the loopback."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack, suppress
from typing import Self

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.inspector.dap.adapter import Adapter
from fsmkit.inspector.dap.framing import BrokenFrameError, Frames, frame
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LOOPBACK, LiveServer, run_clock

MOST_READ = 65_536
MOST_EDITORS = 8
"""Maximum number of connections."""
Read = Callable[[], Awaitable[bytes]]
"""Returns the received bytes; empty at the end."""
Write = Callable[[bytes], Awaitable[None]]


async def converse(read: Read, write: Write, page: LiveServer | None = None) -> None:
    """Talk to an editor until it disconnects or is gone.

    ``page``: the server of a session that runs already, which the editor may `attach` to.
    """
    out, woken = bytearray(), asyncio.Event()
    adapter = Adapter(
        lambda message: out.extend(frame(message)),
        hub=None if page is None else page.hub,
        may_command=page is None or not page.is_readonly,
        wakes=woken.set,
    )
    frames, clock = Frames(), None
    reading, waking = asyncio.ensure_future(read()), asyncio.ensure_future(woken.wait())
    async with AsyncExitStack() as pages:
        try:
            while not adapter.is_over:
                await asyncio.wait((reading, waking), return_when=asyncio.FIRST_COMPLETED)
                if waking.done():
                    woken.clear()
                    waking = asyncio.ensure_future(woken.wait())
                    adapter.look()
                if reading.done():
                    data = reading.result()
                    if not data:
                        break
                    _take(adapter, frames, data)
                    reading = asyncio.ensure_future(read())
                if adapter.page_wanted is not None:
                    page = page or await _page(adapter.page_wanted, pages, adapter)
                    if page is not None:
                        adapter.page_served(page.address)
                if adapter.hub is not None and clock is None:
                    clock = asyncio.ensure_future(run_clock(adapter.hub))
                text = bytes(out)
                out.clear()
                await write(text)
                if clock is not None and clock.done():
                    clock.result()  # raises
        except OSError:
            pass  # the editor is gone
        finally:
            adapter.close()
            for task in (reading, waking, clock):
                if task is not None:
                    task.cancel()


def _take(adapter: Adapter, frames: Frames, data: bytes) -> None:
    try:
        for body in frames.feed(data):
            adapter.receive(body)
            if adapter.is_over:
                return
    except BrokenFrameError as error:
        adapter.broken(str(error))


async def _page(hub: Hub, pages: AsyncExitStack, adapter: Adapter) -> LiveServer | None:
    """Serve a page as long as the editor is there."""
    try:
        return await pages.enter_async_context(LiveServer(hub))
    except FsmkitError as error:
        adapter.page_served(error)
        return None


# --- standard input and output ----------------------------------------------------------------


def read_in_thread(source: int) -> Read:
    """Return a function that reads a file descriptor without blocking the running event loop.

    A daemon thread reads, since no event loop waits for files on every system, and a process ends
    without waiting for such a thread.
    """
    loop = asyncio.get_running_loop()
    chunks: asyncio.Queue[bytes] = asyncio.Queue(4)

    def pump() -> None:
        with suppress(RuntimeError):  # the loop is closed
            while True:
                try:
                    data = os.read(source, MOST_READ)
                except OSError:
                    data = b""
                asyncio.run_coroutine_threadsafe(chunks.put(data), loop).result()
                if not data:
                    return

    threading.Thread(target=pump, daemon=True).start()
    return chunks.get


async def serve_stdio(source: int, target: int) -> None:
    """Serve the editor that started this process; ``source``, ``target``: file descriptors."""

    async def write(data: bytes) -> None:
        if data:
            await asyncio.to_thread(_write_all, target, data)

    await converse(read_in_thread(source), write)


def _write_all(target: int, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(target, left) :]


# --- a port -----------------------------------------------------------------------------------


class PortServer:
    """Listens on the loopback; each connection starts a session, or joins that of a page.

    Args:
        port: The port; 0 for any free one.
        page: The server of a running session.

    """

    def __init__(self, port: int = 0, *, page: LiveServer | None = None) -> None:
        self.port = port
        self._page = page
        self._editors: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None

    async def __aenter__(self) -> Self:
        host = LOOPBACK[0]
        try:
            self._server = await asyncio.start_server(self._meet, host, self.port)
        except OSError as error:
            raise fail(
                "port-not-free",
                f"port {self.port} of `{host}` cannot be served: {error.strerror or error}",
                help="choose another one, or 0 for any that is free",
            ) from error
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._server is not None:
            self._server.close()
        for task in tuple(self._editors):
            task.cancel()
        await asyncio.gather(*self._editors, return_exceptions=True)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is None or len(self._editors) >= MOST_EDITORS:
            writer.close()
            return

        async def write(data: bytes) -> None:
            writer.write(data)
            await writer.drain()

        self._editors.add(task)
        try:
            await converse(lambda: reader.read(MOST_READ), write, self._page)
        finally:
            self._editors.discard(task)
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()
