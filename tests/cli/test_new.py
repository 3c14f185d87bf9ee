"""``fsmkit new``: what it writes passes `check`, `test` and `fmt --check`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any


@pytest.mark.cc
def test_what_is_written_passes_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for like in ("chart", "device", "parallel", "system"):
        assert execute(["new", str(tmp_path / f"{like}.yaml"), "--like", like]) == 0
    assert execute(["new", str(tmp_path / "chart.test.yaml"), "--like", "test"]) == 0
    assert len([*tmp_path.glob("*.yaml")]) == 7
    capsys.readouterr()
    assert execute(["check", str(tmp_path)]) == 0
    told = capsys.readouterr()
    assert "6 files: 6 hold" in told.out
    assert "warning" not in told.err
    assert execute(["test", str(tmp_path / "chart.test.yaml")]) == 0
    assert "2 passed" in capsys.readouterr().out
    assert execute(["fmt", "--check", str(tmp_path)]) == 0


def test_the_modeline_names_a_schema(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "my-gate2.yaml"
    assert execute(["new", str(file)]) == 0
    capsys.readouterr()
    line = file.read_text().split("\n")[0]
    address = line.removeprefix("# yaml-language-server: $schema=")
    assert address == "chart.schema.json"
    assert json.loads((tmp_path / address).read_text())["title"] == "A statechart of fsmkit"
    assert execute(["new", str(tmp_path / "second.yaml")]) == 0  # the schema exists: it stays
    assert capsys.readouterr().out == f"{tmp_path / 'second.yaml'}\n"
    assert load_any(file, Findings()).name == "MyGate2"
    bare = tmp_path / "gate.yml"
    assert execute(["new", str(bare), "--no-modeline", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"files": [str(bare)]}
    assert bare.read_text().startswith("chart: Gate\n")


@pytest.mark.cc
def test_the_examples_pass_check_and_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "examples"
    assert execute(["new", "--examples", str(folder)]) == 0
    assert len(capsys.readouterr().out.splitlines()) == sum(map(Path.is_file, folder.rglob("*")))
    assert execute(["new", "--examples", str(folder)]) == 1
    assert "exists already" in capsys.readouterr().err
    monkeypatch.chdir(folder)
    assert execute(["test"]) == 0
    assert "0 failed" in capsys.readouterr().out
    systems = ["gate/gate.yaml", "gate/gate.system.yaml", "crossing/crossing.system.yaml"]
    assert execute(["check", "charger/charger.yaml", *systems]) == 0
    assert "4 files: 4 hold" in capsys.readouterr().out
    assert execute(["fmt", "--check", "."]) == 0


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "cell_sender.yaml"
    taken.write_text("mine")
    assert execute(["new", str(tmp_path / "cell.yaml"), "--like", "system"]) == 1
    assert "exists already" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == [taken]
    assert taken.read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["gate.scxml"], "not the name of a YAML file"),
        (["1.yaml"], "start with a letter"),
        (["gate.yaml", "--like", "test"], "ends with `.test.yaml`"),
        (["gate.yaml", "--like", "sistem"], "did you mean `system`?"),
    ],
)
def test_wrong_use_is_told(
    arguments: list[str], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert execute(["new", *arguments]) == 2
    assert told in " ".join(capsys.readouterr().err.split())
    assert [*tmp_path.iterdir()] == []
