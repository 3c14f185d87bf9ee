"""``fsmkit check``: exit codes, JSON, and traces as files that perform themselves."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.verify.systems import SYSTEMS


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    for name, text in SYSTEMS["drive"].items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "drive.yaml"


def test_exit_code_tells_whether_all_holds(drive: Path) -> None:
    assert execute(["check", str(drive), "--engine", "python", "--property", "tries"]) == 0
    assert execute(["check", str(drive), "--engine", "python"]) == 1
    assert execute(["check", str(drive), "--memory", "much"]) == 2
    assert execute(["check", str(drive), "--assume-watchdogs-silent"]) == 2
    assert execute(["check", str(drive.with_name("nowhere.yaml"))]) == 1


def test_json(drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    execute(["check", str(drive), "--engine", "python", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert (told["verdict"], told["states"], told["transitions"]) == ("violated", 229, 420)
    assert told["engine"] == "python"
    found = {p["name"]: p for p in told["properties"]}
    assert found["never_twice"]["verdict"] == "violated"
    assert found["never_twice"]["trace"][-1]["at"] == 800_000
    assert set(told["bounds"]) == {"driver", "axis"}


def test_no_compiler_falls_back_to_python_and_says_so(
    drive: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    execute(["check", str(drive), "--json"])
    captured = capsys.readouterr()
    assert json.loads(captured.out)["engine"] == "python"
    assert "no-compiler" in captured.err
    assert execute(["check", str(drive), "--engine", "c"]) == 1


@pytest.mark.cc
def test_saved_traces_perform_themselves(drive: Path, tmp_path: Path) -> None:
    folder = tmp_path / "traces"
    execute(["check", str(drive), "--engine", "python", "--save-trace", str(folder)])
    names = {path.name for path in folder.iterdir()}
    assert {"Drive_never_twice.json", "Drive_never_twice.mmd"} <= names
    diagram = (folder / "Drive_never_twice.mmd").read_text(encoding="utf-8")
    assert diagram.startswith("sequenceDiagram")
    assert "outside->>m0: begin" in diagram
    command = [sys.executable, "-m", "pytest", "-q", str(folder), "-p", "no:cacheprovider"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_a_folder_that_cannot_be_written_is_told(drive: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" / "traces"
    assert execute(["check", str(drive), "--engine", "python", "--save-trace", str(folder)]) == 1
