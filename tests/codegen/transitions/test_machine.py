"""A generated module on the library itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import fsmkit
from devtools.differential import compare_all, explain
from devtools.plain import compare_plain, main, plain_case
from devtools.transitions_harness import TransitionsHarness
from fsmkit.codegen.transitions import limits
from fsmkit.codegen.transitions.order import Order
from fsmkit.codegen.transitions.plugin import PLUGIN
from fsmkit.diagnostics import Findings
from fsmkit.plan import lower
from fsmkit.testing.harness.harness import INTERPRETER

DOOR = """\
chart: Door
doc: Opens unless something is in the way.
types:
  Way: [free, blocked]
data:
  opened: uint8 = 0
  state: uint8 = 7
  samples: uint8[2] = 0
inputs:
  way: Way
operations:
  - lamp(on bool)
  - locked() -> bool
events:
  in: [open, close, "note(n 0..9)", start]
  out: ["moved(count uint8)"]
initial: closed
states:
  closed:
    on:
      open:
        if: way == Way.free and not locked()
        target: moving
        do: opened += 1; log "go", opened
  moving:
    initial: slow
    exit: send moved(count = opened)
    on:
      close: closed
    states:
      slow:
        entry: lamp(true)
        on:
          note:
            if: event.n > 3
            target: fast
            do: |
              samples[1] = event.n
              for state in samples { log "had", state }
      fast:
        on:
          close: {if: In(moving) and state != 0, target: slow, do: raise close}
"""


@pytest.fixture
def door(tmp_path: Path) -> Path:
    path = tmp_path / "door.yaml"
    path.write_text(DOOR)
    return path


@pytest.mark.cc
def test_is_used_as_the_library_is(door: Path, tmp_path: Path) -> None:
    files = fsmkit.compile(door, "transitions")
    assert list(files) == ["door_machine.py"]
    (tmp_path / "door_machine.py").write_text(files["door_machine.py"])
    use = """\
from door_machine import DoorMachine, DoorModel, Way

class Door(DoorModel):
    def lamp(self, on): print("lamp", on)
    def locked(self): return False
    def send_moved(self, count): print("moved", count)

door = Door()
DoorMachine(door)
print(door.state, door.way == Way.free, door.state_)
door.open()
print(door.state, door.is_moving.slow())
door.note(2)
door.note(5)
print(door.state, door.samples)
door.close()
print(door.state, door.opened)
"""
    ran = subprocess.run(
        [sys.executable, "-c", use], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert ran.stdout.splitlines() == [
        "closed True 7",
        "lamp True",
        "moving/slow True",
        "moving/fast [0, 5]",
        "lamp True",
        "moved 1",
        "closed 1",
    ]


@pytest.mark.cc
@pytest.mark.parametrize(
    ("call", "method"), [("lamp(True)", "lamp"), ("send_moved(1)", "send_moved")]
)
def test_who_leaves_out_a_method_of_the_host_learns_which(
    call: str, method: str, door: Path, tmp_path: Path
) -> None:
    (tmp_path / "door_machine.py").write_text(
        fsmkit.compile(door, "transitions")["door_machine.py"]
    )
    use = f"from door_machine import DoorModel\nDoorModel().{call}"
    ran = subprocess.run(
        [sys.executable, "-c", use], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    told = ran.stderr.splitlines()[-1]
    assert told == f"NotImplementedError: define `{method}` in a subclass of `DoorModel`"


@pytest.mark.cc
def test_is_typed(door: Path, tmp_path: Path) -> None:
    (tmp_path / "door_machine.py").write_text(
        fsmkit.compile(door, "transitions")["door_machine.py"]
    )
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    ran = subprocess.run(
        [*command, "door_machine.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout


def test_is_the_same_for_the_same_chart(door: Path) -> None:
    chart = fsmkit.read_chart(door)
    first = PLUGIN.generate(chart, Findings(), {})
    assert first == PLUGIN.generate(fsmkit.read_chart(door), Findings(), {})


def test_begins_silently_only_where_nothing_is_done(door: Path) -> None:
    silent = fsmkit.compile(door, "transitions")["door_machine.py"]
    assert 'initial="closed"' in silent
    door.write_text(DOOR.replace("  closed:\n", "  closed:\n    entry: lamp(false)\n", 1))
    begun = fsmkit.compile(door, "transitions")["door_machine.py"]
    assert 'initial="initial"' in begun
    assert '"trigger": "start_"' in begun  # the chart has an event of that name
    script = ["start 3", "dispatch start", "dump"]
    chart = fsmkit.read_chart(door)
    assert TransitionsHarness().run(chart, script)[:3] == ["@3 > start", "+ closed", "op lamp 0"]


def test_states_with_any_name(tmp_path: Path) -> None:
    path = tmp_path / "odd.scxml"
    path.write_text(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a.b">'
        '<state id="a.b"><transition event="go" target="c_d"/></state>'
        '<state id="c_d"><state id="e-f"><transition event="go" target="a.b"/></state></state>'
        "</scxml>"
    )
    script = ["start 0", "dispatch go", "dispatch go", "dump"]
    told = TransitionsHarness().run(fsmkit.read_chart(path), script)
    assert [line for line in told if line.startswith("=")] == ["= a.b", "= e-f", "= a.b"]


# --- beside the interpreter -------------------------------------------------------------------


@pytest.mark.slow
def test_random_charts() -> None:
    totals = compare_plain(7, 0, 150)
    for name, found in totals.divergences[:1]:
        pytest.fail(explain(plain_case(7, int(name.split()[1])), found))
    assert totals.charts > 75
    assert totals.macrosteps > 1000


@pytest.mark.slow
def test_random_charts_use_what_the_library_has() -> None:
    """Nested and parallel states, guards, content at each place, events that end and raise."""
    words = ["regions", "op act", "op ask", "out out0", "raise e", "finished", "unhandled", "log"]
    words += ["timeout", "delay ", "+ x"]
    seen = dict.fromkeys(words, 0)
    for number in range(100):
        case = plain_case(7, number)
        if limits.check(case.chart, Findings()):
            trace = TransitionsHarness().run(case.chart, case.script)
            seen["regions"] += any(state.kind.value == "parallel" for state in case.chart.states)
            for word in words[1:]:
                seen[word] += any(word in line for line in trace)
    assert all(count >= 2 for count in seen.values()), seen


@pytest.mark.slow
def test_another_order_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the steps of Appendix D, the comparison finds charts that differ."""
    cases = [plain_case(5, number) for number in range(60)]
    accepted = [case for case in cases if limits.check(case.chart, Findings())]
    ordered = [case for case in accepted if not Order(lower(case.chart)).is_plain]
    monkeypatch.setattr(Order, "is_plain", True)
    totals = compare_all(ordered, [TransitionsHarness()])
    assert totals.divergences


def test_the_order_of_marks_hides_nothing(door: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Content at the wrong side of an entry is seen."""
    chart = fsmkit.read_chart(door)
    script = ["start 0", "dispatch open", "dump"]
    expected = INTERPRETER.run(chart, script)
    assert TransitionsHarness().run(chart, script) == expected
    monkeypatch.setattr(Order, "place_of_content", lambda *_: "after")
    assert sorted(TransitionsHarness().run(chart, script)) == sorted(expected)
    assert TransitionsHarness().run(chart, script) != expected


@pytest.mark.slow
def test_the_long_run_tells_its_figures() -> None:
    result = CliRunner().invoke(main, ["--charts", "10", "--seed", "3"])
    assert result.exit_code == 0, result.output
    assert " charts on transitions: " in result.output
    assert " 0 divergences; " in result.output


ENDED = """\
chart: Ended
events: {in: [go, end]}
initial: p
states:
  p:
    regions:
      one: {initial: a, states: {a: {on: {go: a}}}}
      two: {initial: b, states: {b: {on: {end: f}}, f: {final: true}}}
"""


def test_another_region_goes_on_after_the_last_one_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "ended.yaml"
    path.write_text(ENDED)
    chart = fsmkit.read_chart(path)
    script = ["start 0", "dispatch end", "dispatch go", "dispatch go", "dump"]
    assert TransitionsHarness().run(chart, script) == INTERPRETER.run(chart, script)
