"""``fsmkit check`` and ``fsmkit compile`` of wires."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.carriers.wires.conftest import write
from tests.carriers.wires.test_reader import CHART, WIRES


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


WINDOW = """\
board: a
deployment: deployment.yaml
period: 1ms
signals:
  button: {digital_in: 0, active: low, host: true, register: {at: 0, shift: 3}}
  heat: {analog_in: 0, bits: 12, scale: {0: -400, 4095: 1000}, valid: 1..4095, host: true,
         register: {at: 4, access: 16}}
  lamp: {digital_out: 0, active: low, register: {at: 8, access: 8}}
  motor: {pwm: 0, full: 100, signed: true, register: {at: 12, access: 16}}
"""


def test_wires_are_shown_and_set_by_hand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, "chart: Mould\nstates: {s: {}}\n", WINDOW)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "window").write_bytes(bytes(14))
    base = ["io", "board_a.io.yaml", "--map", "window"]
    assert execute([*base, "set", "motor", "--", "-7"]) == 0
    assert execute([*base, "set", "lamp", "on"]) == 0
    assert execute([*base, "set", "heat", "4095", "--inputs"]) == 0
    assert execute([*base, "set", "lamp", "off"]) == 0
    assert (tmp_path / "window").read_bytes()[12:14] == (-7).to_bytes(2, sys.byteorder, signed=True)
    capsys.readouterr()
    assert execute([*base, "show"]) == 0
    shown = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert shown == [
        ["signal", "kind", "raw", "means"],
        ["button", "digital_in", "0", "0", "on"],
        ["heat", "analog_in", "0", "4095", "1000"],
        ["lamp", "digital_out", "0", "1", "off"],
        ["motor", "pwm", "0", "-7", "-7"],
    ]
    assert execute([*base, "set", "heat", "0", "--inputs"]) == 0
    assert execute([*base, "show", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["signals"]
    assert [each["means"] for each in told] == ["on", None, "off", "-7"]
    assert execute([*base, "watch", "--for", "20ms"]) == 0
    watched = [line.split(maxsplit=1)[1] for line in capsys.readouterr().out.splitlines()]
    assert watched == ["button on", "heat not valid", "lamp off", "motor -7"]


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (["set", "motor", "101"], 1, "it is within -100..100"),
        (["set", "lamp", "3"], 1, "it is on or off"),
        (["set", "lam", "on"], 1, "did you mean `lamp`?"),
        (["set", "button", "on"], 1, "`button` is an input"),
        (["set", "lamp"], 2, "set NAME VALUE"),
        (["show", "--from", "x"], 2, "not an address"),
        (["show", "--from", "3"], 1, "cannot be mapped"),
        (["show", "--map", "missing"], 1, "cannot be mapped"),
        (["show", "--map", "short"], 1, "cannot be mapped"),
    ],
)
def test_what_cannot_be_done_by_hand_is_refused(
    words: list[str],
    code: int,
    why: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write(tmp_path, "chart: Mould\nstates: {s: {}}\n", WINDOW)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "window").write_bytes(bytes(14))
    (tmp_path / "short").write_bytes(bytes(3))
    assert execute(["io", "board_a.io.yaml", "--map", "window", *words]) == code
    assert why in capsys.readouterr().err
