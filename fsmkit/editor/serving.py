"""The server behind standard input and output, or behind a port of the loopback."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from threading import Event

from pygls.io_ import run_async

from fsmkit.diagnostics import fail
from fsmkit.editor.server import make_server

LOOPBACK = "127.0.0.1"


def serve_stdio() -> None:
    """Serve the editor that started this process until it says that it goes, or is gone.

    Whatever else is printed in this process goes to standard error: nothing gets between messages.
    """
    logging.getLogger("pygls").setLevel(logging.ERROR)
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    make_server().start_io(sys.stdin.buffer, out)


def serve_tcp(port: int, announce: Callable[[int], None] | None = None) -> None:
    """Serve an editor at a port of this machine until it goes.

    Args:
        port: The port; 0 for any that is free.
        announce: Is called with the port as soon as an editor can connect.

    Raises:
        FsmkitError: ``port-not-free`` where the port cannot be served.

    """
    try:
        asyncio.run(_serve_port(port, announce))
    except OSError as error:
        raise fail(
            "port-not-free",
            f"port {port} of `{LOOPBACK}` cannot be served: {error.strerror or error}",
            help="choose another one, or 0 for any that is free",
        ) from error


async def _serve_port(port: int, announce: Callable[[int], None] | None) -> None:
    """Do what `start_tcp` of pygls does, which does not say at which port it listens."""
    server = make_server()
    stop = Event()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        server.protocol.set_writer(writer)
        with suppress(ConnectionError):  # the editor is gone without a word
            await run_async(
                stop_event=stop,
                reader=reader,
                protocol=server.protocol,
                logger=logging.getLogger("pygls.server"),
                error_handler=server.report_server_error,
            )
        listening.close()
        server.shutdown()  # type: ignore[no-untyped-call]

    listening = await asyncio.start_server(connected, LOOPBACK, port)
    if announce is not None:
        announce(listening.sockets[0].getsockname()[1])
    async with listening:
        with suppress(asyncio.CancelledError):  # it was closed
            await listening.serve_forever()
