"""Promela: what the head of a model says to type is right, and so is what is not carried over."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.export.collect import network_of
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.promela.model import write_model
from tests.export.agreement import loaded
from tests.export.other_checkers import by_spin
from tests.export.test_jani import WATCHED
from tests.verify.conftest import Load

HASTY = Path(__file__).parents[2] / "machines/fischer/hasty.yaml"


@pytest.mark.cc
def test_the_commands_of_the_header(require_tool: Callable[[str], str], tmp_path: Path) -> None:
    require_tool("spin")
    network = network_of(loaded(HASTY), ExportOptions())
    text = write_model(network)
    (tmp_path / "m.pml").write_text(text, encoding="utf-8")
    commands = re.findall(r"^ \*   ((?:spin|cc) .*?)(?:   .*)?$", text, re.MULTILINE)
    assert len(commands) == 3
    said = []
    for command in commands:
        line = command.replace("FILE", "m.pml").replace("NAME", "exclusion").replace("-O2", "-w")
        done = subprocess.run(
            line, shell=True, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        said.append(done.stdout)
    assert f"{network.states + 1} states, stored" in said[1]
    assert ["errors: 0" in said[1], "errors: 1" in said[2]] == [True, True]


@pytest.mark.cc
def test_what_is_not_carried_over_is_told(load: Load) -> None:
    text = write_model(network_of(load(**WATCHED), ExportOptions()))
    assert re.findall(r"^never (\w+) ", text, re.MULTILINE) == ["never_both"]
    assert len(re.findall(r"^/\* not carried over: .* \*/$", text, re.MULTILINE)) == 3


STOPS = {
    "stops": """
system: Stops
machines: {one: stopping.yaml}
environment: {may: [one.on]}
properties: {over: {reachable: one.In(over)}}
""",
    "stopping": """
chart: Stopping
capacity: {queue: 3}
events: {in: [on], internal: [again]}
initial: here
states:
  here: {on: {on: {target: over, do: send again}}}
  over: {final: true}
""",
}


@pytest.mark.external
def test_a_machine_that_stops_forgets_its_queue(
    load: Load, require_tool: Callable[[str], str]
) -> None:
    require_tool("spin")
    network = network_of(load(**STOPS), ExportOptions())
    found = by_spin(network)
    assert found.states == network.states + 1
    assert found.holds == {"over": True}


NAMED = """
chart: Named
data:
  {enabled: bool = false, FAULT: bool = false, skip: 0..3 = 0, register: 0..3 = 0, bad_P: 0..9 = 0}
events: {in: [on]}
initial: here
states:
  here:
    on:
      on:
        if: enabled or skip + register + bad_P < 12 or not FAULT
        do: [enabled = not enabled, skip = 2, register = 3, FAULT = true, bad_P = 7]
"""


@pytest.mark.external
def test_names_that_mean_something_there(load: Load, require_tool: Callable[[str], str]) -> None:
    require_tool("spin")
    network = network_of(load(named=NAMED), ExportOptions())
    assert by_spin(network).states == network.states + 1 == 4


@pytest.mark.cc
@pytest.mark.parametrize("option", ["QUEUES", "FAULTS"])
def test_what_may_be_asked_for_besides(
    load: Load, require_tool: Callable[[str], str], tmp_path: Path, option: str
) -> None:
    """A full queue, and a fault, are errors if that is wanted."""
    require_tool("spin")
    (tmp_path / "m.pml").write_text(
        write_model(network_of(load(**BAD), ExportOptions())), encoding="utf-8"
    )
    commands = f"spin -D{option} -a m.pml && cc -w -DNOREDUCE -DNOCLAIM -o pan pan.c && ./pan -n"
    done = subprocess.run(
        commands, shell=True, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "errors: 1" in done.stdout


BAD = {
    "bad": """
system: Bad
machines: {one: talks.yaml, two: breaks.yaml}
connect: [one.word -> two.word]
environment: {may: [one.on]}
""",
    "talks": """
chart: Talks
events: {in: [on], out: [word]}
initial: here
states:
  here: {rest: true, on: {on: {do: send word; send word; send word}}}
""",
    "breaks": """
chart: Breaks
capacity: {queue: 1}
data: {n: 0..1 fault = 0}
events: {in: [word]}
initial: here
states:
  here: {rest: true, on: {word: {do: n += 1}}}
""",
}
