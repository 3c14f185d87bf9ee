"""What a history holds while its parent is active is the same in the saves of every runtime."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from devtools.runtimes import harnesses
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.diagnostics import FsmkitError
from fsmkit.runtime import saving, snapshot_bytes
from fsmkit.runtime.script import Player, script_texts
from fsmkit.testing.harness.harness import INTERPRETER, Harness

CHART = """
chart: Player
events: {{in: [leave, go, on, again, deeper, deepest]}}
data: {{seen: bool = false, early: bool = false}}
initial: off
states:
  off:
    on: {{on: work, again: shallow, deeper: deep, deepest: whole}}
  work:
    entry: early = In(left) || In(five)
    exit: early = In(left) || In(five)
    on: {{leave: off}}
    regions:
      whole: {{history: deep, initial: [left, right]}}
      left:
        initial: one
        states:
          shallow: {{history: shallow, default: one}}
          deep: {{history: deep, default: one}}
          one:
            on: {{go: three{within}}}
          two:
            on: {{go: one}}
            states:
              three:
                entry: seen = In(five)
                on: {{go: four}}
              four: {{}}
      right:
        states:
          five:
            on: {{go: six}}
          six:
            regions:
              a:
                states:
                  a1: {{on: {{go: a2}}}}
                  a2: {{}}
              b: {{}}
"""
ENTRIES = ("on", "again", "deeper", "deepest")
HISTORIES = {"shallow", "deep", "whole"}


def chart_of(folder: Path, within: str = "") -> Chart:
    path = folder / "player.yaml"
    path.write_text(CHART.format(within=within))
    return load(path)


def script() -> tuple[str, ...]:
    """Return what enters in every way, goes two steps, and leaves; saved inside and outside."""
    found = ["start 0", "post go", "run 1"]
    for entry in ENTRIES:
        found += [f"post {entry}", "run 2", "save", "post go", "post go", "run 3", "save"]
        found += ["post leave", "run 4", "save", "restore 4"]
    return tuple(found)


def held(chart: Chart, runtime: Harness) -> list[set[str]]:
    """Return the histories that hold something in each save, which are those of the interpreter."""
    trace = runtime.run(chart, script())
    assert trace == INTERPRETER.run(chart, script())
    saved = (line.removeprefix("saved ") for line in trace if line.startswith("saved "))
    snapshots = (snapshot_bytes.unpack(chart, bytes.fromhex(text), 0) for text in saved)
    return [{chart.states[state].id for state, _ in found.history} for found in snapshots]


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_nothing_is_held_while_nothing_asks(runtime: Harness, tmp_path: Path) -> None:
    found = held(chart_of(tmp_path), runtime)
    assert found == [set(), set(), HISTORIES] * len(ENTRIES)


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_what_is_asked_for_from_within_is_held(runtime: Harness, tmp_path: Path) -> None:
    found = held(chart_of(tmp_path, ", again: deep"), runtime)
    later = [{"deep"}, {"deep"}, HISTORIES] * (len(ENTRIES) - 1)
    assert found == [set(), set(), HISTORIES, *later]


def test_a_snapshot_with_a_forgotten_history_is_none_that_a_machine_saves(tmp_path: Path) -> None:
    chart = chart_of(tmp_path)
    player = Player(chart)
    for line in script_texts(("start 0", "post on", "run 1")):
        list(player.play(line))
    inside = player.snapshot
    stale = replace(
        inside, history=((chart.state_index["deep"], frozenset({chart.state_index["one"]})),)
    )
    with pytest.raises(FsmkitError, match="no machine is saved like that"):
        snapshot_bytes.unpack(chart, snapshot_bytes.pack(chart, stale), inside.now)
    assert saving.restore(chart, saving.save(chart, stale), inside.now) == inside
