"""Features that the library lacks: time, histories, eventless transitions, the order of steps."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fsmkit
from devtools.differential import first_difference
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.walks import walk
from devtools.transitions_harness import TransitionsHarness
from fsmkit.codegen.transitions.moves import moves_of
from fsmkit.testing.harness.harness import INTERPRETER

CELL = Path(__file__).parents[3] / "machines" / "production_cell"
LIFT = """\
chart: Lift
data: {calls: 0..9 wrap = 0}
inputs: {door_open: bool}
operations: [up(), down(), stop()]
events: {in: [call, halt, go_on], out: [late]}
initial: idle
states:
  idle: {on: {call: ride}}
  ride:
    initial: quick
    on: {halt: halted}
    states:
      begin: {initial: up, states: {up: {entry: up(), after: {5s: down}}, down: {entry: down()}}}
      quick: {choice: [{if: door_open, target: waits}, {target: begin, do: calls += 1}]}
      waits: {always: [{if: not door_open, target: begin}], every: {2s: {do: LATE}}}
      seat: {history: deep, default: down}
  halted:
    entry: stop(); cancel l
    on: {go_on: seat}
""".replace("LATE", "send late after 1s as l")


def facts(path: Path) -> frozenset[str]:
    chart = fsmkit.read_chart(path)
    return moves_of(chart).facts


@pytest.mark.slow
@pytest.mark.parametrize(("name", "taken"), [("feeder", 20), ("molder", 20)])
def test_walks_of_the_cell(name: str, taken: int) -> None:
    """The long run is `python -m devtools.plain --walk FILE --steps 100000`."""
    chart = fsmkit.read_chart(CELL / f"{name}.yaml")
    script, expected = walk(SeededChoices(f"{name} 1"), chart, 1500)
    found = TransitionsHarness().run(chart, script)
    assert first_difference("transitions", expected, found) is None
    assert len({line for line in expected if line.startswith("t ")}) >= taken


def test_each_part_is_there_only_where_it_is_needed(tmp_path: Path) -> None:
    path = tmp_path / "lift.yaml"
    path.write_text(LIFT)
    assert facts(path) == {"always", "inputs", "timers", "order", "history", "leaves"}
    path.write_text(LIFT.replace("    on: {go_on: seat}\n", "").replace("stop(); ", ""))
    assert facts(path) == {"always", "inputs", "timers"}
    assert facts(CELL / "molder.yaml") >= {"order"}
    path.write_text("chart: A\ninitial: a\nstates: {a: {}}\n")
    assert facts(path) == frozenset()
    assert "Steps" not in fsmkit.compile(path, "transitions")["a_machine.py"]


@pytest.mark.cc
def test_a_host_lets_time_pass(tmp_path: Path) -> None:
    path = tmp_path / "lift.yaml"
    path.write_text(LIFT)
    (tmp_path / "lift_machine.py").write_text(
        fsmkit.compile(path, "transitions")["lift_machine.py"]
    )
    use = """\
from lift_machine import LiftMachine, LiftModel

class Lift(LiftModel):
    def up(self): print("up")
    def down(self): print("down")
    def stop(self): print("stop")
    def send_late(self): print("late", self.machine.now)

lift = Lift()
machine = LiftMachine(lift, now=100)
lift.start()
lift.door_open = True
lift.call()
print(lift.state, machine.next_deadline())
machine.run(3500)
lift.door_open = False
machine.run(3600)
print(lift.state, lift.calls, machine.next_deadline())
lift.halt()
machine.run(60000)
lift.go_on()
print(lift.state, machine.next_deadline())
"""
    ran = subprocess.run(
        [sys.executable, "-c", use], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert ran.stdout.splitlines() == [
        "ride/waits 2100",
        "late 3100",
        "up",
        "ride/begin/up 0 8600",
        "stop",
        "up",
        "ride/begin/up 65000",
    ]


@pytest.mark.cc
def test_all_parts_are_typed(tmp_path: Path) -> None:
    for name in ("feeder", "molder"):
        text = fsmkit.compile(CELL / f"{name}.yaml", "transitions")[f"{name}_machine.py"]
        (tmp_path / f"{name}_machine.py").write_text(text)
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    ran = subprocess.run(
        [*command, "feeder_machine.py", "molder_machine.py"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout


def test_an_endless_loop_is_an_error_of_the_library(tmp_path: Path) -> None:
    path = tmp_path / "loop.yaml"
    path.write_text(
        "chart: Loop\ninputs: {on: bool}\nevents: {in: [go]}\ninitial: a\nstates:\n"
        "  a: {on: {go: {}}, always: [{if: 'on', target: b}]}\n"
        "  b: {always: [{if: 'on', target: a}]}\n"
    )
    names: dict[str, object] = {"__name__": "loop"}
    exec(fsmkit.compile(path, "transitions")["loop_machine.py"], names)
    use = "model = LoopModel()\nmachine = LoopMachine(model)\nmodel.start()\nmodel.on = True\n"
    exec(use, names)
    with pytest.raises(Exception, match="more than 100 steps without an event") as error:
        exec("model.go()", names)
    assert type(error.value).__name__ == "MachineError"


HOSTILE = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"
       name="Steps" datamodel="fsmkit" initial="history">
  <fk:type name="Steps" members="NestedState HierarchicalMachine"/>
  <fk:type name="NestedState" members="a b"/>
  <fk:event direction="in" signature="_always"/>
  <fk:event direction="in" signature="_after_1"/>
  <fk:event direction="in" signature="settle"/>
  <fk:event direction="in" signature="machine"/>
  <datamodel><data id="recall_now" fk:type="Steps" expr="NestedState"/></datamodel>
  <state id="history" initial="run">
    <onexit><send event="settle" delay="2ms" id="__proto__"/></onexit>
    <history id="'&quot;&#10;x" type="deep"><transition target="run"/></history>
    <transition event="_always" target="out"/>
    <state id="run">
      <transition fk:after="1ms" target="wait">
        <assign location="recall_now" expr="Steps.HierarchicalMachine"/>
      </transition>
    </state>
    <state id="wait"><transition cond="recall_now == Steps.NestedState" target="run"/></state>
  </state>
  <state id="out">
    <transition event="_after_1" target="'&quot;&#10;x"/>
    <transition event="settle" target="HISTORY"/>
  </state>
</scxml>
"""


def test_names_that_the_module_has_itself(tmp_path: Path) -> None:
    path = tmp_path / "hostile.scxml"
    path.write_text(HOSTILE.replace("'&quot;&#10;x", "None]").replace("HISTORY", "None]"))
    chart = fsmkit.read_chart(path)
    script = ["start 0", "run 1", "dispatch _always", "run 2", "dispatch _after_1", "run 9"]
    script += ["dispatch _always", "run 30", "dispatch settle", "dispatch machine", "dump"]
    expected = INTERPRETER.run(chart, script)
    assert TransitionsHarness().run(chart, script) == expected
    assert expected.count("+ wait") == 3
