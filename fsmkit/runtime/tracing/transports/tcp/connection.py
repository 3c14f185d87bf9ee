"""Bytes of a connection over TCP."""

from __future__ import annotations

import socket

from fsmkit.runtime.tracing.transports import MOST_READ, ended, wrong_endpoint

SECONDS = 5.0
"""To connect in."""
MOST_PORT = 65535


class TcpSource:
    """A connection."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        self._connection, self._name = connection, name
        connection.setblocking(False)

    def read(self) -> bytes | None:
        """Return the bytes that have arrived; None if the server closed the connection."""
        try:
            return self._connection.recv(MOST_READ) or None
        except BlockingIOError:
            return b""
        except OSError as error:
            raise ended(f"the connection to {self._name} broke: {error.strerror}") from error

    def close(self) -> None:
        """Close it."""
        self._connection.close()


def connect(scheme: str, address: str) -> TcpSource:
    """Connect to ``HOST:PORT``; `FsmkitError` where that fails."""
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isascii() or not port.isdecimal():
        raise wrong_endpoint(f"`{address}` is not an address", f"use {scheme}:HOST:PORT")
    if not 0 < int(port) <= MOST_PORT:
        raise wrong_endpoint(f"the port {port} is not between 1 and 65535", f"use 1 to {MOST_PORT}")
    try:
        connection = socket.create_connection((host.strip("[]"), int(port)), SECONDS)
    except (OSError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise ended(f"cannot connect to {address}: {why}") from error
    return TcpSource(connection, address)
