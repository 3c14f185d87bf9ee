"""Endurance runs: every event and timer is accounted for, and what would lose one is found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click import UsageError
from click.testing import CliRunner

from devtools.endurance import run
from devtools.endurance.__main__ import BEGIN, END, main, placed
from devtools.endurance.program import program
from devtools.endurance.run import endure
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError

CELL = Path(__file__).parents[2] / "machines/production_cell"
STATION = """
chart: Station
types:
  Grade: [fine, poor, bad]
data:
  level: 0..9 = 0
  strikes: 0..3 fault = 0
inputs:
  wanted: -3..3
  warm: bool
operations:
  - weigh(limit 0..9) -> 0..12
  - grade() -> Grade
  - is_free() -> bool
events:
  in: [load, unload, poke, stop, again(count 0..20), query() -> 0..9]
  out: [full(level 0..9)]
capacity: {queue: 6, internal: 3, microsteps: 12}
initial: idle
states:
  idle:
    on:
      load: {if: is_free(), target: loading, do: level = weigh(level)}
      query: {do: reply level}
      stop: {target: over}
    every:
      40ms: {do: level = wanted}
  loading:
    defer: [unload, poke]
    after:
      120ms: {if: warm, target: busy}
      300ms: idle
    on:
      again:
        - {if: event.count > 18, do: raise poke; raise poke; raise poke; raise poke}
        - {if: event.count > 3, target: loading, do: send again(count = event.count - 4)}
      stop: idle
  busy:
    regions:
      left:
        initial: one
        states:
          one: {every: {7ms: two}}
          two: {after: {5ms: one}, on: {poke: {target: one, do: strikes += 1}}}
      right:
        initial: dark
        states:
          dark: {on: {load: lit}, defer: [again]}
          lit:
            entry: send full(level = level)
            on: {unload: {target: dark}}
            always: [{if: grade() == Grade.bad and wanted > 2, target: dark}]
    on:
      unload: {target: idle, do: strikes = 0}
  over: {final: true}
"""
DELAYED = """
chart: Later
events: {in: [go, gone]}
initial: here
states:
  here: {on: {go: {do: send gone after 1s}, gone: there}}
  there: {}
"""


@pytest.fixture
def station(tmp_path: Path) -> Chart:
    """Give a chart with all that the production cell does without: deferral, results, ends."""
    path = tmp_path / "station.yaml"
    path.write_text(STATION, encoding="utf-8")
    return load(path)


@pytest.mark.external
def test_minutes_of_the_production_cell(tmp_path: Path) -> None:
    chart = load(CELL / "feeder.yaml")
    account = endure(chart, tmp_path, seconds=1800, seed=2, samples=1, compared=1)
    assert account.replayed == account.compared == 1
    for what in ("full", "lost", "busy", "unhandled", "taken", "jumps", "wraps", "fired"):
        assert account.figures[what], what


@pytest.mark.external
def test_what_the_cell_does_without(station: Chart, tmp_path: Path) -> None:
    account = endure(station, tmp_path / "run", seconds=1200, seed=3, samples=4, compared=2)
    for what in ("deferrals", "recalls", "sent", "faults", "stopped", "left", "jumped_over"):
        assert account.figures[what], what
    assert account.figures["states_seen"] == len(station.states) - 1


@pytest.mark.cc
@pytest.mark.parametrize(
    ("old", "new", "law"),
    [
        pytest.param(
            "fsm_count(&m->fsm.rejected);",
            "",
            "refused since the start",
            id="a refusal is not counted",
        ),
        pytest.param(
            "m->fsm.queue_count++;",
            "if (m->fsm.queue_count < 3u) m->fsm.queue_count++;",
            "waiting in the queue",
            id="an event overwrites another",
        ),
        pytest.param(
            "fsm_timers_disarm(m->fsm.timers, &m->fsm.timer_count, ",
            "(void)(",
            "armed timers",
            id="a timer outlives its state",
        ),
        pytest.param(
            "fsm_reached(now, m->fsm.timers[0].deadline)",
            "now >= m->fsm.timers[0].deadline",
            "overdue",
            id="the clock must not wrap around",
        ),
        pytest.param(
            "FSM_HOOK_EVENT(m, FSM_UNHANDLED, e);",
            "",
            "nothing was told of an event",
            id="an event that enables nothing is not told",
        ),
    ],
)
def test_finds_what_a_machine_loses(
    old: str, new: str, law: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def changed(chart: Chart) -> dict[str, str]:
        files = program(chart)
        assert old in files["x.c"]
        return files | {"x.c": files["x.c"].replace(old, new)}

    monkeypatch.setattr(run, "program", changed)
    with pytest.raises(FsmkitError, match=law):
        endure(load(CELL / "feeder.yaml"), tmp_path, seconds=86400)


@pytest.mark.cc
def test_finds_where_the_interpreter_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def changed(chart: Chart) -> dict[str, str]:
        files = program(chart)
        return files | {"x.c": files["x.c"].replace("x_enter_seeking(m);", "x_enter_settling(m);")}

    monkeypatch.setattr(run, "program", changed)
    with pytest.raises(FsmkitError, match="in the interpreter"):
        endure(load(CELL / "feeder.yaml"), tmp_path, seconds=7200, samples=9)


@pytest.mark.cc
def test_prints_a_table(tmp_path: Path) -> None:
    delayed = tmp_path / "delayed.yaml"
    delayed.write_text(DELAYED, encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nstale\n{END}\nafter\n", encoding="utf-8")
    arguments = [str(CELL / "molder.yaml"), str(delayed), "--hours", "0.1", "--samples", "0"]
    done = CliRunner().invoke(main, [*arguments, "--write", str(page)])
    assert done.exit_code == 0, done.output
    assert "Later is skipped: an endurance run keeps no account of delayed events" in done.output
    assert "no law broken" in done.output
    offered = re.search(r"offered +([\d,]{4,})", done.output)
    assert offered is not None
    written = page.read_text(encoding="utf-8")
    assert f"| offered | {offered[1]} |\n" in written
    assert written.startswith(
        f"before\n{BEGIN}\n0.1 simulated hours of each, seed 1.\n\n| | Molder |"
    )
    assert written.endswith(f"|\n{END}\nafter\n")
    assert "stale" not in written
    with pytest.raises(UsageError, match="no place for the table"):
        placed("a page without", "a table")
