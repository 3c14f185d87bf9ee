"""Unused features of a chart cost nothing, and a host can omit parts."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.codegen.c.plugin import PLUGIN
from fsmkit.diagnostics import Findings, FsmkitError

PLAIN = """
chart: Door
events: {in: [open, close]}
data: {opened: uint32 = 0}
initial: shut
states:
  shut: {on: {open: {target: ajar, do: opened += 1}}}
  ajar: {on: {close: shut}}
"""
SENDER = PLAIN.replace("do: opened += 1", "do: [opened += 1, send close]")
HOST = """
#include "door.h"
int main(void)
{
    door m;
    const door_event open = {.event = DOOR_EVENT_OPEN};
    door_init(&m);
    if (door_dispatch(&m, &open, 0u) != FSM_STOPPED)
        return 1;
    door_start(&m, 0u);
    if (door_dispatch(&m, &open, 0u) != FSM_HANDLED || door_dispatch(&m, &open, 0u) != FSM_IGNORED)
        return 2;
    return door_in(&m, DOOR_STATE_AJAR) && m.data.opened == 1u ? 0 : 3;
}
"""
LEAN = Options(frozenset({"queue", "counters"}))

Write = Callable[[Path, Mapping[str, str]], Path]
Compile = Callable[..., subprocess.CompletedProcess[str]]


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "door.yaml"
    path.write_text(text)
    return path


def test_a_chart_that_raises_nothing_has_no_internal_queue(tmp_path: Path) -> None:
    header = generate_machine(load(written(tmp_path, PLAIN))).files["door.h"]
    struct = header.partition("typedef struct door {")[2].partition("}")[0]
    for member in ("internal", "budget", "busy", "fault", "now", "running", "event;"):
        assert member not in struct


@pytest.mark.cc
@pytest.mark.parametrize("compiler", ["gcc", "clang", "g++"])
def test_without_queue_and_counters(
    tmp_path: Path, compiler: str, compile_with: Compile, write: Write
) -> None:
    machine = generate_machine(load(written(tmp_path, PLAIN)), None, LEAN)
    assert machine.figures["struct_bytes"] == 8
    assert "door_post" not in machine.files["door.h"]
    if compiler == "g++":
        write(tmp_path, machine.files)
        compile_with(tmp_path, compiler, "-c", "door.c")
        return
    write(tmp_path, {**machine.files, "host.c": HOST})
    compile_with(tmp_path, compiler, "-o", "host", "host.c", "door.c", "fsm.c")
    assert subprocess.run([tmp_path / "host"], check=False).returncode == 0


def test_a_chart_that_sends_to_itself_needs_the_queue(tmp_path: Path) -> None:
    findings = Findings()
    chart = load(written(tmp_path, SENDER))
    assert PLUGIN.generate(chart, findings, {"without": "queue"}) is None
    (finding,) = findings
    assert finding.rule.name == "c-limit"
    assert "sends events to itself" in finding.message


def test_an_unknown_part_is_an_error(tmp_path: Path) -> None:
    chart = load(written(tmp_path, PLAIN))
    with pytest.raises(FsmkitError) as caught:
        PLUGIN.generate(chart, Findings(), {"without": "queues"})
    assert "`queues`" in str(caught.value)
