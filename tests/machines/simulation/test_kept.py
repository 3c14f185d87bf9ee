"""Boards that supervisord begins: they are found, killed, and found again; it ends with the run."""

from __future__ import annotations

import os
import sys
import tempfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from machines.production_cell.simulation import nodes
from machines.production_cell.simulation.camera import Judgement
from machines.production_cell.simulation.faults import schedule
from machines.production_cell.simulation.kept import kept
from machines.production_cell.simulation.nodes import CellError, Program
from machines.production_cell.simulation.orchestrator import Orchestrator, Outcome, Setup
from machines.production_cell.simulation.pace import Pace
from machines.production_cell.simulation.panel import Operator
from machines.production_cell.simulation.signals import COMMANDS
from machines.production_cell.simulation.world import World
from tests.machines.simulation.test_run import GOOD, SERVER
from tests.needs import need

pytestmark = [pytest.mark.external, pytest.mark.cc]

WRITES = {"a": [*COMMANDS, "lamp", "supervisor.state"], "b": ["sorter.fault"]}
"""By board."""
PID = 'elif kind == b"R":\n        import os; socket.send(b"R%d" % os.getpid())\n    else:'


def made(folder: Path, sockets: str, **other: str) -> Setup:
    """Return a run of two boards of a few lines, at 50 Hz."""
    programs = []
    for name, writes in WRITES.items():
        text = SERVER.replace(
            "else:\n        socket.send(kind)", PID + "\n        socket.send(kind)"
        )
        for word, meaning in (GOOD | {"WRITES": repr(writes)} | other).items():
            text = text.replace(word, meaning)
        (folder / f"{name}.py").write_text(text)
        programs.append(Program(name, (sys.executable, str(folder / f"{name}.py"), "{endpoint}")))
    plant = nodes.plant_program(1)
    return Setup(3000, tuple(programs), plant, folder, Path(sockets), pings=5, pace=Pace(50))


def run(setup: Setup) -> Outcome:
    return Orchestrator(setup, lambda states: World(Operator(), Judgement(), states)).run()


def test_a_killed_board_is_found_again(tmp_path: Path) -> None:
    need(find_spec("supervisor") is not None, "supervisor")
    faults = schedule([{"at": 1, "fault": "kill", "board": "b", "for": 0.5}])
    with tempfile.TemporaryDirectory() as sockets:
        with kept(replace(made(tmp_path, sockets), faults=faults)) as setup:
            outcome = run(setup)
        assert outcome.steps == 3000
        (before,), after = outcome.lives["b"], outcome.reports["b"]
        assert before != after
        assert len(outcome.back["b"]) == 1
        for pid in (before, after, outcome.reports["a"]):
            with pytest.raises(ProcessLookupError):
                os.kill(int(str(pid)), 0)
    log = (tmp_path / "supervisord.log").read_text(encoding="utf-8")
    assert [log.count(f"spawned: 'fsmkit-ring-{name}'") for name in WRITES] == [1, 2]


def test_a_board_that_always_fails_ends_the_run(tmp_path: Path) -> None:
    need(find_spec("supervisor") is not None, "supervisor")
    with tempfile.TemporaryDirectory() as sockets:
        setup = made(tmp_path, sockets, **{"socket.bind": "sys.exit"})
        with kept(setup) as kept_setup, pytest.raises(CellError, match=r"^a "):
            run(kept_setup)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"pace": Pace()}, "--kept needs --hz"),
        ({"boards": (Program("a", ("x",), (Path("x"), Path("y"))),)}, "remove --registers"),
    ],
)
def test_runs_that_supervisord_cannot_keep(
    change: dict[str, object], said: str, tmp_path: Path
) -> None:
    need(find_spec("supervisor") is not None, "supervisor")
    setup = replace(made(tmp_path, str(tmp_path)), **change)  # type: ignore[arg-type]
    with pytest.raises(CellError, match=said), kept(setup):
        pass
