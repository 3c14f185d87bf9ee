"""The server behind standard input and output, or behind a port of the loopback."""

from __future__ import annotations

import logging
import os
import sys

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


def serve_tcp(port: int) -> None:
    """Serve one editor after the other at a port of this machine.

    Raises:
        FsmkitError: ``port-not-free`` where the port cannot be served.

    """
    try:
        make_server().start_tcp(LOOPBACK, port)
    except OSError as error:
        raise fail(
            "port-not-free",
            f"port {port} of `{LOOPBACK}` cannot be served: {error.strerror or error}",
            help="choose another one, or 0 for any that is free",
        ) from error
