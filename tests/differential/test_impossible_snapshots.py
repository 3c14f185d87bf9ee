"""Snapshots with valid checksums, part by part: every target accepts exactly the possible ones.

Where `test_damaged_snapshots` draws changes at random, this module tries every combination of
states, status and fault, and every byte of data, queues, timers and slots.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

import fsmkit
from devtools import snapshots
from devtools.differential import Case, compare_all, random_case
from devtools.runtimes import harness
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.plan.image import head, image_of, sealed
from fsmkit.runtime import saving
from fsmkit.runtime.interpreter import Occurrence, Snapshot, Timeout, Timer
from fsmkit.runtime.snapshot_bytes import unpack
from fsmkit.testing.harness.harness import INTERPRETER

NOW = 7
STATES = """
chart: States
events: {in: [go, back, stop], internal: [again]}
initial: off
states:
  off:
    on: {go: both, back: all, stop: end}
  both:
    on: {go: off, stop: broken}
    regions:
      all: {history: deep, initial: [left, right]}
      left:
        initial: a
        states:
          a: {on: {back: b}}
          b:
            on: {back: kept}
            initial: c
            states:
              c: {}
              kept: {history: shallow, default: c}
      right: {}
  broken: {entry: raise again, on: {again: {do: raise again}}}
  end: {final: true}
"""
"""A parallel state, histories that its regions hold or forget, a final state, and a fault."""
PARTS = """
chart: Parts
types:
  Color: [red, green = 4, blue = 9]
  Pair: {first: 0..9, second: bool}
events: {in: ["go(color Color, level -3..5)", stop, later], out: []}
capacity: {queue: 2, delayed: 2}
data:
  color: Color
  pair: Pair
  list: "0..9[2] = 0"
  wide: -300..300 = 1
  real: float32 = 1.5
  span: duration = 3ms
outputs: {lit: bool}
inputs: {given: 0..3}
initial: on
states:
  on:
    defer: stop
    entry: send later after 3ms as one
    after: {5ms: off}
    on: {go: {do: wide = wide + event.level}, later: {}}
  off:
    every: {2ms: {}}
    on: {stop: on, go: {target: on, if: given > 1}}
"""
"""Values of each type, both queues, timers of states, delayed sends."""
INNER = """
chart: Inner
data: {kept: 0..9 = 3}
initial: s
states: {s: {after: {4ms: t}}, t: {}}
"""
OUTER = """
chart: Outer
events: {in: [go]}
initial: idle
states:
  idle: {on: {go: busy}}
  busy: {invoke: {id: inner, src: inner.yaml}, on: {go: idle}}
"""
TARGETS = (*snapshots.TARGETS, "pyext")
MARKS = (0, 1, 2, 0x7F, 0x80, 0xFF)


def written(folder: Path, source: str) -> Chart:
    """Return a chart, whose source is written to a folder beside the invoked one."""
    (folder / "inner.yaml").write_text(INNER)
    path = folder / "chart.yaml"
    path.write_text(source)
    return load(path)


def saved(chart: Chart, *script: str) -> list[bytes]:
    """Return what a script saves at each `save`."""
    lines = ("start 0", *script)
    texts = (line.removeprefix("saved ") for line in INTERPRETER.run(chart, lines) if " " in line)
    return [bytes.fromhex(text) for text in texts if len(text) > 40]


def compared(chart: Chart, forms: list[bytes]) -> int:
    """Restore snapshots on all targets, which must do the same; return how many are accepted."""
    lines = [line for data in forms for line in (f"restore {NOW} {data.hex()}", "dump")]
    totals = compare_all([Case((), chart, ("start 0", *lines))], [*map(harness, TARGETS)])
    assert not totals.divergences, totals.divergences[0]
    return len(forms) - INTERPRETER.run(chart, lines).count("not restored")


def every_configuration(chart: Chart, data: bytes) -> Iterator[bytes]:
    """Yield a snapshot with all numbers of regions and histories, status and fault.

    A number is 0 or a state of its region.
    """
    image, start = image_of(chart), len(head(chart))
    rows = [*(r.index for r in image.plan.regions), *(region for _, region in image.histories)]
    choices = [(0, *image.plan.regions[row].states) for row in rows]
    body = data[start + 2 + 2 * len(rows) : -4]
    for status, fault in ((0, 0), (1, 0), (2, 0), (0, 1)):
        for numbers in product(*choices):
            states = b"".join(number.to_bytes(2, "little") for number in numbers)
            yield sealed(data[:start] + bytes((status, fault)) + states + body)


def every_byte(chart: Chart, data: bytes) -> Iterator[bytes]:
    """Yield a snapshot with each byte changed to each of some values."""
    for place in range(len(head(chart)), len(data) - 4):
        for value in (*MARKS, data[place] ^ 1, (data[place] + 1) % 256):
            changed = bytearray(data[:-4])
            changed[place] = value
            yield sealed(bytes(changed))


@pytest.mark.external
@pytest.mark.slow
def test_only_whole_configurations_are_accepted(tmp_path: Path) -> None:
    chart = written(tmp_path, STATES)
    (data,) = saved(chart, "save")
    forms = list(dict.fromkeys(every_configuration(chart, data)))
    possible = {"not started": 1, "runs": 15, "finished": 6, "stopped by a fault": 21}
    assert len(forms) == 10_000
    assert compared(chart, forms) == sum(possible.values())


SOURCES = {"parts": PARTS, "outer": OUTER}
SCRIPTS = {
    "parts": ("post go 4 -2", "post stop", "save", "run 1", "save", "run 5", "post stop", "save"),
    "outer": ("save", "post go", "run 1", "save"),
}


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.parametrize("name", SOURCES)
def test_every_byte_is_checked_alike(name: str, tmp_path: Path) -> None:
    chart = written(tmp_path, SOURCES[name])
    forms = [form for data in saved(chart, *SCRIPTS[name]) for form in every_byte(chart, data)]
    accepted = compared(chart, list(dict.fromkeys(forms)))
    assert 0 < accepted < len(forms) / 2


STOPPING = """
chart: Stopping
events: {in: [go]}
capacity: {internal: 1, microsteps: 3}
initial: off
states:
  off: {on: {go: both}}
  both:
    entry: [raise x, raise x]
    regions:
      left: {initial: a, states: {a: {exit: raise x}, h: {history: deep, default: a}}}
      right: {initial: c, states: {c: {entry: raise x}}}
"""
"""Its internal queue overflows while it enters `both`."""


@pytest.mark.external
@pytest.mark.cc
def test_a_machine_that_a_fault_stopped_within_an_entry_is_accepted(tmp_path: Path) -> None:
    chart = written(tmp_path, STOPPING.replace("in: [go]", "in: [go], internal: [x]"))
    script = ("start 0", "post go", "run 1", "save", "restore 5", "dump")
    trace = INTERPRETER.run(chart, script)
    assert "fault internal" in "\n".join(trace)
    assert "not restored" not in trace
    totals = compare_all([Case((), chart, script)], [*map(harness, TARGETS)])
    assert not totals.divergences, totals.divergences[0]


@pytest.mark.slow
def test_what_machines_save_is_accepted_in_both_forms() -> None:
    stopped = 0
    for number in range(20):
        case = random_case(1, number, is_saved=True)
        for data in snapshots.snapshots(case):
            found = unpack(case.chart, data, NOW)
            stopped += found.fault is not None
            assert saving.restore(case.chart, saving.save(case.chart, found), NOW) == found
    assert stopped > 0


def changed_snapshots(chart: Chart, whole: Snapshot) -> Iterator[tuple[str, Snapshot]]:
    """Yield impossible machines, by what is wrong with them."""
    index = chart.state_index
    off, both, a, right = (index[name] for name in ("off", "both", "a", "right"))
    event = Occurrence(chart.event_index["go"], ())
    states = {
        "no state": (),
        "half of a parallel state": (0, both, a),
        "two states of a region": (0, off, both, a, right),
        "a state without its parent": (0, a),
        "a compound state without a child": (0, both, index["left"], right),
        "the end": (0, index["end"]),
    }
    for what, ids in states.items():
        yield what, replace(whole, configuration=frozenset(ids))
    yield "not started", replace(whole, running=False)
    yield "finished elsewhere", replace(whole, running=False, finished=True)
    yield "a fault and running", replace(whole, fault="internal")
    yield "an unknown fault", replace(whole, running=False, fault="rust")
    yield "too many events", replace(whole, queue=(event,) * 300)
    yield "a deferred event", replace(whole, deferred=(event,))
    timer = Timer(NOW + 5, Timeout(0))
    yield "a timer of a transition without a delay", replace(whole, timers=(timer,))
    for what, state in {"one child of two": a, "another state": off}.items():
        yield what, replace(whole, history=((index["all"], frozenset({state})),))


def test_impossible_data_for_json_are_rejected(tmp_path: Path) -> None:
    chart = written(tmp_path, STATES)
    session = fsmkit.Session(chart)
    before = session.snapshot
    for what, wrong in changed_snapshots(chart, before):
        data = json.loads(json.dumps(saving.save(chart, wrong)))
        with pytest.raises(fsmkit.FsmkitError, match="is damaged"):
            session.restore(data)
        assert session.snapshot == before, what
    session.restore(saving.save(chart, before))
