"""One macrostep at a time, a system does what it does at once."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.inspector.simulation import Moment, Simulation
from fsmkit.runtime.interpreter.snapshot import Macrostep
from fsmkit.runtime.interpreter.trace import trace_lines
from fsmkit.runtime.script import Player, is_received, read_line, script_texts
from fsmkit.runtime.system_session import SystemPlayer
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System

ROOT = Path(__file__).parents[2]
CELL = ROOT / "machines/production_cell"
SYSTEMS = [
    *(CELL / name for name in ("cell.yaml", "ring.yaml", "ring_by_position.yaml")),
    *sorted((CELL / "pairs").glob("*.yaml")),
    *sorted((CELL / "homing").glob("*.yaml")),
    *(ROOT / f"tests/verify/found/{name}.yaml" for name in ("cyclic", "queued_delay")),
]
"""Those without delays that are intervals, which a session takes from another generator."""
LONG = 20_000
"""Ticks between posts, at most."""


def taken(simulation: Simulation, moment: Moment, until: int) -> tuple[Moment, list[str]]:
    """Step until a time."""
    lines: list[str] = []
    while True:
        moment, stepped = simulation.step(moment, until)
        if stepped is None:
            return moment, lines
        chart, name = simulation.charts[stepped.machine], simulation.names[stepped.machine]
        lines += [f"{name}: {line}" for line in trace_lines(chart, (stepped.macrostep,))]


@pytest.mark.slow
@pytest.mark.parametrize("path", SYSTEMS, ids=lambda path: path.stem)
def test_steps_of_a_system_are_those_of_a_session(path: Path) -> None:
    system = load_any(path, Findings())
    player = SystemPlayer(system, 1)
    posts = [
        (machine.name, event.name)
        for machine in system.machines
        for event in machine.chart.events
        if is_received(event) and not event.fields
    ]
    random = Random(path.stem)
    lines = ["start"]
    now = 0
    for _ in range(40):
        now += random.choice((0, 1, random.randrange(LONG)))
        lines.append(f"run {now}")
        if posts:
            lines += ["post " + ".".join(random.choice(posts)), f"run {now}"]
    assert stepped_by(system, lines) == played_by(player, lines)


def played_by(player: SystemPlayer, lines: list[str]) -> list[str]:
    told: list[str] = []
    for line in script_texts(lines):
        for name, done in player.play(line):
            if isinstance(done, Macrostep):
                chart = player.charts[name]
                told += [f"{name}: {text}" for text in trace_lines(chart, (done,))]
            else:
                told.append(f"{name}: {done}")
    return told


def stepped_by(system: System, lines: list[str]) -> list[str]:
    simulation = Simulation(system)
    moment = simulation.begin()
    told: list[str] = []
    for line in lines:
        verb, _, rest = line.partition(" ")
        if verb == "post":
            name, _, event = rest.partition(".")
            machine = simulation.names.index(name)
            (text,) = script_texts([f"post {event}"])
            occurrence = read_line(simulation.charts[machine], text).event
            after = simulation.post(moment, machine, occurrence)
            told += [f"{name}: full queue"] if after is None else []
            moment = moment if after is None else after
        else:
            moment, more = taken(simulation, moment, int(rest or 0))
            told += more
    return told


@pytest.mark.slow
def test_steps_of_a_chart_are_those_of_a_player() -> None:
    compared = 0
    for number in range(60):
        case = random_case(43, number)
        wanted = [
            line
            for line in case.script
            if line.split()[0] in ("start", "post", "run", "input") and not line.startswith("seed")
        ]
        compared += compare(case.chart, wanted)
    assert compared > 1000


def compare(chart: Chart, lines: list[str]) -> int:
    """Compare a script, of which `start` may come once and time goes on from 0."""
    simulation, player = Simulation(system_of(chart)), Player(chart)
    script = ["start 0", "run 0"]
    now = 0
    for line in lines:
        verb, *words = line.split()
        if verb == "run":
            now += int(words[0]) % 977
            script.append(f"run {now}")
        elif verb != "start":
            script += [line, f"run {now}"]
    moment = simulation.begin()
    count = 0
    for text in script_texts(script):
        done = [each for each in player.play(text) if isinstance(each, Macrostep)]
        expected = [f"{chart.name}: {line}" for line in trace_lines(chart, done)]
        read = read_line(chart, text)
        found: list[str] = []
        match read.verb:
            case "post":
                moment = simulation.post(moment, 0, read.event) or moment
            case "input":
                moment = simulation.set_input(moment, 0, read.number, read.value)
            case "start":
                moment, stepped = simulation.step(moment, 0)
                assert stepped is not None
                found = [f"{chart.name}: {t}" for t in trace_lines(chart, (stepped.macrostep,))]
            case _:
                moment, found = taken(simulation, moment, read.number)
        assert found == expected, text.value
        count += len(expected)
    return count
