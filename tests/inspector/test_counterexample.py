"""A counterexample is shown from its end: every moment is known, and a branch may leave it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources import Recorded
from fsmkit.inspector.sources.counterexample import read_trace
from fsmkit.inspector.sources.opening import open_source
from fsmkit.runtime.interpreter.trace import active_leaves, trace_lines
from fsmkit.system.any_file import load_any
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.testgen.save import document
from tests.inspector.conftest import Client
from tests.parameters import sampled
from tests.verify.random_systems import random_system
from tests.verify.systems import AXIS, DRIVE, DRIVER

DOOR = """\
chart: Door
operations: ["force() -> 0..3"]
data: {tries: 0..9 = 0}
inputs: {locked: bool}
events: {in: ["push(hard bool)"]}
initial: shut
states:
  shut:
    on:
      push: {target: moving, if: "not locked and event.hard", do: "tries = tries + force()"}
  moving:
    invariant: "tries < 5"
    after: {300ms: open}
  open:
    after: {2s: shut}
"""
BLINKER = """\
system: Blink
machines: {lamp: lamp.yaml}
properties:
  mended: {leads_to: [lamp.In(on), lamp.In(broken)]}
"""
LAMP = """\
chart: Lamp
initial: "on"
states:
  "on": {after: {300ms: "off"}}
  "off": {after: {200ms: "on"}}
  broken: {}
events: {in: [blow]}
"""


def traces(folder: Path, files: dict[str, str], time: str = "discrete") -> dict[str, Path]:
    """Check files, the first of them, and save what is found, by the names of properties."""
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    file = folder / f"{next(iter(files))}.yaml"
    engine = "c" if time == "zones" else "python"
    options = ExplorationOptions(engine, time=time)  # type: ignore[arg-type]
    report = check(load_any(file, Findings()), Findings(), options=options)
    found = {}
    for result in report.results:
        if result.trace is not None and result.trace.steps:
            path = folder / f"{result.name}.json"
            saved = document(report.closed, result, result.trace, file)
            path.write_text(json.dumps(saved), encoding="utf-8")
            found[result.name] = path
    return found


def agrees(path: Path) -> Recorded:
    """Return a trace as something recorded, which does line by line as it was saved."""
    recorded, _ = read_trace(path)
    charts = [machine.chart for machine in recorded.system.machines]
    names = [machine.name for machine in recorded.system.machines]
    saved = json.loads(path.read_text(encoding="utf-8"))["steps"]
    steps = [step for step in saved if step["machine"] in names]
    done = [entry for entry in recorded.entries if entry.stepped is not None]
    assert len(steps) == len(done)
    for step, entry in zip(steps, done, strict=True):
        assert entry.stepped is not None
        assert entry.moment is not None
        machine = names.index(step["machine"])
        assert entry.stepped.machine == machine
        chart, macrostep = charts[machine], entry.stepped.macrostep
        if "sometimes" not in step["lines"][0]:
            words = [
                line.split(" ", 1)[1]
                for line in (next(trace_lines(chart, (macrostep,))), step["lines"][0])
            ]
            assert words[0] == words[1]
        assert list(trace_lines(chart, (macrostep,)))[1:] == step["lines"][1:]
        assert active_leaves(chart, entry.moment.snapshots[machine]) == step["to"]
        if step["at"] is not None:
            assert macrostep.at == step["at"] // charts[0].capacities.tick == entry.moment.now
    return recorded


def test_it_begins_at_its_end_with_the_property_as_reason(tmp_path: Path) -> None:
    found = traces(tmp_path, {"door": DOOR})
    recorded = agrees(found["moving.invariant"])
    assert recorded.at_end
    client = Client(Hub(recorded, file=tmp_path / "door.yaml"))
    assert client.told[0]["time"] == "recorded"
    mode = client.last("mode")
    assert mode["why"] == ["property", "moving.invariant"]
    assert mode["n"] == mode["head"] > 0
    assert client.result("watch", expression="tries < 5")["value"] is False
    head = mode["head"]
    assert client.result("micro", n=head)
    while client.result("watch", expression="tries < 5")["value"] is False:
        client.result("back", count=1)
    assert client.last("mode")["n"] == head - 1
    assert client.result("seek", n=0) == 0
    assert client.last("state")["status"] == "before"
    client.result("run", speed=0)
    client.hub.advance(1)
    assert client.last("mode")["n"] == head
    assert client.last("mode")["why"] == ["property", "moving.invariant"]
    posts = [m for m in client.told if m["k"] == "post"]
    assert {each["event"][0] for each in posts} == {"push"}


def test_its_property_is_a_breakpoint_and_time_passes(tmp_path: Path) -> None:
    client = Client(Hub(agrees(traces(tmp_path, {"door": DOOR})["moving.invariant"])))
    client.result("seek", n=0)
    number = client.result("break", on="condition", what="In(open)")
    client.result("run", speed=1)
    client.hub.advance(299_000)
    assert client.last("mode").get("why", []) == []
    client.hub.advance(1_000)
    assert client.last("mode")["why"] == ["breakpoint", number]
    assert client.last("mode")["at"] == 300
    assert client.result("step", how="timer") > 0
    assert client.last("mode")["at"] > 300


def test_another_way_is_a_branch_in_the_interpreter(tmp_path: Path) -> None:
    client = Client(Hub(agrees(traces(tmp_path, {"door": DOOR})["moving.invariant"])))
    head = client.last("mode")["head"]
    client.result("back", count=1)
    client.result("set", m="Door", input="locked", value=True)
    client.result("post", m="Door", event="push", **{"with": {"hard": True}})
    assert client.last("mode")["branch"] == 1
    assert client.result("watch", expression="tries < 5")["value"] is True
    assert client.result("branches") == [{"branch": 0, "first": 0, "head": head}]
    client.result("fork", branch=0)
    assert client.last("mode")["why"] == ["property", "moving.invariant"]
    assert client.last("mode")["head"] == head
    client.result("step")  # on from the end: a branch, too
    assert client.last("mode")["branch"] == 2


def test_a_lasso_says_where_it_goes_round(tmp_path: Path) -> None:
    files = {"blink": BLINKER, "lamp": LAMP}
    client = Client(Hub(agrees(traces(tmp_path, files)["mended"])))
    kind, name, word, entry = client.last("mode")["why"]
    assert (kind, name, word) == ("property", "mended", "loop")
    client.result("seek", n=entry - 1)
    first = client.last("state")["on"]
    client.result("seek", n=client.last("mode")["head"])
    assert client.last("state")["on"] == first


@pytest.mark.slow
@pytest.mark.parametrize("time", ["discrete", "untimed"])
def test_machines_and_what_they_pass_on(tmp_path: Path, time: str) -> None:
    found = traces(tmp_path, {"drive": DRIVE, "axis": AXIS, "driver": DRIVER}, time)
    assert found
    for path in found.values():
        client = Client(Hub(agrees(path)))
        head = client.last("mode")["head"]
        client.result("history", first=1)
        passed = [m for m in client.told if m["k"] == "pass"]
        assert all(m["to"][0] in ("axis", "driver") for m in passed)
        for n in range(head + 1):
            client.result("seek", n=n)
            assert "known" not in client.last("state")
        for n in range(0, head, 3):  # a branch may leave anywhere
            client.result("fork", branch=0) if client.last("mode").get("branch") else None
            client.result("seek", n=n)
            client.result("fork")
            client.result("step", how="timer")


@pytest.mark.parametrize("seed", sampled([1, 7, 3, 0, 4, 9, 5, 8], every=2))
def test_random_systems_are_performed_again(tmp_path: Path, seed: int) -> None:
    for path in traces(tmp_path, random_system(seed)).values():
        recorded = agrees(path)
        client = Client(Hub(recorded))
        client.result("seek", n=len(recorded.entries) // 2)
        client.result("fork")
        client.result("run", speed=0)
        client.hub.advance(1)


@pytest.mark.cc
def test_dense_time_is_shown_in_whole_ticks(tmp_path: Path) -> None:
    for path in traces(
        tmp_path, {"drive": DRIVE, "axis": AXIS, "driver": DRIVER}, "zones"
    ).values():
        recorded = agrees(path)
        assert all(e.moment is not None and type(e.moment.now) is int for e in recorded.entries)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"trail": 3}', "\x00", "[" * 100_000, '{"file": "a"}'],
    ids=lambda text: text[:12],
)
def test_what_is_no_trace_is_a_finding(tmp_path: Path, text: str) -> None:
    path = tmp_path / "trace.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FsmkitError) as raised:
        read_trace(path)
    assert raised.value.diagnostics[0].rule.name == "unreadable-log"


def changed(document: dict[str, Any], **fields: Any) -> dict[str, Any]:
    return {**document, **fields}


def test_a_trace_of_other_charts_is_a_finding(tmp_path: Path) -> None:
    path = traces(tmp_path, {"door": DOOR})["moving.invariant"]
    saved = json.loads(path.read_text(encoding="utf-8"))
    for trail in ([[["take", 0, 0, []]]], [[["start", 7, 0, []]]], [[["fly", 0, 0, []]]], [[[1]]],
                  [[["start", 0, 0, []]], [["occur", 0, 99, [0, 0, 0]]]]):  # fmt: skip
        path.write_text(json.dumps(changed(saved, trail=trail)), encoding="utf-8")
        with pytest.raises(FsmkitError) as raised:
            read_trace(path)
        assert raised.value.diagnostics[0].rule.name == "replay-parts"
    path.write_text(json.dumps(saved), encoding="utf-8")
    (tmp_path / "door.yaml").write_text(DOOR.replace("push", "pull"), encoding="utf-8")
    with pytest.raises(FsmkitError):
        read_trace(path)


def test_its_file_is_looked_for_beside_it(tmp_path: Path) -> None:
    path = traces(tmp_path, {"door": DOOR})["moving.invariant"]
    other = tmp_path / "moved"
    other.mkdir()
    (tmp_path / "door.yaml").rename(other / "door.yaml")
    path = path.rename(other / path.name)
    _, file = read_trace(path)
    assert file == other / "door.yaml"


def test_a_file_is_opened_by_what_it_is(tmp_path: Path) -> None:
    path = traces(tmp_path, {"door": DOOR})["moving.invariant"]
    trace = open_source(path, Findings())
    assert isinstance(trace.source, Recorded)
    assert (trace.file, trace.name) == (tmp_path / "door.yaml", "Door")
    chart = open_source(trace.file, Findings())
    assert isinstance(chart.source, Chart)
