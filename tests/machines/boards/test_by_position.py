"""The boards in C, whose sorter goes by an estimate of where each block is."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.machines.boards.playing import CELL
from tests.needs import need

SECONDS = 60


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.external
def test_bad_blocks_are_rejected_by_position(tmp_path: Path) -> None:
    pytest.importorskip("zmq")
    need(shutil.which("pkg-config") is not None, "pkg-config")
    command = ["-m", "machines.production_cell.simulation", "--sorter", "position", "--bad", "1"]
    done = subprocess.run(
        [sys.executable, *command, "--seconds", str(SECONDS), "--out", str(tmp_path)],
        cwd=CELL.parents[1], capture_output=True, text=True, check=False, timeout=280,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    figures = result["figures"]
    assert figures["rejected"] >= 1
    assert figures["estimates"] >= figures["rejected"]
    assert not any(figures[name] for name in ("bad_passed", "good_rejected", "wrong_estimates"))
    assert not any(figures[name] for name in ("lost", "doubled", "collisions", "refused"))
    judged = {each["name"]: each["holds"] for each in result["properties"]}
    assert judged["Q1"]
    assert judged["Q3"]
