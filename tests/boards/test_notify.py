"""Supervision by the protocol of sd_notify: a fake supervisor listens."""

from __future__ import annotations

import errno
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.boards.conftest import HOSTS, ROOT, Build

SOURCES = (
    HOSTS / "posix/fsm_notify.c",
    HOSTS / "posix/fsm_posix.c",
    ROOT / "tests/boards/posix_notify.c",
)
WATCHDOG_US = 400_000

pytestmark = pytest.mark.cc


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory, build: Build) -> Path:
    folder = tmp_path_factory.mktemp("notify")
    return build(folder, "gcc", "-fsanitize=thread", "-g", "-O1", "-pthread", *SOURCES)


@contextmanager
def supervised(
    program: Path, name: str, *arguments: str, **environment: str
) -> Iterator[tuple[subprocess.Popen[str], socket.socket]]:
    """Start the program; its supervisor is the socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind("\0" + name[1:] if name.startswith("@") else name)
        listener.settimeout(20)
        own = {"NOTIFY_SOCKET": name, "WATCHDOG_USEC": str(WATCHDOG_US), **environment}
        process = started(program, *arguments, **own)
        try:
            yield process, listener
        finally:
            process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()


def started(program: Path, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    command = [str(program), *arguments]
    whole: Mapping[str, str] = {**os.environ, **environment}
    return subprocess.Popen(command, env=whole, stdout=subprocess.PIPE, text=True)


def until(listener: socket.socket, message: str) -> list[str]:
    seen = [listener.recv(4096).decode()]
    while seen[-1] != message:
        seen.append(listener.recv(4096).decode())
    return seen


@pytest.mark.parametrize("kind", ["path", "abstract"])
def test_ready_status_and_stop(tmp_path: Path, program: Path, kind: str) -> None:
    name = str(tmp_path / "n") if kind == "path" else f"@fsmkit-test-{os.getpid()}"
    with supervised(program, name) as (process, listener):
        before = until(listener, "READY=1")
        assert set(before) <= {"READY=1", "WATCHDOG=1"}
        status = listener.recv(4096).decode()
        assert status.startswith("STATUS=producing 0 lost, a long line")
        assert len(status) == len("STATUS=") + 119
        until(listener, "WATCHDOG=1")
        process.send_signal(signal.SIGTERM)
        until(listener, "STOPPING=1")
        assert process.wait(20) == 0
        assert process.stdout is not None
        assert process.stdout.read() == f"open: 0, watchdog {WATCHDOG_US} us\nover\n"


def test_a_loop_that_hangs_is_noticed_while_the_thread_lives(tmp_path: Path, program: Path) -> None:
    """The thread sends nothing for as long as the loop hangs, and goes on with it."""
    with supervised(program, str(tmp_path / "n"), "1500") as (_, listener):
        until(listener, "READY=1")
        pauses: list[float] = []
        last = time.monotonic()
        while not pauses or max(pauses) < 1.0:
            until(listener, "WATCHDOG=1")
            pauses.append(time.monotonic() - last)
            last = time.monotonic()
            assert len(pauses) < 40, pauses
        until(listener, "WATCHDOG=1")
    assert max(pauses) > 2 * WATCHDOG_US / 1e6


@pytest.mark.parametrize(
    ("environment", "printed"),
    [
        ({}, "open: 0, watchdog 0 us"),
        ({"NOTIFY_SOCKET": ""}, "open: 0, watchdog 0 us"),
        ({"NOTIFY_SOCKET": "relative"}, f"open: {errno.EINVAL}, watchdog 0 us"),
        ({"NOTIFY_SOCKET": "/" + "n" * 200}, f"open: {errno.EINVAL}, watchdog 0 us"),
        ({"NOTIFY_SOCKET": "/nobody/listens"}, "open: 0, watchdog 0 us"),
        ({"NOTIFY_SOCKET": "/nobody", "WATCHDOG_USEC": "x"}, "open: 0, watchdog 0 us"),
        (
            {"NOTIFY_SOCKET": "/n", "WATCHDOG_USEC": "9", "WATCHDOG_PID": "1"},
            "open: 0, watchdog 0 us",
        ),
    ],
)
def test_nobody_listens(program: Path, environment: dict[str, str], printed: str) -> None:
    process = started(program, **environment)
    assert process.stdout is not None
    assert process.stdout.readline() == printed + "\n"
    process.send_signal(signal.SIGTERM)
    assert process.wait(20) == 0
    process.stdout.close()
