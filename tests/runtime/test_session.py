from __future__ import annotations

import json
from collections.abc import Callable
from enum import Enum
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime.clock import SimulatedClock, WallClock
from fsmkit.runtime.session import Session, bind

FEEDER = """\
chart: Feeder
types:
  Fault: [none, lost, jam]
data:
  retries: 0..3 = 0
  last: Fault = none
  samples: uint8[2] = 0
inputs:
  position: 0..4000
  empty: bool
outputs:
  lamp: bool = false
operations:
  - goto(position 0..4000, why Fault)
  - query() -> 0..3
events:
  in:
    - arrived
    - fault(code Fault)
    - ask() -> 0..3
    - ping() -> Fault
  out:
    - pushed(n 0..3, code Fault)
initial: idle
states:
  idle:
    on:
      arrived: {target: pushing, do: "goto(position, Fault.jam); retries = query()"}
      ask: {do: reply 2}
      ping: {do: reply last}
  pushing:
    entry: lamp = true
    exit: lamp = false
    after: {500ms: {target: idle, do: "send pushed(n = retries, code = Fault.lost)"}}
    on:
      fault: {target: broken, do: last = event.code}
  broken: {final: true}
"""


class Cell:
    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.answer: object = 3

    def goto(self, position: int, why: str) -> None:
        self.calls.append(("goto", position, why))

    def query(self) -> object:
        return self.answer

    def on_pushed(self, n: int, code: str) -> None:
        self.calls.append(("pushed", n, code))


@pytest.fixture
def chart(build: Callable[[str], Chart]) -> Chart:
    return build(FEEDER)


@pytest.fixture
def cell() -> Cell:
    return Cell()


@pytest.fixture
def session(chart: Chart, cell: Cell) -> Session:
    return Session(chart, cell, inputs={"position": 12})


def rule_of(error: pytest.ExceptionInfo[FsmkitError]) -> str:
    return error.value.diagnostics[0].rule.name


def test_events_operations_and_time(session: Session, cell: Cell) -> None:
    assert session.active == session.configuration == ("idle",)
    assert session.post("arrived")
    session.run()
    assert session.is_in("pushing")
    assert cell.calls == [("goto", 12, "jam")]
    assert session.data == {"retries": 3, "last": "none", "samples": [0, 0]}
    assert session.outputs == {"lamp": True}
    session.advance("499ms")
    assert session.is_in("pushing")
    assert session.next_deadline == 500
    session.advance(1)
    assert session.is_in("idle")
    assert cell.calls[1:] == [("pushed", 3, "lost")]
    assert [(sent.event, sent.fields) for sent in session.sent] == [
        ("pushed", {"n": 3, "code": "lost"})
    ]


class Code(Enum):
    lost = "anything"


@pytest.mark.parametrize("code", ["lost", 1, Code.lost])
def test_enumerations_by_name_index_or_member(session: Session, code: object) -> None:
    session.post("arrived")
    session.post("fault", code=code)
    session.run()
    assert session["last"] == "lost"
    assert session.is_finished
    assert not session.is_running
    assert not session.post("arrived")
    assert session.run() == ()
    session.start()
    assert session.active == ("idle",)
    assert session.data["last"] == "none"


def test_dispatch_tells_whether_and_what(session: Session) -> None:
    assert session.dispatch("ask").reply == 2
    assert session.dispatch("ping").reply == "none"
    assert not session.dispatch("fault", "jam")


def test_inputs(session: Session) -> None:
    session.inputs["position"] = 99
    session.inputs.update(empty=True)
    assert dict(session.inputs) == {"position": 99, "empty": True}
    assert session["position"] == 99


@pytest.mark.parametrize(
    ("act", "rule"),
    [
        (lambda s: s.post("arived"), "unknown-at-run-time"),
        (lambda s: s.post("pushed", 1, "lost"), "unknown-at-run-time"),
        (lambda s: s.post("error.execution"), "unknown-at-run-time"),
        (lambda s: s.is_in("nowhere"), "unknown-at-run-time"),
        (lambda s: s["nothing"], "unknown-at-run-time"),
        (lambda s: s.inputs["nothing"], "unknown-at-run-time"),
        (lambda s: s.inputs.update(position=4001), "wrong-value"),
        (lambda s: s.inputs.update(position="1"), "wrong-value"),
        (lambda s: s.inputs.update(empty=2), "wrong-value"),
        (lambda s: s.post("fault"), "wrong-value"),
        (lambda s: s.post("fault", "lost", code="lost"), "wrong-value"),
        (lambda s: s.post("fault", "oops"), "wrong-value"),
        (lambda s: s.advance("soon"), "wrong-value"),
        (lambda s: s.advance(-1), "wrong-value"),
    ],
)
def test_misuse_is_a_diagnostic(
    session: Session, act: Callable[[Session], object], rule: str
) -> None:
    with pytest.raises(FsmkitError) as error:
        act(session)
    assert rule_of(error) == rule


def test_close_names_are_suggested(session: Session) -> None:
    with pytest.raises(FsmkitError, match="did you mean `arrived`"):
        session.post("arived")


def test_every_missing_operation_is_listed(chart: Chart) -> None:
    with pytest.raises(FsmkitError) as error:
        Session(chart, {"query": lambda: 0})
    assert [d.rule.name for d in error.value.diagnostics] == ["missing-operation"]
    with pytest.raises(FsmkitError) as error:
        Session(chart)
    assert len(error.value.diagnostics) == 2


def test_a_wrong_result_is_told(session: Session, cell: Cell) -> None:
    cell.answer = 7
    session.post("arrived")
    with pytest.raises(FsmkitError) as error:
        session.run()
    assert rule_of(error) == "wrong-result"
    cell.answer = 1
    session.run()
    assert session.is_in("pushing"), "the failed run has changed nothing"


def test_a_step_within_a_step_is_refused_but_posting_is_not(chart: Chart) -> None:
    class Impatient(Cell):
        def goto(self, position: int, why: str) -> None:
            super().goto(position, why)
            machine.post("fault", code="jam")
            with pytest.raises(FsmkitError) as error:
                machine.dispatch("ask")
            assert rule_of(error) == "step-within-step"

    machine = Session(chart, Impatient())
    machine.post("arrived")
    machine.run()  # the posted event is taken as soon as the step has ended
    assert machine.is_finished


def test_saved_and_restored_elsewhere(session: Session, chart: Chart, cell: Cell) -> None:
    session.post("arrived")
    session.advance("100ms")
    session.advance("100ms")
    session.post("fault", "jam")
    saved = json.loads(json.dumps(session.save()))
    clock = SimulatedClock()
    clock.advance(7_000_000)
    other = Session(chart, cell, clock)
    other.restore(saved)
    assert other.next_deadline == 7000 + 400
    assert other["position"] == 12
    other.run()
    assert other["last"] == "jam"


def test_other_charts_and_damaged_snapshots_are_refused(
    session: Session, build: Callable[[str], Chart], cell: Cell
) -> None:
    saved = session.save()
    other = Session(build(FEEDER.replace("500ms", "501ms")), cell)
    with pytest.raises(FsmkitError) as error:
        other.restore(saved)
    assert rule_of(error) == "foreign-snapshot"
    del saved["timers"]
    with pytest.raises(FsmkitError) as error:
        session.restore(saved)
    assert rule_of(error) == "foreign-snapshot"


def test_the_decorator_binds_methods(chart: Chart) -> None:
    @bind(chart)
    class Feeder(Cell):
        machine: Session

        def __init__(self, name: str) -> None:
            super().__init__()
            self.name = name

    one, two = Feeder("one"), Feeder("two")
    one.machine.post("arrived")
    one.machine.run()
    assert one.machine.is_in("pushing")
    assert two.machine.is_in("idle")
    assert one.calls
    assert not two.calls
    with pytest.raises(FsmkitError) as error:
        bind(chart)(type("Empty", (), {}))
    assert rule_of(error) == "missing-operation"


def test_the_wall_clock_goes_by_itself(chart: Chart, cell: Cell) -> None:
    clock = WallClock()
    session = Session(chart, cell, clock)
    assert 0 <= clock.microseconds() <= clock.microseconds()
    with pytest.raises(FsmkitError) as error:
        session.advance("1s")
    assert rule_of(error) == "clock-not-simulated"


def test_the_trace_is_kept(chart: Chart, cell: Cell) -> None:
    session = Session(chart, cell, keep=1)
    session.post("arrived")
    session.run()
    text = session.trace_text()
    assert text.startswith("@0 > event arrived\n- idle\n")
    assert text.endswith("= pushing")
