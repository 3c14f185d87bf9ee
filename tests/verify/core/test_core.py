"""The search in C alone, on the dining philosophers, under sanitizers."""

from __future__ import annotations

import shutil
import subprocess
from collections import deque
from itertools import product
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CORE = ROOT / "fsmkit/verify/core"
STRICT = [
    *("-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Wpedantic"),
    *("-Wconversion", "-Wshadow", "-Werror"),
]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]

pytestmark = pytest.mark.cc


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("core") / "toy"
    build(program, "address,undefined")
    return program


def build(program: Path, sanitizers: str) -> None:
    names = (
        *("region", "shard", "hash_compaction", "set"),
        *("workers", "layer", "parallel_search", "search", "path", "scc", "cycles"),
    )
    sources = [next(CORE.rglob(f"{name}.c")) for name in names]
    toy_source = ROOT / "tests/c/explorer_toy.c"
    subprocess.run(
        [COMPILERS[0], *STRICT, "-pthread", f"-fsanitize={sanitizers}", "-fno-sanitize-recover=all",
         "-I", CORE, toy_source, *sources, "-o", program],
        check=True,
    )  # fmt: skip


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    "source",
    [path for path in sorted(CORE.rglob("*.c")) if path.parent.name != "mpi"],
    ids=lambda path: path.name,
)
def test_compiles_without_a_warning(compiler: str, source: Path, tmp_path: Path) -> None:
    folders = ("-I", str(CORE), "-I", str(ROOT / "fsmkit/runtime/c"))
    command = [compiler, *STRICT, *folders, "-c", str(source), "-o", str(tmp_path / "x.o")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def philosophers(count: int, mixed: bool) -> tuple[int, int, int]:
    """Return states, transitions and the length of the shortest path to a deadlock."""

    def forks(i: int) -> tuple[int, int]:
        order = i, (i + 1) % count
        return order[::-1] if mixed and i == count - 1 else order

    def successors(state: tuple[int, ...]) -> list[tuple[int, ...]]:
        held = {forks(i)[k] for i, s in enumerate(state) for k in range(s)}
        return [
            (*state[:i], (s + 1) % 3, *state[i + 1 :])
            for i, s in enumerate(state)
            if s == 2 or forks(i)[s] not in held
        ]

    first = (0,) * count
    depth = {first: 0}
    waiting, edges, deadlock = deque([first]), 0, 0
    while waiting:
        state = waiting.popleft()
        following = successors(state)
        edges += len(following)
        if not following and not deadlock:
            deadlock = depth[state] + 1
        for other in following:
            if other not in depth:
                depth[other] = depth[state] + 1
                waiting.append(other)
    return len(depth), edges, deadlock


@pytest.mark.slow
@pytest.mark.parametrize(("count", "cores"), [*product((2, 3, 5, 8), (1, 2, 3)), (9, 1), (9, 3)])
@pytest.mark.parametrize("kind", ["left", "mixed", "sparse left", "sparse mixed"])
def test_counts_states_and_finds_the_nearest_deadlock(
    toy: Path, count: int, kind: str, cores: int
) -> None:
    memory = 1 << 24  # too little for a bit of each of 8^9 states
    command = [str(toy), str(count), kind, str(memory), str(cores)]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    figures = list(map(int, told.stdout.split()))
    end, states, edges, _, deadlock, livelock, traps, _, dense, other = figures
    assert (end, states, edges, deadlock) == (0, *philosophers(count, "mixed" in kind))
    assert livelock == 0
    assert traps == ("left" in kind)
    if count > 8:
        assert dense == ("sparse" not in kind)
    assert other > 0


def test_a_cycle_of_internal_steps_is_a_livelock(toy: Path) -> None:
    told = subprocess.run([toy, "3", "busy"], capture_output=True, text=True, check=True)
    assert told.stdout.split()[5] == "1"


def test_obeys_its_memory_limit(toy: Path) -> None:
    told = subprocess.run([toy, "11", "left", "100000"], capture_output=True, text=True, check=True)
    end, states, *_ = map(int, told.stdout.split())
    assert end == 2
    assert 0 < states < 41_000


@pytest.mark.parametrize("cores", [1, 3])
@pytest.mark.parametrize("storage", ["hash-compact", "bitstate"])
@pytest.mark.parametrize("kind", ["left", "mixed", "sparse left"])
def test_a_lossy_set_with_ample_memory_misses_nothing(
    toy: Path, kind: str, storage: str, cores: int
) -> None:
    command = [str(toy), "8", kind, str(1 << 24), str(cores), storage]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    end, states, edges, _, deadlock, *_ = map(int, told.stdout.split())
    assert (end, states, edges, deadlock) == (0, *philosophers(8, "mixed" in kind))


def test_threads_do_not_race(tmp_path: Path) -> None:
    build(tmp_path / "toy", "thread")
    for storage in ([], ["hash-compact"], ["bitstate"]):
        command = [str(tmp_path / "toy"), "8", "mixed", str(1 << 26), "3", *storage]
        told = subprocess.run(command, capture_output=True, text=True, check=False)
        assert told.stderr == ""
        assert told.returncode == 0
