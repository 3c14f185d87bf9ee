"""The hub of a page against the hub in Python: the same commands, the same messages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import SeededHost
from fsmkit.runtime.session import is_received
from fsmkit.system.system import System, system_of
from tests.inspector.offline import Job, compared, in_node, in_python
from tests.verify.random_systems import load_files, random_system

pytestmark = [pytest.mark.external]
MACHINES = Path(__file__).parents[2] / "machines"
UNSUPPORTED = "a page does not evaluate"
"""What a page says to expressions that only Python evaluates."""
Json = dict[str, Any]


@pytest.fixture(autouse=True)
def node(require_tool: Callable[[str], str]) -> None:
    """Run where there is Node."""
    require_tool("node")


def compare(*jobs: Job, seed: int = 1) -> list[list[list[Json]]]:
    """Compare both hubs on commands; return what was told."""
    told = in_node(jobs, seed=seed)
    for (system, commands), found in zip(jobs, told, strict=True):
        expected = compared(in_python(system, commands, seed=seed))
        names = [{"do": "join"}, *commands]
        for command, one, other, raw in zip(names, compared(found), expected, found, strict=True):
            if raw and UNSUPPORTED in raw[-1].get("message", ""):
                if command["do"] == "watch":
                    continue
                break  # the other hub has a breakpoint that this one has not
            assert one == other, command
    return told


def commands_of(system: System, random: Random, count: int) -> list[Json]:
    """Return commands by chance; some have no meaning."""
    return [_command(system, random) for _ in range(count)]


def _command(system: System, random: Random) -> Json:
    machine = random.choice(system.machines)
    chart, name = machine.chart, machine.name
    states = [state.id for state in chart.states[1:]]
    kinds = ["post"] * 6 + ["set", "set", "step", "step", "timer", "tick", "run", "back", "seek"]
    kinds += ["break", "unbreak", "watch", "why", "events", "branches", "fork", "save", "history"]
    match random.choice(kinds):
        case "post":
            return {"do": "post", "m": name, **_event(chart, random)}
        case "set" if chart.inputs:
            declared = random.choice(chart.inputs)
            value = SeededHost(chart, random.randrange(2**31)).value(declared.type)
            value = to_json(value, declared.type)
            return {"do": "set", "m": name, "input": declared.name, "value": value}
        case "timer" | "tick" as how:
            return {"do": "step", "how": how}
        case "run":
            return {"do": "run", "speed": random.choice([0, 1, 10, 5e4])}
        case "back":
            return {"do": random.choice(["back", "forward"]), "count": random.randrange(1, 9)}
        case "seek":
            return {"do": "seek", random.choice(["n", "at"]): random.randrange(0, 60)}
        case "break":
            return _break(chart, name, states, random)
        case "unbreak":
            return {"do": "unbreak", "number": random.randrange(1, 4)}
        case "watch":
            return {"do": "watch", "m": name, "expression": _term(chart, random)}
        case "why":
            return {"do": "why", "m": name, **_event(chart, random)}
        case "events":
            return {"do": "events", "m": name}
        case "fork":
            return {"do": "fork", "branch": random.randrange(4)}
        case "save":
            return {"do": "save", "as": "script"}
        case "history":
            return {"do": "history", "from": random.randrange(9)}
        case "branches":
            return {"do": "branches"}
        case _:
            return {"do": "advance", "us": random.choice([1, 10_000, 1_000_000])}


def _event(chart: Chart, random: Random) -> Json:
    known = [event for event in chart.events if is_received(event)]
    if not known or random.random() < 0.03:
        return {"event": "nothing"}
    event = random.choice(known)
    host = SeededHost(chart, random.randrange(2**31))
    return {
        "event": event.name,
        "with": {field.name: to_json(host.value(field.type), field.type) for field in event.fields},
    }


def _break(chart: Chart, name: str, states: list[str], random: Random) -> Json:
    match random.choice(["entered", "left", "taken", "event", "sent", "condition", "fault"]):
        case "entered" | "left" as on:
            return {"do": "break", "on": on, "m": name, "what": random.choice(states)}
        case "taken":
            number = random.randrange(len(chart.transitions) + 1)
            return {"do": "break", "on": "taken", "m": name, "what": number}
        case "condition":
            what = f"{_term(chart, random)} == {_term(chart, random)}"
            return {"do": "break", "on": "condition", "m": name, "what": what}
        case "fault":
            return {"do": "break", "on": "fault"}
        case on:
            event = random.choice(chart.events).name if chart.events else "nothing"
            return {"do": "break", "on": on, "m": name, "what": event}


def _term(chart: Chart, random: Random) -> str:
    names = [each.name for each in (*chart.data, *chart.inputs, *chart.outputs)]
    states = [state.id for state in chart.states[1:]]
    one, other = (random.choice(names or ["1"]) for _ in range(2))
    return random.choice(
        [one, f"{one} + {random.randrange(9)}", f"{one} * {other}", f"In({random.choice(states)})",
         f"{one} - {other}", f"-{one}", f"{one} / 3", f"{one} % {other}", f"min({one}, 3)",
         f"abs({one})", f"{one} < {other} or not {one} == {other}", "2ms", f"{one}[1]"]
    )  # fmt: skip


def driven(system: System, random: Random, count: int) -> list[Json]:
    """Return commands by chance; a session that runs is let go on now and then."""
    found: list[Json] = []
    for command in commands_of(system, random, count):
        found.append(command)
        if command["do"] == "run":
            found.append({"do": "advance", "us": 100_000})
            found += [{"do": "pause"}] if random.random() < 0.7 else []
    return found


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_random_charts(seed: int) -> None:
    random = Random(seed)
    jobs = []
    for number in range(5):
        system = system_of(random_case(seed, number).chart)
        jobs.append((system, driven(system, random, 40)))
    compare(*jobs, seed=random.randrange(1, 2**31))


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_random_systems(seed: int) -> None:
    random = Random(seed)
    jobs = []
    for number in range(5):
        system = load_files(random_system(seed + number))
        jobs.append((system, driven(system, random, 40)))
    compare(*jobs, seed=random.randrange(1, 2**31))
