"""A history that nothing can read while its parent is active holds nothing then (SCXML 3.10)."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.chart.structure import forgotten_histories

CHART = """
chart: Player
events: {{in: [leave, back, go, again]}}
initial: off
states:
  off: {{on: {{back: {back}}}}}
  outer:
    initial: playing
    on: {{leave: off{outer}}}
    states:
      last: {{history: deep, default: {default}}}
      beside: {{on: {{go: playing{beside}}}}}
      playing:
        initial: one
{playing}
        states:
          here: {{history: {kind}, default: one}}
          one: {{on: {{go: two{one}}}}}
          two: {{on: {{go: one}}}}
"""
SHALLOW, DEEP = "shallow", "deep"


def forgotten(folder: Path, **parts: str) -> set[str]:
    chart = chart_of(folder, **parts)
    found = forgotten_histories(chart)
    for state, histories in enumerate(found):
        assert all(chart.states[history].parent == state for history in histories)
    return {chart.states[history].id for histories in found for history in histories}


def chart_of(folder: Path, **parts: str) -> Chart:
    own = {"back": "here", "outer": "", "default": "one", "beside": "", "one": "", "playing": ""}
    path = folder / "player.yaml"
    path.write_text(CHART.format(**{"kind": SHALLOW, **own, **parts}))
    return load(path)


@pytest.mark.parametrize("kind", [SHALLOW, DEEP])
def test_asked_from_outside_alone(tmp_path: Path, kind: str) -> None:
    assert forgotten(tmp_path, kind=kind) == {"here", "last"}
    assert forgotten(tmp_path, kind=kind, beside=", again: here") == {"here", "last"}
    assert forgotten(tmp_path, kind=kind, outer=", again: here") == {"here", "last"}


@pytest.mark.parametrize("kind", [SHALLOW, DEEP])
def test_asked_from_within(tmp_path: Path, kind: str) -> None:
    assert forgotten(tmp_path, kind=kind, one=", again: here") == {"last"}
    assert forgotten(tmp_path, kind=kind, one=", again: last") == {"here"}
    assert forgotten(tmp_path, kind=kind, beside=", again: last") == {"here"}


def test_asked_by_the_parent_itself(tmp_path: Path) -> None:
    leaves = "        on: {again: here}"
    stays = "        on: {again: {target: here, type: internal}}"
    assert forgotten(tmp_path, playing=leaves) == {"here", "last"}
    assert forgotten(tmp_path, playing=stays) == {"last"}


def test_asked_by_the_default_of_another(tmp_path: Path) -> None:
    assert forgotten(tmp_path, back="last", default="here") == {"here", "last"}
    assert forgotten(tmp_path, one=", again: last", default="here") == set()
