"""What wires promise narrows a proof: how often inputs and events come, and with which values."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.verify.replay import perform
from tests.carriers.wires.conftest import write

PRESSED = """\
chart: Lift
inputs: {gate_open: bool, load: 0..4000}
data: {heavy: bool = false}
events: {in: [pressed]}
capacity: {tick: 1ms}
initial: on_duty
states:
  on_duty:
    regions:
      button:
        initial: idle
        states:
          idle: {rest: true, on: {pressed: pulse}}
          pulse: {after: {20ms: idle}, on: {pressed: missed}}
          missed: {rest: true}
      gate:
        initial: shut
        states:
          shut: {rest: true, always: [{if: gate_open, target: opened}]}
          opened: {after: {20ms: steady}, always: [{if: not gate_open, target: bounced}]}
          steady: {rest: true, always: [{if: not gate_open, target: shut}]}
          bounced: {rest: true}
      scale:
        initial: light
        states:
          light: {rest: true, always: [{if: load > 900 and not heavy, do: heavy = true}]}
"""
SYSTEM = """\
system: Plant
machines: {mould: mould.yaml}
environment: {may: [mould.pressed, mould.gate_open, "mould.load in {0, 500, 1000}"]}
properties:
  no_press_is_missed: {never: mould.In(missed)}
  no_bounce: {never: mould.In(bounced)}
  not_heavy: {never: mould.heavy}
"""
WIRES = """\
board: a
deployment: deployment.yaml
period: 1ms
signals:
  button: {digital_in: 0, debounce: BUTTON}
  gate: {digital_in: 1, debounce: GATE}
  cell: {number_in: 0, range: 0..MOST}
bind:
  mould:
    pressed: {rising: button}
    gate_open: not gate
    load: cell
"""


def files(folder: Path, button: str, gate: str, most: int = 4000) -> tuple[Path, Path]:
    """Write a lift behind its wires; return the deployment and the wires."""
    wires = WIRES.replace("BUTTON", button).replace("GATE", gate).replace("MOST", str(most))
    board = write(folder, PRESSED, wires, plant=SYSTEM)
    return folder / "deployment.yaml", board


def verdicts(deployment: Path, *boards: Path) -> dict[str, str]:
    """Check a deployment behind wires."""
    report = fsmkit.check(fsmkit.read_system(deployment, wires=boards))
    return {each.name: each.verdict.value for each in report.results if each.name in PROPERTIES}


PROPERTIES = ("no_press_is_missed", "no_bounce", "not_heavy")


@pytest.mark.cc
@pytest.mark.parametrize(
    ("button", "gate", "most", "violated"),
    [
        ("11ms", "21ms", 900, set()),
        ("9ms", "21ms", 900, {"no_press_is_missed"}),
        ("11ms", "19ms", 900, {"no_bounce"}),
        ("11ms", "21ms", 4000, {"not_heavy"}),
        ("1ms", "1ms", 4000, set(PROPERTIES)),
    ],
)
def test_debounce_and_ranges_decide(
    tmp_path: Path, button: str, gate: str, most: int, violated: set[str]
) -> None:
    found = verdicts(*files(tmp_path, button, gate, most))
    assert {name for name, verdict in found.items() if verdict == "violated"} == violated
    assert set(found.values()) <= {"holds", "violated"}


@pytest.mark.cc
@pytest.mark.parametrize("may", ["[mould.pressed, mould.gate_open]", "[mould.pressed]", "[]"])
def test_an_input_that_a_board_binds_is_not_frozen(tmp_path: Path, may: str) -> None:
    """An input that the system does not list is explored as its wire lets it change."""
    declared = 'may: [mould.pressed, mould.gate_open, "mould.load in {0, 500, 1000}"]'
    deployment, board = files(tmp_path, "9ms", "19ms", 4000)
    assert declared in SYSTEM
    (tmp_path / "plant.yaml").write_text(SYSTEM.replace(declared, f"may: {may}"))
    system = fsmkit.read_system(deployment, wires=[board])
    assert "the input `mould.gate_open` changes at most once in 19ms" in system.assumed
    never = "the event `mould.pressed` never comes: list it under `may`"
    assert (never in system.assumed) == (may == "[]")
    found = verdicts(deployment, board)
    violated = {name for name, verdict in found.items() if verdict == "violated"}
    assert violated == set(PROPERTIES) - ({"no_press_is_missed"} if may == "[]" else set())


@pytest.mark.cc
def test_without_wires_anything_may_come(tmp_path: Path) -> None:
    deployment, _ = files(tmp_path, "11ms", "21ms", 900)
    assert set(verdicts(deployment).values()) == {"violated"}


@pytest.mark.cc
def test_a_report_says_on_what_it_rests_and_a_trace_is_performed_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    deployment, board = files(tmp_path, "9ms", "21ms", 900)
    traces = tmp_path / "traces"
    given = [str(deployment), "--wires", str(board), "--save-trace", str(traces)]
    assert execute(["check", *given]) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert "assumed: the event `mould.pressed` comes at most once in 18ms" in told
    assert "assumed: the input `mould.gate_open` changes at most once in 21ms" in told
    (saved,) = traces.glob("*no_press_is_missed*.json")
    recorded = json.loads(saved.read_text(encoding="utf-8"))
    assert perform(recorded) == [step["lines"] for step in recorded["steps"]]
    assert recorded["wires"] == [str(board.resolve())]


@pytest.mark.cc
def test_engines_agree_behind_wires(tmp_path: Path) -> None:
    deployment, board = files(tmp_path, "9ms", "21ms", 900)
    system = fsmkit.read_system(deployment, wires=[board])
    found = [fsmkit.check(system, time="discrete", engine=engine) for engine in ("c", "python")]
    assert found[0].exploration.states == found[1].exploration.states


def test_wires_beside_a_chart_or_another_system_are_refused(tmp_path: Path) -> None:
    _, board = files(tmp_path, "1ms", "1ms")
    with pytest.raises(FsmkitError) as raised:
        fsmkit.read_system(tmp_path / "mould.yaml", wires=[board])
    assert raised.value.diagnostics[0].rule.name == "not-a-system"
    other = tmp_path / "other.yaml"
    other.write_text(
        SYSTEM.replace("{mould: mould.yaml}", "{press: mould.yaml}")
        .replace("mould.", "press.")
        .replace("press.yaml", "mould.yaml"),
        encoding="utf-8",
    )
    with pytest.raises(FsmkitError) as raised:
        fsmkit.read_system(other, wires=[board])
    assert raised.value.diagnostics[0].rule.name == "unfit-wire"
    with pytest.raises(FsmkitError) as raised:
        fsmkit.read_system(tmp_path / "plant.yaml", wires=[tmp_path / "deployment.yaml"])
    assert raised.value.diagnostics[0].rule.name == "broken-board"
