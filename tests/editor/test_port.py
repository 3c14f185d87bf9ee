"""`fsmkit lsp` at a port: it serves one editor, and nobody else."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from fsmkit.cli import execute

INITIALIZE = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {"processId": None, "rootUri": None, "capabilities": {}},
}
WAIT = 60
"""Seconds; only a server that hangs needs them."""
NO_FRAMES = {
    "a web page that posts": b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n\r\n{}",
    "a web socket": b"GET / HTTP/1.1\r\nUpgrade: websocket\r\n\r\n",
    "a length of 5,000 digits": b"Content-Length: " + b"9" * 5_000 + b"\r\n\r\n",
    "a length of 9 GB": b"Content-Length: 9999999999\r\n\r\n",
    "two lengths": b"Content-Length: 2\r\nContent-Length: 2\r\n\r\n{}",
    "a negative length": b"Content-Length: -2\r\n\r\n{}",
    "no header": b"\x00\xff" * 2_000,
}
NO_REQUESTS: dict[str, tuple[bytes, int]] = {
    "no JSON": (b"{", -32700),
    "deep nesting": (b"[" * 100_000, -32700),
    "not UTF-8": (b'{"jsonrpc": "2.0", "id": "\xff"}', -32700),
    "no object": (b"[]", -32700),
    "no protocol": (b'{"id": 7}', -32700),
    "hover without parameters": (
        b'{"jsonrpc": "2.0", "id": 7, "method": "textDocument/hover"}',
        -32602,
    ),
    "hover without a position": (
        b'{"jsonrpc": "2.0", "id": 7, "method": "textDocument/hover", "params": {"position": {}}}',
        -32602,
    ),
    "an unknown method": (b'{"jsonrpc": "2.0", "id": 7, "method": "x/y", "params": null}', -32601),
    "a method that is no text": (b'{"jsonrpc": "2.0", "id": 7, "method": {}}', -32603),
}


def framed(body: bytes) -> bytes:
    return b"Content-Length: %d\r\n\r\n%b" % (len(body), body)


class Client:
    """A connection to the server."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=WAIT)
        self.file = self.socket.makefile("rb")

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def receive(self) -> Any:
        """Return the next message."""
        length = 0
        while (line := self.file.readline()) != b"\r\n":
            assert line, "the server closed the connection"
            if line.startswith(b"Content-Length:"):
                length = int(line.split(b":")[1])
        return json.loads(self.file.read(length))

    def is_dropped(self) -> bool:
        """Wait for the server to close the connection."""
        try:
            return self.file.read() == b""
        except ConnectionError:
            return True

    def close(self) -> None:
        self.file.close()
        self.socket.close()


Server = tuple[subprocess.Popen[bytes], int]


@pytest.fixture
def server() -> Iterator[Server]:
    command = [sys.executable, "-m", "fsmkit", "lsp", "--tcp", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            printed = "".join(process.stdout.readline().decode() for _ in range(3))
            yield process, json.loads(printed)["port"]
        finally:
            process.kill()


@pytest.mark.cc
def test_only_frames_of_the_first_editor_are_read(server: Server) -> None:
    process, port = server
    for name, data in NO_FRAMES.items():
        stranger = Client(port)
        stranger.send(data)
        assert stranger.is_dropped(), name
        stranger.close()
    editor = Client(port)
    editor.send(framed(json.dumps(INITIALIZE).encode()))
    assert editor.receive()["id"] == 1
    second = Client(port)
    assert second.is_dropped()
    second.close()
    editor.send(framed(b'{"jsonrpc": "2.0", "id": 2, "method": "shutdown"}'))
    assert editor.receive() == {"jsonrpc": "2.0", "id": 2, "result": None}
    editor.close()
    assert process.wait(WAIT) == 0


@pytest.mark.cc
def test_bad_requests_get_error_responses_and_the_server_goes_on(server: Server) -> None:
    process, port = server
    editor = Client(port)
    editor.send(framed(json.dumps(INITIALIZE).encode()))
    assert "result" in editor.receive()
    for name, (body, code) in NO_REQUESTS.items():
        editor.send(framed(body))
        assert editor.receive()["error"]["code"] == code, name
    editor.send(framed(b'{"jsonrpc": "2.0", "id": 8, "method": "shutdown"}'))
    assert editor.receive()["id"] == 8
    editor.close()
    assert process.wait(WAIT) == 0


def test_json_without_a_port_is_a_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["lsp", "--json"]) == 2
    assert "--json needs --tcp" in capsys.readouterr().err
