"""What the tests of links share: a small system on two nodes, in Python and in C."""

from __future__ import annotations

import os
import socket
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from fsmkit.cli.tools.paths import PATHS
from fsmkit.plugins import plugin
from fsmkit.runtime.links import Counters, Faults, Link, LinkKind, LinkRequest
from fsmkit.system.deployment.deployment import Deployment
from tests.needs import need
from tests.reading import load_deployment

HERE = Path(__file__).parent
LINKS = PATHS["links"]
HOSTS = PATHS["hosts"]
LOCAL, ZEROMQ = PATHS["in_process"], PATHS["zeromq"]
TALK = HERE / "talk/deployment.yaml"
ZMQ = ("zmq", "hello", "gate", "keys", "endpoint")
RING = HERE.parents[2] / "machines/production_cell/ring.yaml"


@pytest.fixture(scope="session")
def deployment() -> Deployment:
    """Give a deployment with every scalar type, levels, and a port with three ends."""
    return load_deployment(TALK)


@pytest.fixture(scope="session")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Deployment:
    """Give the ring of the Production Cell on two nodes."""
    path = tmp_path_factory.mktemp("ring") / "deployment.yaml"
    path.write_text(
        f"system: {RING}\n"
        "nodes:\n"
        "  a: [supervisor, feeder_belt, feeder, molder, extractor]\n"
        "  b: [extraction_belt, sorter, camera, rotator]\n",
        encoding="utf-8",
    )
    return load_deployment(path)


@pytest.fixture(scope="session")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder with the C of both nodes."""
    folder = tmp_path_factory.mktemp("generated")
    assert execute(["compile", str(TALK), "--out", str(folder)]) == 0
    return folder


PATIENCE = 20.0
"""Seconds: threads may get little of a busy computer."""
Open = Callable[..., Link]


class Player:
    """A node in C that does what it is told; see link_player.c."""

    def __init__(self, program: Path, *arguments: object) -> None:
        self.process = subprocess.Popen(
            [str(program), *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def tell(self, *lines: str) -> None:
        """Let it do something that prints nothing."""
        assert self.process.stdin is not None
        self.process.stdin.write("".join(f"{line}\n" for line in lines))
        self.process.stdin.flush()

    def ask(self, line: str) -> str:
        """Return the line that it prints for this."""
        self.tell(line)
        return self.read()

    def read(self) -> str:
        """Return a line that it prints."""
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip("\n")

    def ask_all(self, line: str) -> list[str]:
        """Return the lines that it prints for this."""
        assert self.process.stdout is not None
        self.tell(line)
        return [found.rstrip("\n") for found in iter(self.process.stdout.readline, ".\n")]

    def counters(self) -> Counters:
        """Return what it counts of the other node."""
        words = self.ask_all("p")[-3].split()
        names = [part.name for part in fields(Counters)][1:]
        counted = dict(zip(names, map(int, words[3:11]), strict=True))
        return Counters(session=int(words[2]), **counted)

    def kill(self) -> None:
        """End it without a word."""
        self.process.kill()
        self.close()

    def close(self) -> int:
        """Let it end; return what it returned."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        code = self.process.wait(timeout=30)
        self.process.stdout.close()
        return code


Build = Callable[..., Path]


@pytest.fixture(scope="session")
def build(generated: Path, require_tool: Callable[[str], str]) -> Build:
    """Compile a program of a node, with the strictest warnings and under sanitizers."""

    def compiled(
        node: str, source: Path, *options: str, sanitizers: str = "address,undefined"
    ) -> Path:
        is_zmq = "-DWITH_ZMQ" in options
        need(not is_zmq or has_libzmq(), "libzmq")
        sources = [LINKS / "fsm_link.c", LOCAL / "fsm_link_local.c"]
        sources += [ZEROMQ / f"fsm_link_{name}.c" for name in ZMQ] * is_zmq
        sources += sorted((generated / node).glob("*.c"))
        program = (
            generated
            / f"{source.stem}_{node}_{'zmq' if is_zmq else 'plain'}_{sanitizers[:6] or 'none'}"
        )
        done = subprocess.run(
            [
                require_tool("gcc"),
                "-std=c99",
                *("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"),
                *([f"-fsanitize={sanitizers}", "-fno-sanitize-recover=all"] if sanitizers else []),
                *("-g", "-O1"),
                f"-DNODE_{node.upper()}",
                *(f"-I{folder}" for folder in (LINKS, LOCAL, ZEROMQ, HOSTS, generated / node)),
                *options,
                *map(str, [*sources, source]),
                *(["-lzmq"] if is_zmq else []),
                "-pthread",
                "-o",
                str(program),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return program

    return cache(compiled)


def has_libzmq() -> bool:
    """Whether programs in C can be linked with ZeroMQ here."""
    done = subprocess.run(
        ["gcc", "-include", "zmq.h", "-x", "c", "-", "-lzmq", "-o", os.devnull],
        input="int main(void) { return 0; }",
        text=True,
        capture_output=True,
        check=False,
    )
    return done.returncode == 0


@pytest.fixture
def play(build: Build) -> Iterator[Callable[..., Player]]:
    """Run a node in C; it is ended after the test."""
    players: list[Player] = []

    def run_player(node: str, *arguments: object) -> Player:
        options = ("-DWITH_ZMQ",) if len(arguments) > 1 else ()
        players.append(Player(build(node, HERE / "link_player.c", *options), *arguments))
        return players[-1]

    yield run_player
    for player in players:
        if player.process.poll() is None:
            player.kill()


@pytest.fixture
def endpoints() -> dict[str, str]:
    """Give endpoints that are free now."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in "ab"]
    ports = [found.getsockname()[1] for found in sockets]
    for found in sockets:
        found.close()
    return {name: f"tcp://127.0.0.1:{port}" for name, port in zip("ab", ports, strict=True)}


@pytest.fixture
def connect(deployment: Deployment, endpoints: dict[str, str]) -> Iterator[Open]:
    """Open links over ZeroMQ; they are closed after the test."""
    links: list[Link] = []

    def opened(node: str, session: int = 1, faults: Faults | None = None, **options: Any) -> Link:
        given = {"endpoints": endpoints, **options}
        kind = plugin(LinkKind, "zeromq")
        links.append(kind.open(LinkRequest(deployment.map, node, session, faults, given)))
        return links[-1]

    yield opened
    for link in links:
        link.close()
