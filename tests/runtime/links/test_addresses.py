"""Addresses of each carrier that nobody can reach, in deployments and in options of a program."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.plugins import plugin
from fsmkit.runtime.links import LinkKind, LinkRequest
from fsmkit.system.deployment.addresses import rejection_of
from fsmkit.system.deployment.deployment import Deployment
from tests.reading import load_deployment
from tests.runtime.links.conftest import TALK

RIGHT = """\
tcp://127.0.0.1:5571 tcp://localhost:1 tcp://board-a.local:65535 tcp://[::1]:5571 tcp://[fe80::1%eth0]:5
ipc://wall.ipc ipc:///run/wall ipc://@wall inproc://a tcp://10.0.0.2:5;10.0.0.1:6"""
WRONG = {
    "127.0.0.1:5502": "tcp://127.0.0.1:5502",
    "localhost:5502": "tcp://localhost:5502",
    "board-a:5571": "tcp://board-a:5571",
    "[::1]:5571": "tcp://[::1]:5571",
    "/run/wall.ipc": "ipc:///run/wall.ipc",
    "./wall.ipc": "ipc://./wall.ipc",
    "tcp:127.0.0.1:5": "tcp://127.0.0.1:5",
    "tcp:/127.0.0.1:5": "tcp://127.0.0.1:5",
    "TCP:127.0.0.1:5": "tcp://127.0.0.1:5",
    "TCP://127.0.0.1:5": "tcp://127.0.0.1:5",
    "udp://127.0.0.1:5": "tcp://127.0.0.1:5",
    "http://board:80": "tcp://board:80",
    "pgm://a:5": "tcp://a:5",
    "tcp://127.0.0.1": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:0": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:65536": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:*": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:x": "tcp://127.0.0.1:5571",
    "tcp://127.0.0.1:-5": "tcp://127.0.0.1:5571",
    "tcp://a:\u0665": "tcp://a:5571",
    f"tcp://a:{'9' * 200}": "tcp://a:5571",
    "tcp://::1:5571": "HOST",
    "tcp://127.0.0.1:5571/x": "no port",
    "tcp://a/b:5571": "HOST",
    "tcp://*:5571": "bind",
    "tcp://:5571": "HOST",
    "tcp://": "address",
    "ipc://": "address",
    "inproc://": "address",
    "ipc://" + "a" * 108: "107 bytes",
    "tcp://" + "a" * 5000 + ":1": "255 bytes",
    "tcp://a b:5": "blanks",
    "tcp://a\u202eb:5": "blanks",
    "": "blanks",
    "x": "tcp://x",
}


@pytest.mark.parametrize("endpoint", RIGHT.split())
def test_what_can_be_reached_is_accepted(endpoint: str) -> None:
    assert rejection_of(endpoint) is None


@pytest.mark.parametrize("endpoint", WRONG)
def test_what_nobody_can_reach_is_rejected_with_the_fix(endpoint: str) -> None:
    found = rejection_of(endpoint)
    assert found is not None
    assert WRONG[endpoint] in f"{found.why}; {found.fix}"
    proposed = re.search(r"write `([^`]+)`", found.fix)
    if proposed is not None and endpoint != "x":
        assert rejection_of(proposed[1]) is None


def test_any_text_is_judged() -> None:
    draw = random.Random(4)
    for _ in range(3000):
        text = list(draw.choice([*RIGHT.split(), *WRONG]))
        for _ in range(draw.randint(1, 3)):
            place = draw.randrange(len(text) + 1)
            text[place : place + draw.randrange(2)] = draw.choice("05.:/[]*;@a% \0\u202e")
        found = rejection_of("".join(text))
        assert found is None or (found.why and found.fix)


@pytest.fixture
def talk(tmp_path: Path) -> Path:
    for path in TALK.parent.glob("*.yaml"):
        (tmp_path / path.name).write_text(path.read_text())
    return tmp_path / "deployment.yaml"


def messages_of(path: Path) -> list[str]:
    """Return the messages of the errors of a deployment."""
    with pytest.raises(FsmkitError) as caught:
        load_deployment(path)
    return [f.message for f in caught.value.diagnostics if f.rule.name == "broken-deployment"]


@pytest.mark.parametrize("key", ["endpoints", "health"])
@pytest.mark.parametrize(
    "endpoint", ["127.0.0.1:5502", "tcp://127.0.0.1", "udp://a:5", "tcp://*:5", "ipc://", ""]
)
def test_a_deployment_has_no_such_endpoint(talk: Path, key: str, endpoint: str) -> None:
    given = json.dumps({"a": "tcp://127.0.0.1:5501", "b": endpoint})
    form = f"links: {{insecure: true, endpoints: {given}}}"
    if key == "health":
        form = f"links: {{insecure: true}}\nhealth: {given}"
    talk.write_text(f"{talk.read_text()}{form}\n")
    rejection = rejection_of(endpoint)
    assert rejection is not None
    assert messages_of(talk) == [f"the endpoint `{endpoint}` {rejection.why}"]


def test_two_nodes_do_not_share_an_endpoint(talk: Path) -> None:
    form = 'links: {endpoints: {a: "tcp://127.0.0.1:5501", b: "tcp://127.0.0.1:5501"}}\n'
    talk.write_text(talk.read_text() + form)
    assert messages_of(talk) == ["`tcp://127.0.0.1:5501` is the endpoint of two nodes"]


def test_a_program_opens_no_such_endpoint(deployment: Deployment) -> None:
    for endpoint in ("127.0.0.1:5502", "tcp://127.0.0.1", "udp://127.0.0.1:5"):
        options = {"endpoints": dict.fromkeys(deployment.nodes, endpoint)}
        with pytest.raises(FsmkitError, match="link-not-opened"):
            plugin(LinkKind, "zeromq").open(LinkRequest(deployment.map, "a", 1, options=options))


@pytest.mark.parametrize(
    ("bus", "fix"),
    [
        ("udp:10.0.0.1:5", "multicast"),
        ("udp:239.0.0.1:0", "multicast"),
        ("udp:239.0.0.1", "multicast"),
        ("udp:239.0.0.256:5", "multicast"),
        ("udp://239.0.0.1:5", "multicast"),
        ("UDP:239.0.0.1:5", "multicast"),
        ("udp:", "multicast"),
        ("", "interface"),
        ("can 0", "interface"),
        ("can0\u202e", "interface"),
        ("tcp://127.0.0.1:5", "endpoint"),
    ],
)
def test_a_bus_has_the_name_of_an_interface(talk: Path, bus: str, fix: str) -> None:
    form = f"links: {{kind: can, bus: {json.dumps(bus)}}}\n"
    talk.write_text(talk.read_text() + form)
    (message,) = messages_of(talk)
    assert fix in message
