"""The code of a system: all machines but its world, whose connections are the host's."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from tests.codegen.c.conftest import WARNINGS

DOCK = """
system: Dock
machines: {gate: gate.yaml, lamp: lamp.yaml, guide: guide.yaml}
connect:
  - gate.lift -> guide.lift
  - gate.opened -> lamp.on
  - gate.opened -> guide.seen
  - guide.there -> gate.there
  - guide.weight -> gate.weight
environment: {ENVIRONMENT}
properties: {safe: {never: gate.In(open) and guide.In(away)}}
"""
GATE = """
chart: Gate
inputs: {weight: 0..100}
operations: ["lift(height 0..9)"]
events: {in: [card, there], out: ["opened(load 0..100)"]}
initial: shut
states:
  shut: {rest: true, on: {card: lifting}}
  lifting: {entry: lift(4), on: {there: open}}
  open: {rest: true, entry: send opened(load = weight), on: {card: shut}}
"""
LAMP = "chart: Lamp\nevents: {in: [on]}\ninitial: s\nstates: {s: {rest: true, on: {on: s}}}\n"
GUIDE = """
chart: Guide
events: {in: ["lift(height 0..9)", "seen(load 0..100)"], out: [there]}
outputs: {weight: 0..100 = 0}
initial: away
states:
  away: {rest: true, on: {lift: moving}}
  moving: {after: {400ms..800ms: {target: here, do: send there; weight = 7}}}
  here: {rest: true, on: {seen: away}}
"""
TOLD = (
    "the host implements `gate.lift`, `gate.opened`; it posts `gate.there`; it writes `gate.weight`"
)
HOST = """
#include <stdio.h>
#include "dock.h"
static dock s;
void gate_lift(gate *m, uint8_t height) { (void)m; printf("lift %d\\n", height); }
void dock_outside_gate_send_opened(gate *m, uint8_t load)
{
    (void)m;
    printf("opened %d\\n", load);
}
int main(void)
{
    gate_event e = GATE_NO_EVENT;
    dock_init(&s);
    (void)dock_start(&s, 0u);
    e.event = GATE_EVENT_CARD;
    (void)gate_post(&s.gate, &e);
    (void)dock_run(&s, 1u);
    s.gate.in.weight = 33u;
    e.event = GATE_EVENT_THERE;
    (void)gate_post(&s.gate, &e);
    (void)dock_run(&s, 2u);
    printf("%d\\n", gate_in(&s.gate, GATE_STATE_OPEN));
    return 0;
}
"""

WITH_WORLD: dict[str, Any] = {"with": "world"}
AND_SAVE: dict[str, Any] = {"with": "save,world"}


@pytest.fixture
def dock(tmp_path: Path) -> Callable[[str], Path]:
    def written(environment: str) -> Path:
        texts = {"dock": DOCK.replace("ENVIRONMENT", environment), "gate": GATE}
        for name, text in (texts | {"lamp": LAMP, "guide": GUIDE}).items():
            (tmp_path / f"{name}.yaml").write_text(text)
        return tmp_path / "dock.yaml"

    return written


@pytest.mark.parametrize("key", ["world", "will"])
def test_the_file_that_was_checked_compiles(dock: Callable[[str], Path], key: str) -> None:
    path = dock(f"may: [gate.card], {key}: [guide]")
    assert load_any(path, Findings()).machines[2].environment
    findings = Findings()
    files = fsmkit.compile(path, findings=findings)
    assert {"gate.c", "lamp.c", "dock.c"} <= set(files)
    assert not [name for name in files if name.startswith("guide")]
    (note,) = (found for found in findings if found.rule.name == "world-left-out")
    assert "`guide`" in note.message
    assert note.help == TOLD


def test_every_target_leaves_it_out(dock: Callable[[str], Path]) -> None:
    path = dock("may: [gate.card], world: [guide]")
    for target in ("python", "javascript"):
        assert not [name for name in fsmkit.compile(path, target) if "guide" in name]


def test_it_is_written_on_demand_if_nothing_in_it_chooses(dock: Callable[[str], Path]) -> None:
    path = dock("may: [gate.card], world: [guide]")
    with pytest.raises(FsmkitError, match="interval"):
        fsmkit.compile(path, **WITH_WORLD)
    (path.parent / "guide.yaml").write_text(GUIDE.replace("400ms..800ms", "400ms"))
    findings = Findings()
    files = fsmkit.compile(path, findings=findings, **AND_SAVE)
    assert "guide.c" in files
    assert "gate_save" in files["gate.h"]
    assert "world-left-out" not in {found.rule.name for found in findings}
    assert execute(["compile", str(path), "--with", "world", "--out", str(path.parent / "o")]) == 0
    assert (path.parent / "o" / "guide.c").exists()


def test_where_nothing_would_be_left_all_is_written(dock: Callable[[str], Path]) -> None:
    path = dock("world: [gate, lamp, guide]")
    (path.parent / "guide.yaml").write_text(GUIDE.replace("400ms..800ms", "400ms"))
    assert {"guide.c", "gate.c"} <= set(fsmkit.compile(path))


@pytest.mark.parametrize("item", ["gate.card", "gate.weight", "nobody", "", "gate.card(x = 1)"])
def test_of_the_world_are_whole_machines(dock: Callable[[str], Path], item: str) -> None:
    with pytest.raises(FsmkitError) as caught:
        load_any(dock(f'world: ["{item}"]'), Findings())
    assert {"broken-connection", "unknown-name"} & {f.rule.name for f in caught.value.diagnostics}


@pytest.mark.cc
def test_the_host_has_what_led_there(
    dock: Callable[[str], Path], tmp_path: Path, require_tool: Callable[[str], str]
) -> None:
    files = fsmkit.compile(dock("may: [gate.card], world: [guide]")) | {"main.c": HOST}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    sources = [name for name in files if name.endswith(".c")]
    gcc = require_tool("gcc")
    for step in ([gcc, "-std=c99", *WARNINGS, *sources, "-o", "host"], ["./host"]):
        done = subprocess.run(step, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:3000]
    assert done.stdout.splitlines() == ["lift 4", "opened 33", "1"]
