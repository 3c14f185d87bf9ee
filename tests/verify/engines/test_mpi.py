"""Several processes by MPI: all that is found is what one process finds."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from benchmarks.explorer.__main__ import HERE, MODELS
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.engines.c import engine as engine_in_c
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.c.mpi import OVERSUBSCRIBED, launcher
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.exploration import End, Exploration
from fsmkit.verify.statespace.ranks import Ranks
from fsmkit.verify.statespace.spread import UNKNOWN
from fsmkit.verify.statespace.storage import Storage
from fsmkit.verify.statespace.symbolic_search import Search
from tests import needs
from tests.verify.core.test_core import COMPILERS, CORE, ROOT, STRICT
from tests.verify.random_systems import load_files, random_system
from tests.verify.systems import DEADLOCK, LEFT, LIVELOCK, PING, PONG, RIGHT

pytestmark = [
    pytest.mark.cc,
    pytest.mark.external,
    pytest.mark.usefixtures("own_cache", "quickly_compiled", "mpi"),
]
MEMORY = 1 << 28
TABLE = ROOT / "machines/philosophers/table.yaml"


@pytest.fixture
def mpi(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip without MPI; let it run for root, too, as where everything is tested."""
    needs.tool("mpicc")
    needs.tool("mpirun")
    for name in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"):
        monkeypatch.setenv(name, "1")


def seen(found: Exploration) -> Mapping[str, Any]:
    """Return all of a result that does not depend on who found it."""
    return {
        "end": found.end,
        "states": found.states,
        "transitions": found.transitions,
        "depth": found.depth,
        "marks": [(mark.number, len(mark.path)) for mark in found.marks],
        "livelock": (found.livelock_known, found.livelock is not None),
        "machines": [replace(figures, spread=UNKNOWN) for figures in found.machines],
    }


def explored(system: System, *counts: int, untimed: bool = True) -> list[Exploration]:
    """Return what one process finds, then what so many ranks do; their paths are replayed."""
    closed = close(system, untimed=untimed)
    with closing(CEngine(closed, Findings())) as engine:
        found = [engine.explore(MEMORY, 0, None)]
    for count in counts:
        with closing(CEngine(closed, Findings(), ranks=Ranks(count))) as engine:
            one = engine.explore(MEMORY, 0, None)
            for mark in one.marks:
                assert len(engine.trail(mark.path)) == len(mark.path)
            if one.livelock is not None:
                assert engine.trail(one.livelock[0] + one.livelock[1])
            found.append(one)
    return found


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("source", sorted((CORE / "mpi").glob("*.c")), ids=lambda path: path.name)
def test_compiles_without_a_warning(compiler: str, source: Path, tmp_path: Path) -> None:
    folders = ("-I", str(CORE), "-I", str(ROOT / "fsmkit/runtime/c"))
    command = ["mpicc", *STRICT, "-DFSM_MPI", *folders, "-c", str(source)]
    done = subprocess.run(
        [*command, "-o", str(tmp_path / "x.o")], env={**os.environ, "OMPI_CC": compiler},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("untimed", [False, True])
def test_same_as_one_process(untimed: bool) -> None:
    alone, *ranks = explored(load_any(TABLE, Findings()), 1, 2, 4, untimed=untimed)
    for found in ranks:
        assert seen(found) == seen(alone)
        assert found.traffic is not None
        assert (found.traffic.forwarded == 0) == (found.traffic.ranks == 1)


@pytest.mark.parametrize("seed", [0, 1, 3, 4])
def test_same_on_random_systems(seed: int) -> None:
    alone, two = explored(load_files(random_system(seed)), 2, untimed=seed % 2 == 0)
    assert seen(two) == seen(alone)


CHAIN = """
chart: Chain
data: {k: 0..3000 = 0}
events: {in: [e]}
environment: {may: [e]}
properties: {p: {never: k == 2001}, q: {never: k == 2999}}
initial: a
states: {a: {rest: true, on: {e: {if: k < 3000, do: k += 1}}}}
"""


@pytest.mark.slow
def test_paths_through_stops_that_were_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine_in_c, "FLAGS", (*engine_in_c.FLAGS, "-DFSM_FREE_MEMBERS=100"))
    (tmp_path / "chain.yaml").write_text(CHAIN, encoding="utf-8")
    alone, three = explored(load_any(tmp_path / "chain.yaml", Findings()), 3)
    assert {len(mark.path) for mark in alone.marks} >= {2002, 3000}
    assert seen(three) == seen(alone)


def test_livelock_over_ranks() -> None:
    system = load_files({"system": LIVELOCK, "ping": PING, "pong": PONG})
    alone, two = explored(system, 2)
    assert two.livelock is not None
    assert alone.livelock is not None
    assert seen(two) == seen(alone)
    assert len(two.livelock[1]) == len(alone.livelock[1])


def test_verdicts_and_replay() -> None:
    system = load_files({"system": DEADLOCK, "left": LEFT, "right": RIGHT})
    report = fsmkit.check(system, time="untimed", ranks=fsmkit.Ranks(2))
    by_name = {result.name: result for result in report.results}
    assert by_name["D"].verdict is Verdict.VIOLATED
    assert by_name["D"].trace is not None
    assert by_name["D"].trace.replayed == ("interpreter", "generated C")
    assert by_name["over"].verdict is Verdict.VIOLATED


LEADS = DEADLOCK + "  fair: {leads_to: [left.In(waiting), left.In(over)]}\n"


def test_what_one_process_alone_decides_is_said() -> None:
    system = load_files({"system": LEADS, "left": LEFT, "right": RIGHT})
    options = ExplorationOptions(time="untimed", ranks=Ranks(2))
    (fair,) = (r for r in check(system, Findings(), options=options).results if r.name == "fair")
    assert fair.verdict is Verdict.UNDECIDED
    assert "without `--mpi`" in fair.reason


def test_time_that_is_dense_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    path = ROOT / "machines/fischer/fischer.yaml"
    assert execute(["check", str(path), "--mpi", "2"]) == 1
    told = capsys.readouterr().err
    assert "time is dense" in told
    assert "--time discrete" in told


@pytest.mark.parametrize("variable", ["MPICC", "MPIRUN"])
def test_tools_that_are_missing(
    variable: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(variable, "no-such-command")
    assert execute(["check", str(TABLE), "--mpi", "2", "--time", "untimed"]) == 1
    told = capsys.readouterr().err
    assert "`no-such-command`" in told
    assert "apt install openmpi-bin" in told


def test_a_launcher_that_refuses_root(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    refusing = tmp_path / "mpirun"
    refusing.write_text(
        "#!/bin/sh\necho 'mpirun has detected an attempt to run as root.' >&2; exit 1\n"
    )
    refusing.chmod(0o755)
    monkeypatch.setenv("MPIRUN", str(refusing))
    assert execute(["check", str(TABLE), "--time", "untimed", "--mpi", "1"]) == 1
    said = capsys.readouterr().err
    assert "no result of 1 rank: mpirun has detected an attempt to run as root" in said
    assert "set OMPI_ALLOW_RUN_AS_ROOT=1 and OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1" in said


def test_goes_on_after_a_rank_died(tmp_path: Path) -> None:
    (model,) = (each for each in MODELS if each.name == "philosophers")
    file = tmp_path / "table.yaml"
    file.write_text(model.system.format(count=6, last=5, chart=HERE / model.chart))
    closed = close(load_any(file, Findings()), untimed=True)
    with closing(CEngine(closed, Findings())) as engine:
        alone = engine.explore(MEMORY, 0, None)
    with closing(CEngine(closed, Findings(), ranks=Ranks(2))) as engine:
        saved = ("--saved", str(tmp_path), "--identity", "x", "--save-every", "2")
        command = [*launcher(Ranks(2)), str(engine.program), "--ranks", "--livelock", *saved]
        environment = {**os.environ, **OVERSUBSCRIBED}
        with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
            while not (tmp_path / "commit").exists() and process.poll() is None:
                time.sleep(0.002)
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            os.kill(int(children[-1]), signal.SIGKILL)
            assert process.wait() != 0
        assert json.loads((tmp_path / "commit").read_text())["ranks"] == 2
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    told = json.loads(done.stdout)["result"]
    assert (told["states"], told["transitions"], told["depth"]) == (
        alone.states,
        alone.transitions,
        alone.depth,
    )
    assert told["expanded"] == alone.states
    assert [m["locals"] for m in told["machines"]] == [m.locals for m in alone.machines]
    assert not list(tmp_path.glob("rank-*"))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('{"identity": "another", "ranks": 2}', "another system"),
        ("[]", "cannot be read"),
        ("{", "cannot be read"),
    ],
)
def test_checkpoints_that_do_not_fit(
    text: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "commit").write_text(text)
    arguments = ["check", str(TABLE), "--mpi", "2", "--time", "untimed", "--resume", str(tmp_path)]
    assert execute(arguments) == 1
    assert why in capsys.readouterr().err


def test_checkpoints_go_when_all_is_explored(tmp_path: Path) -> None:
    ranks = Ranks(2, folder=tmp_path / "kept", every=1)
    options = ExplorationOptions(time="untimed", ranks=ranks)
    report = check(load_any(TABLE, Findings()), Findings(), options=options)
    assert report.exploration.end is End.COMPLETE
    assert not list((tmp_path / "kept").iterdir())


def test_options_that_need_ranks(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", str(TABLE), "--resume", "there"]) == 2
    assert "--mpi" in capsys.readouterr().err


def test_one_storage() -> None:
    options = ExplorationOptions(
        time="untimed", ranks=Ranks(2), storage=Storage.BITSTATE, search=Search.EXPLICIT
    )
    with pytest.raises(FsmkitError, match="bitstate"):
        check(load_any(TABLE, Findings()), Findings(), options=options)
