"""Editors over standard input and output, and over a port."""

from __future__ import annotations

import asyncio
import json
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.dap import serving
from fsmkit.inspector.dap.framing import Frames, frame
from fsmkit.inspector.dap.serving import PortServer
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer
from tests.inspector.dap.editor import Json

STDIO = [sys.executable, "-m", "fsmkit", "dap"]


def requests(*asked: tuple[str, Json]) -> bytes:
    """Return requests as bytes."""
    return b"".join(
        frame({"seq": seq, "type": "request", "command": command, "arguments": arguments})
        for seq, (command, arguments) in enumerate(asked, 1)
    )


def messages(text: bytes) -> list[Json]:
    """Return all messages in bytes."""
    return [json.loads(body) for body in Frames().feed(text)]


@pytest.mark.cc
def test_a_session_over_standard_streams(gate: Path) -> None:
    given = requests(
        ("initialize", {"adapterID": "fsmkit"}),
        ("launch", {"program": str(gate)}),
        ("configurationDone", {}),
        ("evaluate", {"expression": "open", "context": "repl"}),
        ("stackTrace", {"threadId": 1}),
        ("disconnect", {}),
    )
    done = subprocess.run(STDIO, input=given, capture_output=True, check=True, timeout=60)
    told = messages(done.stdout)
    assert [m["seq"] for m in told] == [*range(1, len(told) + 1)]
    answers = {m["command"]: m for m in told if m["type"] == "response"}
    assert answers["stackTrace"]["body"]["stackFrames"][0]["name"] == "opening"
    assert [m["body"]["reason"] for m in told if m.get("event") == "stopped"] == ["entry", "step"]
    assert done.stderr == b""


@pytest.mark.cc
def test_half_a_message_ends_without_a_word() -> None:
    given = b"Content-Length: 9\r\n\r\n{"
    done = subprocess.run(STDIO, input=given, capture_output=True, check=True, timeout=60)
    assert (done.stdout, done.stderr) == (b"", b"")


# --- a port --------------------------------------------------------------------------------------


@contextmanager
def listening(hub: Hub | None = None, **options: Any) -> Iterator[int]:
    """Listen at a port, in a thread, while the block runs."""
    ready = threading.Event()
    found: dict[str, Any] = {}

    async def main() -> None:
        found["stop"], found["loop"] = asyncio.Event(), asyncio.get_running_loop()
        page = None if hub is None else LiveServer(hub, **options)
        async with PortServer(page=page) as server:
            found["port"] = server.port
            ready.set()
            await found["stop"].wait()

    thread = threading.Thread(target=lambda: asyncio.run(main()))
    thread.start()
    assert ready.wait(20)
    try:
        yield found["port"]
    finally:
        found["loop"].call_soon_threadsafe(found["stop"].set)
        thread.join(20)
        assert not thread.is_alive()


class Connection:
    """An editor at a port."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), 20)
        self._frames = Frames()
        self._seq = 0
        self.told: list[Json] = []

    def get(self, command: str, **arguments: Any) -> Json:
        """Make a request and wait for the response."""
        self._seq += 1
        request = {"seq": self._seq, "type": "request", "command": command}
        self.socket.sendall(frame({**request, "arguments": arguments}))
        return self.wait(lambda message: message.get("request_seq") == self._seq)

    def wait(self, is_it: Any) -> Json:
        """Wait for a message."""
        seen = 0
        while True:
            for message in self.told[seen:]:
                if is_it(message):
                    return message
            seen = len(self.told)
            data = self.socket.recv(65_536)
            assert data, "the connection is closed"
            self.told += [json.loads(body) for body in self._frames.feed(data)]

    def begin(self, **launch: Any) -> None:
        """Launch and wait for the stop."""
        asked: tuple[tuple[str, Json], ...]
        asked = (("initialize", {}), ("launch", launch), ("configurationDone", {}))
        for command, arguments in asked:
            answer = self.get(command, **arguments)
            assert answer["success"], answer
        self.wait(lambda message: message.get("event") == "stopped")

    def close(self) -> None:
        """Hang up."""
        self.socket.close()


def test_each_connection_is_a_session_and_time_passes(gate: Path) -> None:
    with listening() as port:
        one, two = Connection(port), Connection(port)
        one.begin(program=str(gate), speed=1000)
        two.begin(program=str(gate))
        one.get("evaluate", expression="open", context="repl")
        one.get("setFunctionBreakpoints", breakpoints=[{"name": "wide"}])
        one.get("continue", threadId=1)
        stopped = one.wait(lambda m: (m.get("body") or {}).get("reason") == "function breakpoint")
        assert stopped["body"]["description"] == "after T_OPEN (4s), opening -> wide"
        assert two.get("evaluate", expression="In(closed)")["body"]["result"] == "true"
        one.close()
        assert two.get("threads")["success"]
        two.close()


def test_the_page_of_a_session(gate: Path) -> None:
    with listening() as port:
        editor = Connection(port)
        assert not editor.get("fsmkit/live")["success"]
        editor.begin(program=str(gate))
        address = editor.get("fsmkit/live")["body"]["address"]
        assert editor.get("fsmkit/live")["body"]["address"] == address
        with urllib.request.urlopen(address.partition("#")[0], timeout=20) as page:
            assert b"<!doctype html>" in page.read().lower()
        editor.close()


def test_a_page_of_a_browser_gets_through_with_nothing(gate: Path) -> None:
    body = requests(("initialize", {}), ("launch", {"program": str(gate)}))
    head = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: %d\r\n\r\n" % len(body)
    with listening() as port, socket.create_connection(("127.0.0.1", port), 20) as browser:
        browser.sendall(head + body)
        told = b"".join(iter(lambda: browser.recv(65_536), b""))
    assert [message["event"] for message in messages(told)] == ["output", "terminated"]


def test_an_editor_joins_a_session_that_is_served(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    with listening(hub, is_readonly=True) as port:
        editor = Connection(port)
        editor.get("initialize")
        assert not editor.get("launch", program=str(gate))["success"]
        assert editor.get("attach")["success"]
        assert editor.get("threads")["body"]["threads"][0]["name"] == "Gate"
        answer = editor.get("evaluate", expression="open", context="repl")
        assert "read-only" in answer["message"]
        editor.close()


def test_not_too_many_connect_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving, "MOST_EDITORS", 1)
    with listening() as port:
        one = Connection(port)
        assert one.get("initialize")["success"]
        with socket.create_connection(("127.0.0.1", port), 20) as two:
            assert two.recv(100) == b""
        one.close()


def test_a_port_that_is_taken_is_a_finding() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()

        async def main() -> None:
            async with PortServer(taken.getsockname()[1]):
                pass

        with pytest.raises(FsmkitError) as caught:
            asyncio.run(main())
        assert caught.value.diagnostics[0].rule.name == "port-not-free"


def test_json_is_of_the_port_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["dap", "--json"]) == 2
    assert "--listen" in capsys.readouterr().err
