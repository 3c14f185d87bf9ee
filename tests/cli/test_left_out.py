"""``fsmkit compile`` of a deployment names the machines that are on no node."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute

DOOR = """\
chart: Door
inputs: {shut: bool}
events: {in: [go, limit], out: [moved]}
operations: [motor(speed 0..9)]
initial: a
states:
  a: {on: {go: {target: b, do: motor(1)}}}
  b: {on: {limit: {if: shut, target: a, do: send moved}}}
"""
PLANT = """\
chart: Plant
events: {in: [motor(speed 0..9), moved], out: [limit]}
outputs: {shut: bool = false}
initial: a
states:
  a: {on: {motor: {target: b, do: shut = true}, moved: a}}
  b: {rest: true, after: {1s: {target: a, do: send limit}}}
"""
SYSTEM = """\
system: S
machines: {door: door.yaml, plant: plant.yaml}
connect:
  - door.motor -> plant.motor
  - door.moved -> plant.moved
  - plant.limit -> door.limit
  - plant.shut -> door.shut
environment: {will: [plant], may: [door.go]}
"""


def test_the_parts_of_the_host_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "door.yaml").write_text(DOOR)
    (tmp_path / "plant.yaml").write_text(PLANT)
    (tmp_path / "s.yaml").write_text(SYSTEM)
    file = tmp_path / "d.yaml"
    verb = ["compile", str(file), "--out", str(tmp_path / "out")]
    file.write_text("system: s.yaml\nnodes: {one: [door]}\n")
    assert execute(verb) == 0
    told = " ".join(capsys.readouterr().err.split())
    assert "world-left-out: `plant` is on no node, so no code is written for it" in told
    assert "the host posts `door.limit`, sets `door.shut`, takes `door.motor`, `door.moved`" in told
    file.write_text("system: s.yaml\nnodes: {one: [door, plant]}\n")
    assert execute(verb) == 0
    assert "world-left-out" not in capsys.readouterr().err
