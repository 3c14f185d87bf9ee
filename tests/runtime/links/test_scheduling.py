"""Threads of a link in C, and those of ZeroMQ, get priorities and processors, or say why not."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.needs import need, where
from tests.runtime.links.conftest import HERE, HOSTS, LINKS, ZMQ, has_libzmq

IS_ROOT = where(hasattr(os, "geteuid") and os.geteuid() == 0, "the right to SCHED_FIFO")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory, require_tool: Callable[[str], str]) -> Path:
    need(has_libzmq(), "libzmq")
    folder = tmp_path_factory.mktemp("scheduling")
    sources = [LINKS / "fsm_link.c", *(LINKS / f"fsm_link_{part}.c" for part in ZMQ)]
    words = [
        require_tool("gcc"),
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        f"-I{HOSTS}",
        f"-I{LINKS}",
    ]
    words += [*map(str, sources), str(HERE / "scheduling.c"), "-lzmq", "-pthread"]
    subprocess.run([*words, "-o", str(folder / "made")], check=True)
    return folder / "made"


def printed(program: Path, *command: str, priority: int, cpus: int) -> list[list[int]]:
    """Return the errors, then policy, priority and number of processors of each thread."""
    ends = [f"tcp://127.0.0.1:{port}" for port in (5597, 5598)]
    words = [*command, str(program), str(priority), str(cpus), *ends]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    first, *threads = done.stdout.splitlines()
    return [
        [int(word) for word in line.split()] for line in (first.removeprefix("errors "), *threads)
    ]


@pytest.mark.external
@IS_ROOT
def test_all_threads_are_scheduled(program: Path) -> None:
    errors, *threads = printed(program, priority=52, cpus=1)
    assert errors == [0, 0]
    assert len(threads) >= 4  # two of the link, two of ZeroMQ
    assert {tuple(thread) for thread in threads} == {(os.SCHED_FIFO, 52, 1)}


@pytest.mark.external
def test_nothing_asked_for(program: Path) -> None:
    errors, *threads = printed(program, priority=0, cpus=0)
    assert errors == [0, 0]
    assert {tuple(thread)[:2] for thread in threads} == {(os.SCHED_OTHER, 0)}


def open_to_all(program: Path) -> None:
    """Let another user reach a program: the folders of pytest are its owner's alone."""
    for folder in list(program.parents)[:-2]:
        folder.chmod(folder.stat().st_mode | 0o055)
    program.chmod(0o755)


@pytest.mark.external
@IS_ROOT
def test_a_refusal_is_told_and_the_link_works(program: Path) -> None:
    """libzmq alone would end the process."""
    open_to_all(program)
    nobody = (
        "setpriv",
        "--reuid=65534",
        "--clear-groups",
        "--inh-caps=-all",
        "--bounding-set=-all",
    )
    errors, *threads = printed(program, *nobody, priority=52, cpus=1 << 63)
    assert errors == [errno.EPERM, errno.EINVAL]
    assert {tuple(thread)[:2] for thread in threads} == {(os.SCHED_OTHER, 0)}
