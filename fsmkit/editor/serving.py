"""The language server on standard input and output, or on a port of the loopback."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from collections.abc import Callable
from typing import Any

from pygls.exceptions import JsonRpcException, JsonRpcInternalError, JsonRpcParseError
from pygls.io_ import StdoutWriter

from fsmkit.diagnostics import fail
from fsmkit.editor.server import Server, make_server
from fsmkit.inspector.dap.framing import BrokenFrameError, Frames, decode_body, frame
from fsmkit.inspector.dap.serving import MOST_READ, Read, read_in_thread

LOOPBACK = "127.0.0.1"
MOST_BYTES = 64_000_000
"""Bytes of a message: an editor sends whole files."""
log = logging.getLogger("pygls.server")


def serve_stdio() -> None:
    """Serve the editor that started this process until it exits.

    All other output of this process goes to standard error, so that it cannot mix with messages.
    """
    logging.getLogger("pygls").setLevel(logging.CRITICAL)
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    server = make_server()
    server.protocol.set_writer(StdoutWriter(out))

    async def serve() -> None:
        await _converse(read_in_thread(sys.stdin.fileno()), server)

    try:
        asyncio.run(serve())
    except (BrokenPipeError, KeyboardInterrupt, SystemExit):
        pass  # the editor is gone
    finally:
        server.shutdown()  # type: ignore[no-untyped-call]


def serve_tcp(port: int, announce: Callable[[int], None] | None = None) -> None:
    """Serve one editor on a port of this machine until it disconnects.

    Args:
        port: The port; 0 for any free one.
        announce: Called with the port as soon as an editor can connect.

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
    """Serve the first client that sends a message; reject other connections.

    Every web page can connect to this port, but no browser sends the header of the protocol. Such
    a client is disconnected, and the server waits for the editor.
    """
    server = make_server()
    serving: set[asyncio.StreamWriter] = set()
    done = asyncio.Event()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if serving:
            writer.close()
            return
        serving.add(writer)
        server.protocol.set_writer(writer)
        is_editor = False
        try:
            is_editor = await _converse(lambda: reader.read(MOST_READ), server)
        finally:
            serving.discard(writer)
            writer.close()
        if is_editor:
            done.set()

    listening = await asyncio.start_server(connected, LOOPBACK, port)
    if announce is not None:
        announce(listening.sockets[0].getsockname()[1])
    async with listening:
        await done.wait()
    server.shutdown()  # type: ignore[no-untyped-call]


async def _converse(read: Read, server: Server) -> bool:
    """Pass messages to the server until the client is gone; return whether there were any.

    A client that sends anything but frames of the protocol is dropped, since nothing shows where
    its next message starts.
    """
    frames, is_editor = Frames(MOST_BYTES), False
    try:
        while data := await read():
            for body in frames.feed(data):
                is_editor = True
                _receive(body, server)
    except ConnectionError:
        pass  # the client is gone without a word
    except BrokenFrameError as error:
        sys.stderr.write(f"the client is disconnected, because it sent {error}\n")
    return is_editor


def _receive(body: bytes, server: Server) -> None:
    """Handle a message; an unreadable message gets an error response."""
    number: object = None
    try:
        message = _object(body)
        number = message.get("id")
        server.protocol.handle_message(server.protocol.structure_message(message))
    except JsonRpcException as error:
        _reject(server, number, error)
    except Exception as error:
        log.exception("a message could not be handled")
        _reject(server, number, JsonRpcInternalError(f"{type(error).__name__}: {error}"))


def _object(body: bytes) -> dict[str, Any]:
    try:
        message = decode_body(body)
    except ValueError as error:
        raise JsonRpcParseError(f"the message is not JSON: {error}") from error
    if not isinstance(message, dict) or message.get("jsonrpc") != "2.0":
        raise JsonRpcParseError("the message is not a JSON-RPC 2.0 object")
    return message


def _reject(server: Server, number: object, error: JsonRpcException) -> None:
    """Send an error response; a notification, which has no id, gets none (JSON-RPC 2.0, 4.1)."""
    is_notification = number is None and not isinstance(error, JsonRpcParseError)
    if is_notification or server.protocol.writer is None:
        return
    response = {"code": error.code, "message": error.message}
    server.protocol.writer.write(frame({"jsonrpc": "2.0", "id": number, "error": response}))
