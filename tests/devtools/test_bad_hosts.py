"""Generated C keeps its promises to bad hosts; the long run is `python -m devtools.bad_hosts`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from devtools.bad_hosts.__main__ import CHECKS, abuse, build_and_run, failures_of, random_charts
from devtools.bad_hosts.program import machine_program, system_program
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system

pytestmark = pytest.mark.cc

PORTER = """
chart: Porter
types: {Kind: [light, heavy]}
data: {held: 0..9 = 0, row: "0..3[4] = 0"}
inputs: {near: bool}
operations: ["lift(n 0..9) -> 0..9", "is_free() -> bool"]
events: {in: ["take(place 0..3, kind Kind, ok bool)", hold, free, stop], out: [taken]}
capacity: {queue: 4}
initial: idle
states:
  idle:
    on:
      take: {do: "row[event.place] = 1; held = lift(held); send taken"}
      hold: {if: is_free() || near, target: holding}
      stop: over
    after: {70ms: idle}
  holding:
    defer: [take]
    on: {free: idle}
    every: {20ms: {do: [send free after 5ms, send taken after 3ms]}}
  over: {final: true}
"""
PAIR = """
system: Pair
machines: {left: porter.yaml, right: porter.yaml}
connect: [left.taken -> right.hold, right.taken -> left.free]
environment: {may: []}
"""


@pytest.fixture
def porter(tmp_path: Path) -> Chart:
    """Return a chart with calls of the host at each place of a step, timers and deferral."""
    path = tmp_path / "porter.yaml"
    path.write_text(PORTER, encoding="utf-8")
    return load(path)


@pytest.mark.external
def test_every_form_keeps_the_promises(porter: Chart) -> None:
    counted: Counter[str] = Counter()
    charts = [porter, *random_charts(0, (1, 6))]
    assert list(abuse(charts, 2000, 1, counted)) == []
    assert counted.pop("machines") == len(charts) * len(CHECKS) * 2
    assert min(counted.values()) > 20, counted


@pytest.mark.external
@pytest.mark.usefixtures("porter")
@pytest.mark.parametrize("is_small", [False, True])
def test_joined_machines_keep_them(is_small: bool, tmp_path: Path) -> None:
    path = tmp_path / "pair.yaml"
    path.write_text(PAIR, encoding="utf-8")
    files = system_program(load_system(path, Findings()), is_small=is_small)
    (line,) = build_and_run(files, 4000, 1)
    calls, word, *figures = line.split()
    assert (calls, word) == ("4000", "calls")
    assert int(figures[4]) > 100  # calls from within operations
    nested = "if (s->starting || s->working != 0u) {"
    assert files["pair.c"].count(nested) == 2
    files["pair.c"] = files["pair.c"].replace(nested, "if (false) {")
    assert "broken at line" in build_and_run(files, 4000, 1)[-1]


@pytest.mark.parametrize(
    ("file", "old", "new", "found"),
    [
        ("d0.c", "    if (m->fsm.busy) {", "    if (false) {", "== FSM_BUSY"),
        (
            "d0.c",
            "m->fsm.queue_count + m->fsm.deferred_count >= D0_QUEUE",
            "false",
            "overflow|index",
        ),
        ("d0.c", "e->of.take.place <= 3u", "true", "is_sound|REFUSED"),
        ("d0.c", "&e->of.take.ok <= 1u", "&e->of.take.ok <= 2u", "is_sound|REFUSED"),
        ("d0.c", "busy = true; /* the host", "busy = false; /* the host", "== FSM_BUSY"),
        ("fsm_save.c", "return FSM_IN_STEP;", "", "FSM_IN_STEP"),
        ("fsm_save.c", "if (is_event(info, e)) {", "if (true) {", "FSM_RESTORED"),
        ("fsm_save.c", "fsm_put(w, timers[i].what, 2u);", "fsm_put(w, 0u, 2u);", "FSM_RESTORED"),
        ("s0.c", "(m->fsm.queue_count == 0u", "(m->fsm.queue_count < 2u", "other answers"),
    ],
)
def test_finds_what_breaks_them(file: str, old: str, new: str, found: str, porter: Chart) -> None:
    files = machine_program([porter])
    assert old in files[file], file
    files[file] = files[file].replace(old, new)
    flags = CHECKS[file == "d0.c"]
    (failure,) = failures_of(build_and_run(files, 6000, 1, *flags), Counter())
    assert any(each in failure for each in found.split("|")), failure
