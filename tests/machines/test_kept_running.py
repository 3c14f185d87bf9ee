"""The boards of the cell under supervisord: killed ten times in two minutes, then made to fail.

Once more with the plant: they work again after each kill.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

import fsmkit
from fsmkit.codegen.units.service import Keeping
from fsmkit.runtime.health import health_of
from fsmkit.system.deployment.deployment import Deployment
from machines.production_cell.boards.build import build
from machines.production_cell.simulation import recording
from tests.codegen.test_units import files, running, supervised
from tests.needs import need, where

CELL = Path(__file__).parents[2] / "machines" / "production_cell"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.external,
    pytest.mark.cc,
    where(os.environ.get("FSMKIT_LONG_KEEPING"), "minutes: FSMKIT_LONG_KEEPING=1"),
]
KILLS = 10
APART = 12.0
"""Seconds from one to the next."""
LONGEST = 1.0
"""Seconds until a board answers again."""
PROGRAM = "fsmkit-ring:fsmkit-ring-b"


def test_a_killed_board_is_back_soon(tmp_path: Path) -> None:
    need(find_spec("supervisor") is not None, "supervisor")
    from supervisor.xmlrpc import SupervisorTransport

    deployment = fsmkit.read(CELL / "deployment.yaml")
    assert isinstance(deployment, Deployment)
    build(tmp_path / "boards")
    endpoints = tuple(zip(deployment.nodes, deployment.health, strict=True))
    command = f"{tmp_path}/boards/board_{{node}} --realtime {{health}}"
    made = files("supervisor", deployment, command, Keeping(tries=2))
    transport = SupervisorTransport(None, None, f"unix://{tmp_path}/s")
    proxy = ServerProxy("http://127.0.0.1", transport=transport)

    def answers(node: int) -> bool:
        (found,) = health_of(endpoints[node : node + 1], 0.05)
        return not found.status.startswith("no answer")

    def until(is_so: Callable[[], object], seconds: float = 30) -> float:
        begin = time.monotonic()
        while not is_so():
            assert time.monotonic() < begin + seconds
            time.sleep(0.01)
        return time.monotonic() - begin

    def pid() -> int:
        found = proxy.supervisor.getProcessInfo(PROGRAM)
        transport.close()
        assert isinstance(found, dict)
        return int(found["pid"])

    back = []
    with running(supervised(tmp_path, made)):
        until(lambda: answers(0) and answers(1))
        for _ in range(KILLS):
            begin = time.monotonic()
            time.sleep(APART / 2)
            os.kill(pid(), signal.SIGKILL)
            back.append(until(lambda: answers(1)))
            assert answers(0)
            time.sleep(max(0.0, begin + APART - time.monotonic()))
        print("back after, s:", " ".join(f"{each:.2f}" for each in back))  # noqa: T201
        assert max(back) <= LONGEST
        (tmp_path / "boards/board_b").unlink()
        shutil.copy("/bin/false", tmp_path / "boards/board_b")
        os.kill(pid(), signal.SIGKILL)
        log = tmp_path / "log"
        until(lambda: "entered FATAL state" in log.read_text(encoding="utf-8"), 60)
        assert answers(0)
        assert not answers(1)


def cell(out: Path, seconds: int, kills: list[float], gone: float, *words: str) -> dict[str, Any]:
    """Run the cell with boards of supervisord, of which b is killed at some times."""
    need(find_spec("supervisor") is not None, "supervisor")
    faults = out / "kills.yaml"
    lines = [f"- {{at: {at:g}, fault: kill, board: b, for: {gone:g}}}" for at in kills]
    faults.write_text("\n".join(lines))
    command = [sys.executable, "-m", "machines.production_cell.simulation", "--kept", "--hz", "200"]
    done = subprocess.run(
        [*command, "--seconds", str(seconds), "--fault", str(faults), "--out", str(out), *words],
        cwd=CELL.parents[1], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert not (out / "supervisord.pid").exists()
    found = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_the_cell_works_again_after_each_kill(tmp_path: Path) -> None:
    """Ten kills, 30 s apart: homing takes ten, and a block eight."""
    kills = [30.0 * n for n in range(1, KILLS + 1)]
    result = cell(tmp_path, 330, kills, LONGEST, "--priority", "80")
    print("connected again after, s:", result["back"]["b"])  # noqa: T201
    assert len(result["back"]["b"]) == KILLS
    assert max(result["back"]["b"]) <= LONGEST + 0.1  # for which it is left alone, and a cycle
    record = recording.read(tmp_path / "run.rec")
    moulded = record["count.moulded"]
    begun = [round(1000 * at) for at in kills]
    for first, last in zip(begun, [*begun[1:], len(moulded)], strict=True):
        assert moulded[last - 1] > moulded[first]
    assert result["figures"]["ends_in"] == "producing"
    assert result["figures"]["collisions"] == 0
