"""Threads of a link in C, and those of ZeroMQ, get priorities and processors, or say why not."""

from __future__ import annotations

import errno
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.needs import need, where
from tests.runtime.links.conftest import HERE, HOSTS, LINKS, ZMQ, has_libzmq

IS_ROOT = where(hasattr(os, "geteuid") and os.geteuid() == 0, "the right to SCHED_FIFO")


@pytest.fixture(scope="module")
def program(require_tool: Callable[[str], str]) -> Iterator[Path]:
    """Give the program, in a folder that other users can reach."""
    need(has_libzmq(), "libzmq")
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
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        subprocess.run([*words, "-o", f"{folder}/made"], check=True)
        yield Path(folder, "made")


def printed(
    program: Path, endpoints: dict[str, str], *command: str, priority: int, cpus: int
) -> list[list[int]]:
    """Return the errors, then policy, priority and number of processors of each thread."""
    words = [*command, str(program), str(priority), str(cpus), *endpoints.values()]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    first, *threads = done.stdout.splitlines()
    return [
        [int(word) for word in line.split()] for line in (first.removeprefix("errors "), *threads)
    ]


@pytest.mark.external
@IS_ROOT
def test_all_threads_are_scheduled(program: Path, endpoints: dict[str, str]) -> None:
    errors, *threads = printed(program, endpoints, priority=52, cpus=1)
    assert errors == [0, 0]
    assert len(threads) >= 4  # two of the link, two of ZeroMQ
    assert {tuple(thread) for thread in threads} == {(os.SCHED_FIFO, 52, 1)}


@pytest.mark.external
def test_nothing_asked_for(program: Path, endpoints: dict[str, str]) -> None:
    errors, *threads = printed(program, endpoints, priority=0, cpus=0)
    assert errors == [0, 0]
    assert {tuple(thread)[:2] for thread in threads} == {(os.SCHED_OTHER, 0)}


@pytest.mark.external
@IS_ROOT
def test_a_refusal_is_reported_and_the_link_works(program: Path, endpoints: dict[str, str]) -> None:
    """libzmq alone would end the process."""
    nobody = (
        "setpriv",
        "--reuid=65534",
        "--clear-groups",
        "--inh-caps=-all",
        "--bounding-set=-all",
    )
    errors, *threads = printed(program, endpoints, *nobody, priority=52, cpus=1 << 63)
    assert errors == [errno.EPERM, errno.EINVAL]
    assert {tuple(thread)[:2] for thread in threads} == {(os.SCHED_OTHER, 0)}
