"""Who may connect, and what becomes of who reads too slowly."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

import fsmkit
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector import as_messages, charts
from fsmkit.inspector import server as serving_module
from fsmkit.inspector.commands import MOST_BYTES
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.page import page
from fsmkit.inspector.server import LiveServer
from fsmkit.runtime.live.messages import SUBPROTOCOL
from tests.inspector.serving import served

OURS = [Subprotocol(SUBPROTOCOL)]


@pytest.fixture
def server(gate: Path) -> Iterator[LiveServer]:
    """Serve a gate."""
    with served(Hub(fsmkit.read_chart(gate), file=gate)) as found:
        yield found


def joined(server: LiveServer, **options: Any) -> ClientConnection:
    token = options.pop("token", server.token)
    options.setdefault("subprotocols", OURS)
    address = f"ws://127.0.0.1:{server.port}/live?token={token}"
    client: ClientConnection = connect(address, **options)
    return client


def messages(client: ClientConnection, timeout: float = 5) -> list[dict[str, Any]]:
    found = json.loads(client.recv(timeout))
    return found if isinstance(found, list) else [found]


def until(client: ClientConnection, kind: str, most: int = 2000) -> dict[str, Any]:
    for _ in range(most):
        for message in messages(client):
            if message["k"] == kind:
                return message
    raise AssertionError(kind)


def test_who_knows_the_token_is_told_all_and_may_command(server: LiveServer) -> None:
    with joined(server) as client:
        assert [m["k"] for m in messages(client)] == ["hello", "state", "mode"]
        client.send(json.dumps({"id": 1, "do": "post", "m": "Gate", "event": "open"}))
        step = until(client, "step")
        assert step["on"] == ["opening"]
        client.send(json.dumps({"id": 2, "do": "run", "speed": 100}))
        assert until(client, "step")["on"] == ["wide"]


def test_the_page_comes_with_its_policy(server: LiveServer) -> None:
    http = HTTPConnection("127.0.0.1", server.port)
    http.request("GET", "/")
    answer = http.getresponse()
    assert answer.status == 200
    assert answer.read() == page().text
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert server.token not in page().text.decode()


@pytest.mark.parametrize(
    "path", ["/etc/passwd", "/../page.js", "/live", "/live?token=0", "/page.js"]
)
def test_nothing_else_is_there(server: LiveServer, path: str) -> None:
    http = HTTPConnection("127.0.0.1", server.port)
    http.request("GET", path)
    assert http.getresponse().status in (403, 404)


@pytest.mark.parametrize("path", ["http://[::1", "//[", "http://[x]/", "*", "?token=" + "0" * 5000])
def test_an_address_that_is_none_is_a_bad_request(server: LiveServer, path: str) -> None:
    http = HTTPConnection("127.0.0.1", server.port)
    http.putrequest("GET", path, skip_host=True)
    http.putheader("Host", f"127.0.0.1:{server.port}")
    http.endheaders()
    assert http.getresponse().status in (400, 404)


def test_another_host_is_not_served(server: LiveServer) -> None:
    http = HTTPConnection("127.0.0.1", server.port)
    http.request("GET", "/", headers={"Host": f"evil.example:{server.port}"})
    assert http.getresponse().status == 403


@pytest.mark.parametrize(
    "options",
    [
        {"token": ""},
        {"token": "0" * 32},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"subprotocols": [Subprotocol("fsmkit.live.2")]},
        {"subprotocols": None},
        {"additional_headers": {"Host": "evil.example"}},
    ],
    ids=str,
)
def test_who_does_not_come_from_the_page_is_refused(
    server: LiveServer, options: dict[str, Any]
) -> None:
    with pytest.raises(InvalidStatus) as refused, joined(server, **options):
        pass
    assert refused.value.response.status_code in (400, 403)


def test_pages_of_ours_may_connect(server: LiveServer) -> None:
    with joined(server, origin=f"http://localhost:{server.port}") as client:
        assert messages(client)


def test_there_are_only_so_many(server: LiveServer) -> None:
    with ExitStack() as clients:
        for _ in range(serving_module.MOST_CLIENTS):
            messages(clients.enter_context(joined(server)))
        with pytest.raises(InvalidStatus) as refused, joined(server):
            pass
        assert refused.value.response.status_code == 503


def test_a_frame_that_is_too_large_ends_the_connection(server: LiveServer) -> None:
    with joined(server) as client, joined(server) as other:
        messages(client)
        client.send(" " * (MOST_BYTES + 1))
        with pytest.raises(ConnectionClosed):
            until(client, "nothing")
        assert messages(other)


def test_bytes_that_are_no_text_are_refused(server: LiveServer) -> None:
    with joined(server) as client:
        messages(client)
        client.send(b"\xff\xfe\x00")
        assert until(client, "refused")["rule"] == "wrong-command"


def test_a_flood_of_commands_is_slowed_down(server: LiveServer) -> None:
    count = serving_module.MOST_COMMANDS * 2
    with joined(server) as client:
        begin = time.monotonic()
        for number in range(count):
            client.send(json.dumps({"id": number, "do": "watch", "expression": "count"}))
        answered = 0
        while answered < count:
            answered += sum(m["k"] == "done" for m in messages(client))
        assert time.monotonic() - begin >= 0.9  # two seconds' worth of commands


def test_who_reads_too_slowly_is_told_so_and_then_all(
    gate: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serving_module, "MOST_BEHIND", 2_000)
    monkeypatch.setattr(serving_module, "PATIENCE", -1)
    hub = Hub(fsmkit.read_chart(gate), file=gate)
    with served(hub) as server, joined(server) as client:
        messages(client)
        outbox = serving_module._Outbox()
        for _ in range(100):
            outbox.put(b'{"k":"step"}' * 20)
        assert outbox.lost > 80
        for number in range(150):  # all within one time of gathering, or nearly so
            client.send(json.dumps({"id": number, "do": "seek", "n": 1}))
        found: list[dict[str, Any]] = []
        while not any(m["k"] == "lost" for m in found):
            found += messages(client)
        after = found[next(i for i, m in enumerate(found) if m["k"] == "lost") :]
        assert after[0]["count"] > 0
        assert [m["k"] for m in after[1:4]] == ["hello", "state", "mode"]


def test_a_drawing_that_takes_long_holds_nobody_up(
    server: LiveServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even the client that wants it: it commands on, and gets the drawing at last."""
    is_drawing, may_end = threading.Event(), threading.Event()
    made = charts.chart_message

    def slowly(*given: Any, **more: Any) -> Any:
        is_drawing.set()
        assert may_end.wait(20)
        return made(*given, **more)

    monkeypatch.setattr(as_messages, "chart_message", slowly)
    with joined(server) as one, joined(server) as other:
        hash_ = until(one, "hello")["machines"][0]["chart"]
        one.send(json.dumps({"id": 1, "do": "chart", "chart": hash_}))
        assert is_drawing.wait(20)
        one.send(json.dumps({"id": 2, "do": "post", "m": "Gate", "event": "open"}))
        assert until(other, "step")["on"] == ["opening"]
        assert until(one, "done")["re"] == 2
        may_end.set()
        assert until(one, "chart")["chart"] == hash_


def test_of_several_clients_it_is_told_who_commands(server: LiveServer) -> None:
    with joined(server) as one:
        post = json.dumps({"id": 1, "do": "post", "m": "Gate", "event": "open"})
        one.send(post)
        assert "by" not in until(one, "post")
        with joined(server) as other:
            number = until(other, "hello")["client"]
            other.send(post)
            assert until(one, "post")["by"] == number


def test_who_only_looks_on_is_refused_each_command(gate: Path) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    with served(hub, is_readonly=True) as server, joined(server) as client:
        assert messages(client)[0]["readonly"]
        for number, do in enumerate(("run", "pause", "step", "back", "seek")):
            client.send(json.dumps({"id": number, "do": do}))
            assert until(client, "refused")["re"] == number


def test_a_port_that_is_taken_is_a_finding(server: LiveServer, gate: Path) -> None:
    with (
        pytest.raises(FsmkitError) as raised,
        served(Hub(fsmkit.read_chart(gate)), port=server.port),
    ):
        pass
    assert raised.value.diagnostics[0].rule.name == "port-not-free"


def test_who_took_something_just_now_is_waited_for() -> None:
    """A busy machine is no slow reader."""
    most, outbox = serving_module.MOST_BEHIND, serving_module._Outbox()
    big = b'{"k":"step","x":"' + b"x" * (most - 20) + b'"}'
    for _ in range(4):
        outbox.put(big)
    assert outbox.lost == 0
    outbox.put(big)
    assert outbox.lost == 4
    outbox.last -= serving_module.PATIENCE + 1
    outbox.put(big)
    assert outbox.lost == 5
    outbox.take()
    outbox.put(big)
    outbox.put(big)
    assert outbox.lost == 5


def test_an_answer_is_never_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving_module, "PATIENCE", -1)
    outbox = serving_module._Outbox()
    chart = b'{"k":"chart","svg":"' + b"x" * 2 * serving_module.MOST_BEHIND + b'"}'
    for text in (b'{"k":"step"}', chart, b'{"k":"done","re":1}', b'{"k":"step"}'):
        outbox.put(text)
    big = b'{"k":"step","x":"' + b"x" * serving_module.MOST_BEHIND + b'"}'
    outbox.put(big)
    outbox.put(big)
    assert outbox.lost == 3
    assert outbox.texts == [chart, b'{"k":"done","re":1}', big]
    with pytest.raises(asyncio.TimeoutError):
        asyncio.run(asyncio.wait_for(outbox.has_room(), 0.01))
    outbox.take()
    asyncio.run(asyncio.wait_for(outbox.has_room(), 1))


def test_a_client_that_is_gone_holds_nobody_up() -> None:
    """Its commands may still be read; a server that waited for it did not end."""
    outbox = serving_module._Outbox()
    answer = b'{"k":"done","x":"' + b"x" * 2 * serving_module.MOST_BEHIND + b'"}'
    outbox.put(answer)
    outbox.close()
    outbox.put(answer)
    asyncio.run(asyncio.wait_for(outbox.has_room(), 1))
    assert not outbox.texts
