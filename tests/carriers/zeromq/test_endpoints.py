"""Which endpoints are of this computer only: Python and C judge alike."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.plugins import plugin
from fsmkit.runtime.links import LinkKind, LinkRequest
from fsmkit.system.deployment.addresses import is_loopback
from fsmkit.system.deployment.deployment import Deployment
from tests.runtime.links.conftest import HOSTS, LINKS, ZEROMQ, Player, has_libzmq

NEAR = """\
ipc://wall.ipc ipc:///tmp/x inproc://a tcp://127.0.0.1:5571 tcp://127.255.0.9:1 tcp://localhost:80
tcp://[::1]:5571 tcp://127.0.0.1:*"""
FAR = """\
tcp://10.0.0.1:5571 tcp://*:5571 tcp://0.0.0.0:5571 tcp://[::]:1 tcp://lo:5571 tcp://eth0:5571
tcp://127.0.0.1.example.org:1 tcp://localhost.example.org:1 tcp://127.0.0.256:1 tcp://127.1:1
tcp://127.0.0.1 tcp://127.0.0.1: tcp://127.0.0.1:0;10.0.0.2:5 tcp://10.0.0.2:5;127.0.0.1:5
tcp://127.0.0.0001:1 tcp://127..0.1:1 tcp://1270.0.0.1:1 tcp:// ipc:// inproc:// x udp://127.0.0.1:1
pgm://127.0.0.1;239.0.0.1:5 ws://127.0.0.1:80 TCP://127.0.0.1:5 tcp://[::1]5 tcp://[::ffff:10.0.0.1]:1
tcp://127.0.0.1@10.0.0.1:1 vmci://*:5"""
JUDGE = """\
#include "fsm_link_zmq.h"
#include <stdio.h>
#include <string.h>
int main(void)
{
    char line[256];
    while (fgets(line, sizeof line, stdin) != NULL) {
        line[strcspn(line, "\\n")] = '\\0';
        puts(fsm_link_zmq_is_loopback(line) ? "near" : "far");
    }
    return 0;
}
"""


def mutants(seed: int) -> list[str]:
    chance = random.Random(seed)
    found = []
    for _ in range(3000):
        text = list(chance.choice((NEAR + FAR).split()))
        for _ in range(chance.randrange(1, 4)):
            place = chance.randrange(len(text) + 1)
            text[place : place + chance.randrange(2)] = chance.choice("0125.:/[]*;@abl ")
        found.append("".join(text))
    return found


@pytest.mark.parametrize("endpoint", NEAR.split())
def test_of_this_computer(endpoint: str) -> None:
    assert is_loopback(endpoint)


@pytest.mark.parametrize("endpoint", FAR.split())
def test_not_of_this_computer_for_sure(endpoint: str) -> None:
    assert not is_loopback(endpoint)


@pytest.mark.cc
def test_c_judges_alike(tmp_path: Path, require_tool: Callable[[str], str]) -> None:
    if not has_libzmq():
        require_tool("libzmq")
    (tmp_path / "judge.c").write_text(JUDGE)
    done = subprocess.run(
        [
            *(require_tool("gcc"), "-std=c99", "-Wall", "-Wextra", "-Werror"),
            *("-fsanitize=address,undefined", f"-I{LINKS}", f"-I{ZEROMQ}", f"-I{HOSTS}"),
            *("judge.c", str(ZEROMQ / "fsm_link_endpoint.c"), "-o", "judge"),
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    asked = [*NEAR.split(), *FAR.split(), *mutants(1)]
    told = subprocess.run(
        [tmp_path / "judge"], input="\n".join(asked), capture_output=True, text=True, check=True
    ).stdout.split()
    assert told == ["near" if is_loopback(endpoint) else "far" for endpoint in asked]


@pytest.mark.cc
def test_a_link_without_keys_is_opened_only_where_nobody_else_comes(
    deployment: Deployment, play: Callable[..., Player], endpoints: dict[str, str]
) -> None:
    pytest.importorskip("zmq")
    far = {**endpoints, "b": "tcp://192.0.2.1:5571"}  # an address for documentation: RFC 5737
    kind = plugin(LinkKind, "zeromq")
    for options in ({"endpoints": far}, {"endpoints": endpoints, "bind": "tcp://*:0"}):
        with pytest.raises(FsmkitError, match="is not of this computer only, and there are no"):
            kind.open(LinkRequest(deployment.map, "a", 1, options=options))
    told = play("a", 1, "threaded", far["a"], far["b"])
    assert told.ask("p").startswith("an endpoint beyond this computer without keys")
    assert told.close() == 1
    insecure = replace(deployment.map, is_insecure=True)
    link = kind.open(LinkRequest(insecure, "a", 1, options={"endpoints": far}))
    link.close()
