"""How nodes answer: well, badly, not at all."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq

from fsmkit.cli import execute
from fsmkit.runtime.health import Health, health_of, read_answer

GOOD = {"ok": True, "status": "producing", "cycles": 12345, "overruns": 3, "losses": 0}


@pytest.fixture
def node(tmp_path: Path) -> Iterator[tuple[str, list[bytes]]]:
    """Start a node; it gives the answers of the list, the last one again and again."""
    endpoint, answers, over = f"ipc://{tmp_path}/node", [b""], threading.Event()

    def answer() -> None:
        with zmq.Context() as context, context.socket(zmq.REP) as socket:
            socket.setsockopt(zmq.LINGER, 0)
            socket.bind(endpoint)
            while not over.is_set():
                if socket.poll(20):
                    assert socket.recv() == b"R"
                    socket.send(answers.pop(0) if len(answers) > 1 else answers[0])

    thread = threading.Thread(target=answer)
    thread.start()
    yield endpoint, answers
    over.set()
    thread.join()


@pytest.mark.parametrize(
    ("answer", "is_ok", "status"),
    [
        (b"R" + json.dumps(GOOD).encode(), True, "producing"),
        (b'R{"ok": false, "status": "off"}', False, "off"),
        (b"Enot now", False, "rejects the request: not now"),
        (b"", False, "the answer has no `ok` and `status`"),
        (b"R", False, "the answer has no `ok` and `status`"),
        (b"R[1]", False, "the answer has no `ok` and `status`"),
        (b'R{"ok": 1, "status": "x"}', False, "the answer has no `ok` and `status`"),
        (b'R{"ok": true, "status": null}', False, "the answer has no `ok` and `status`"),
        (b"R\xff\xfe", False, "the answer has no `ok` and `status`"),
        (b"R" + b"[" * 100_000, False, "the answer has no `ok` and `status`"),
    ],
)
def test_answers(answer: bytes, is_ok: bool, status: str) -> None:
    health = read_answer("a", "tcp://x", answer)
    assert (health.is_ok, health.status) == (is_ok, status)


def test_a_node_that_answers_and_one_that_does_not(
    node: tuple[str, list[bytes]], tmp_path: Path
) -> None:
    endpoint, answers = node
    answers[:] = [b"R" + json.dumps(GOOD).encode()]
    silent = f"ipc://{tmp_path}/nobody"
    found = health_of([("a", endpoint), ("b", silent), ("c", "no://where")], 1)
    assert found[0].is_ok
    assert found[0].report == {"cycles": 12345, "overruns": 3, "losses": 0}
    assert found[1] == Health("b", silent, is_ok=False, status="no answer within 1 s")
    assert not found[2].is_ok
    assert found[2].status


def test_the_verb(
    node: tuple[str, list[bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    endpoint, answers = node
    report = {**GOOD, "status": "[red]on\x1b[2J\n", "bus_off": 1}
    answers[:] = [b"R" + json.dumps(report).encode(), b"Eno"]
    (tmp_path / "one.yaml").write_text("chart: One\nstates: {there: {}}\n", encoding="utf-8")
    (tmp_path / "one_system.yaml").write_text(
        "system: One\nmachines: {one: one.yaml}\n", encoding="utf-8"
    )
    deployment = tmp_path / "deployment.yaml"
    deployment.write_text(
        f"system: one_system.yaml\nnodes: {{a: [one]}}\nhealth: {{a: '{endpoint}'}}\n", "utf-8"
    )
    assert execute(["health", str(deployment)]) == 0
    printed = capsys.readouterr().out
    assert printed.splitlines()[0].split()[-1] == "bus_off"
    line = printed.splitlines()[1].split()
    assert line == ["a", "yes", "[red]on", "[2J", "12,345", "3", "0", "1"]
    assert execute(["health", str(deployment), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["nodes"] == [
        {
            "node": "a",
            "endpoint": endpoint,
            "ok": False,
            "status": "rejects the request: no",
            "report": {},
        }
    ]


def test_answers_beyond_this_computer_have_no_keys(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "one.yaml").write_text("chart: One\nstates: {there: {}}\n", encoding="utf-8")
    (tmp_path / "s.yaml").write_text("system: One\nmachines: {one: one.yaml}\n", encoding="utf-8")
    deployment = tmp_path / "deployment.yaml"
    text = "system: s.yaml\nnodes: {a: [one]}\nhealth: {a: 'tcp://10.0.0.1:1'}\n"
    deployment.write_text(text, encoding="utf-8")
    assert execute(["health", str(deployment)]) == 1
    assert "health endpoints have no keys" in capsys.readouterr().err
    deployment.write_text(text + "links: {insecure: true}\n", encoding="utf-8")
    assert execute(["health", str(deployment), "--timeout", "10ms"]) == 1
