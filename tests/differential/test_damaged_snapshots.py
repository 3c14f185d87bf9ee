"""Snapshots with right checksums that no machine can have are rejected on every target.

The long run is ``python -m devtools.snapshots``.
"""

from __future__ import annotations

import random
import struct
from dataclasses import replace
from pathlib import Path

import pytest

import fsmkit
from devtools import snapshots
from devtools.differential import Case, compare_all, random_case
from devtools.runtimes import harness
from fsmkit.plan.image import head, sealed
from fsmkit.runtime import interpreter
from fsmkit.runtime.snapshot_bytes import pack, unpack
from fsmkit.testing.harness import c as c_harness
from fsmkit.testing.harness.harness import INTERPRETER

CHART = """
chart: Saved
events: {in: [go, over]}
data: {level: 0..9 = 0}
initial: off
states:
  off: {on: {go: on, over: end}, after: {5ms: on}}
  on:
    on: {go: off}
    regions:
      left:
        initial: a
        states: {a: {on: {over: b}, after: {9ms: b}}, b: {}, h: {history: deep, default: a}}
      right: {initial: c, states: {c: {after: {4ms: d}}, d: {initial: e, states: {e: {}}}}}
  end: {final: true}
"""
OFF, ON, LEFT, A, RIGHT, C, D, END = 1, 2, 3, 4, 7, 8, 9, 11
STATUS, FAULT, NUMBERS = 0, 1, 2
"""Places behind the head; a number of two bytes for each region follows from the third on."""


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("target", snapshots.TARGETS)
def test_every_target_accepts_the_same(target: str) -> None:
    for number in (3, 5, 19, 23):
        totals = snapshots.run_chart(0, number, 40, [target])
        assert totals.divergences == 0
        assert totals.accepted < totals.tried


@pytest.mark.slow
@pytest.mark.external
def test_an_error_of_memory_is_a_divergence(monkeypatch: pytest.MonkeyPatch) -> None:
    """The snapshots are right, but the program reads behind an array."""
    main = c_harness._main
    broken = "int volatile at = 4; static char known[4]; return known[at];"
    monkeypatch.setattr(
        c_harness, "_main", lambda machines: main(machines).replace("return 0;", broken)
    )
    totals = snapshots.run_chart(0, 3, 2, ["c-sanitized"])
    assert totals.divergences == 1


def test_machines_whose_timers_are_long_overdue_are_not_drawn() -> None:
    """They are right, but their traces have no end that a test could wait for."""
    case = random_case(104, 0, is_saved=True)
    draw = random.Random(0)
    saved = snapshots.snapshots(case)
    anyhow = [snapshots.damaged(draw, case.chart, draw.choice(saved)) for _ in range(1_000)]
    assert any(snapshots.is_overdue(case.chart, data) for data in anyhow)
    scripts = snapshots.scripts(draw, case, 1_000)
    drawn = [bytes.fromhex(lines[0].split()[2]) for lines in scripts]
    assert len(drawn) == 1_000
    assert not any(snapshots.is_overdue(case.chart, data) for data in drawn)


@pytest.mark.slow
def test_a_damaged_counter_does_not_let_a_random_chart_send_without_end() -> None:
    """The counter of sends of this chart is an `int32`, which a snapshot may hold far below 0."""
    case = random_case(105, 9, is_saved=True)
    found = unpack(case.chart, snapshots.snapshots(case)[0], snapshots.NOW)
    sent = [data.name for data in case.chart.data].index("sent")
    data = (*found.data[:sent], -(2**24), *found.data[sent + 1 :])
    restored = f"restore {snapshots.NOW} {pack(case.chart, replace(found, data=data)).hex()}"
    events = [line for line in case.script if line.startswith("post ")]
    trace = INTERPRETER.run(case.chart, (restored, *events[:4], "run 105", "run 3000"))
    assert "not restored" not in trace
    assert len(trace) < 10_000


def saved_on() -> tuple[fsmkit.Session, bytearray]:
    """Return a session in the parallel state, and the machine as bytes without their checksum."""
    session = fsmkit.Session(fsmkit.read_chart(PATH))
    session.post("go")
    session.run()
    return session, bytearray(session.save_bytes()[:-4])


IMPOSSIBLE: dict[str, dict[int, int]] = {
    "runs in no state": {NUMBERS: 0, NUMBERS + 2: 0, NUMBERS + 4: 0},
    "runs and is finished": {STATUS: 3},
    "finished in a state that is not final": {STATUS: 2},
    "not started, but in a state": {STATUS: 0},
    "runs with a fault": {FAULT: 1},
    "stopped by a fault that it cannot have": {STATUS: 0, FAULT: 1},
    "a state of another region": {NUMBERS + 2: C},
    "no state in a region that is active": {NUMBERS + 4: 0},
    "a state in a region that is not active": {NUMBERS: OFF},
    "a region that rests in a state with an initial one": {NUMBERS + 4: D},
    "runs in a final state of the root": {NUMBERS: END, NUMBERS + 2: 0, NUMBERS + 4: 0},
    "a state that does not exist": {NUMBERS: 200},
}
"""Changed bytes of a machine in the state `on`, and what they stand for."""
PATH = Path()


@pytest.fixture(autouse=True)
def chart_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "saved.yaml"
    path.write_text(CHART, encoding="utf-8")
    monkeypatch.setattr("tests.differential.test_damaged_snapshots.PATH", path)


def changed(name: str) -> bytes:
    session, data = saved_on()
    start = len(head(session.chart))
    for place, value in IMPOSSIBLE[name].items():
        data[start + place] = value
    return sealed(bytes(data))


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_an_impossible_machine_is_rejected_by_a_session(name: str) -> None:
    session, _ = saved_on()
    with pytest.raises(fsmkit.FsmkitError, match="is damaged"):
        session.restore(changed(name))
    assert session.active == ("a", "c")


@pytest.mark.external
@pytest.mark.cc
def test_impossible_machines_are_rejected_by_all_targets() -> None:
    chart = fsmkit.read_chart(PATH)
    lines = [line for name in IMPOSSIBLE for line in (f"restore 7 {changed(name).hex()}", "dump")]
    assert INTERPRETER.run(chart, lines).count("not restored") == len(IMPOSSIBLE)
    targets = [harness(name) for name in (*snapshots.TARGETS, "pyext")]
    totals = compare_all([Case((), chart, ("start 0", *lines))], targets)
    assert not totals.divergences, totals.divergences[0]


INNER = """
chart: Inner
data: {kept: 0..9 = 3}
initial: s
states: {s: {}}
"""
OUTER = """
chart: Outer
data: {real: float32 = 1.5, long: float64 = 1.5}
events: {in: [go]}
initial: idle
states:
  idle: {on: {go: busy}}
  busy: {invoke: {id: inner, src: inner.yaml}, on: {go: idle}}
"""


@pytest.mark.external
@pytest.mark.cc
def test_numbers_and_slots_have_one_form(tmp_path: Path) -> None:
    """NaN has the same bytes everywhere, and a machine that does not run leaves zeros."""
    (tmp_path / "inner.yaml").write_text(INNER)
    (tmp_path / "outer.yaml").write_text(OUTER)
    chart = fsmkit.read_chart(tmp_path / "outer.yaml")
    session = fsmkit.Session(chart)
    idle = bytearray(session.save_bytes()[:-4])
    session.post("go")
    session.run()
    busy = bytearray(session.save_bytes()[:-4])
    real, long = idle.index(struct.pack("<f", 1.5)), idle.index(struct.pack("<d", 1.5))
    slot = next(at for at in range(len(head(chart)) + 16, len(idle)) if idle[at] != busy[at])
    forms = []
    for place, nans in (
        (real, ("0000c07f", "0100807f", "0000c0ff", "ffffff7f")),
        (long, ("000000000000f87f", "010000000000f07f", "000000000000f8ff")),
    ):
        for text in nans:
            changed = bytearray(idle)
            changed[place : place + len(text) // 2] = bytes.fromhex(text)
            forms.append(sealed(bytes(changed)))
    for at in range(slot, len(idle)):
        forms.append(sealed(bytes(idle[:at] + b"\x03" + idle[at + 1 :])))
        stopped = bytearray(busy)
        stopped[slot] = 0
        forms.append(sealed(bytes(stopped[:at] + b"\x00" + stopped[at + 1 :])))
    lines = [line for data in forms for line in (f"restore 7 {data.hex()}", "dump")]
    accepted = len(forms) - INTERPRETER.run(chart, lines).count("not restored")
    assert accepted == 2, "the usual NaN of each length"
    targets = [harness(name) for name in (*snapshots.TARGETS, "pyext")]
    totals = compare_all([Case((), chart, ("start 0", *lines))], targets)
    assert not totals.divergences, totals.divergences[0]


def test_timers_belong_to_active_states_and_stand_in_order() -> None:
    session, _ = saved_on()
    chart, snapshot = session.chart, session.snapshot
    first, second = snapshot.timers
    (other,) = interpreter.start(chart, 0, Silent()).after.timers
    for timers in ((other, second), (first, first), (second, first), (first, other)):
        wrong = snapshot.with_queues(snapshot.now, (), (), timers)
        with pytest.raises(fsmkit.FsmkitError, match="is damaged"):
            session.restore(pack(chart, wrong))


class Silent:
    """A host that has nothing to do."""

    def call(self, operation: str, arguments: tuple[object, ...]) -> None:
        """Do nothing."""
