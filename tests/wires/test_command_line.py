"""``fsmkit check`` and ``fsmkit compile`` of wires."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.wires.conftest import write
from tests.wires.test_reader import CHART, WIRES


def test_wires_are_checked_without_being_compiled(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, CHART, WIRES)
    monkeypatch.chdir(tmp_path)
    assert execute(["check", "board_a.io.yaml"]) == 0
    told = capsys.readouterr().out
    assert told == "board_a.io.yaml: signals 9, devices 1, inputs 3, events 4, operations 4\n"
    assert execute(["check", "board_a.io.yaml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["boards"][0]["signals"] == 9
    write(tmp_path, CHART, WIRES.replace("heat: heater", "heat: button"))
    assert execute(["check", "board_a.io.yaml"]) == 1
    assert "error[FK0566] unfit-wire: `button` is an input" in capsys.readouterr().err
    (tmp_path / "board_a.io.yaml").write_text(CHART)
    assert execute(["check", "board_a.io.yaml"]) == 1
    assert "has no key `board`" in capsys.readouterr().err


def test_wires_are_compiled_to_c_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, CHART, WIRES)
    monkeypatch.chdir(tmp_path)
    assert execute(["compile", "board_a.io.yaml", "--out", "made"]) == 0
    names = sorted(path.name for path in (tmp_path / "made").iterdir())
    wanted = ["board_a_io.c", "board_a_io.h", "board_a_io.json", "fsm_io.c", "fsm_io.h"]
    assert names == wanted
    described = json.loads((tmp_path / "made/board_a_io.json").read_text())
    assert described["signals"][5] == {
        "name": "lamp",
        "kind": "digital_out",
        "number": 1,
        "offset": 20,
        "bits": 1,
        "is_output": True,
        "active_low": True,
        "safe": 0,
    }
    capsys.readouterr()
    assert execute(["compile", "board_a.io.yaml", "--target", "python"]) != 0
    assert execute(["compile", "board_a.io.yaml", "--with", "trace"]) != 0
    assert "without options" in capsys.readouterr().err
