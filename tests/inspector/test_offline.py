"""The hub of a page against the hub in Python: the same commands, the same messages."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from devtools.differential import random_case
from fsmkit.chart.chart import Chart, every_operation
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.saving import script_trace
from fsmkit.inspector.scenarios import read_scenario
from fsmkit.inspector.sources.counterexample import read_trace
from fsmkit.language import BOOL
from fsmkit.runtime.live.lines import lines_of
from fsmkit.runtime.live.messages import Step
from fsmkit.runtime.live.values import to_json
from fsmkit.runtime.script import SeededHost, is_received
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.system.system import System
from tests.inspector.conftest import GATE, elaborated
from tests.inspector.offline import Job, compared, in_node, in_python
from tests.verify.random_systems import load_files, random_system

pytestmark = [pytest.mark.external]
MACHINES = Path(__file__).parents[2] / "machines"
MANY = "FSMKIT_PAGE_EXAMPLES"
"""A variable with the number of random examples of a long run, which has new seeds each time."""
IS_LONG = MANY in os.environ
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
            if command["do"] in ("watch", "break", "find") and {one[-1]["k"], other[-1]["k"]} == {
                "refused"
            }:
                continue  # by a rule of their own
            assert is_same(one, other), (command, one, other)
    return told


def is_same(one: object, other: object) -> bool:
    """Compare what was told: JavaScript writes a large float as an integer with zeros."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(is_same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, int) and isinstance(other, float):
        return float(one) == other
    return one == other


def commands_of(system: System, random: Random, count: int) -> list[Json]:
    """Return commands by chance; some have no meaning."""
    return [_command(system, random) for _ in range(count)]


def _command(system: System, random: Random) -> Json:
    machine = random.choice(system.machines)
    chart, name = machine.chart, machine.name
    states = [state.id for state in chart.states[1:]]
    kinds = ["post"] * 6 + ["set", "set", "returns", "step", "step", "timer", "tick", "run"]
    kinds += ["back", "seek", "micro", "micro", "find"]
    kinds += ["break", "unbreak", "watch", "why", "events", "branches", "fork", "save", "history"]
    match random.choice(kinds):
        case "post":
            return {"do": "post", "m": name, **_event(chart, random)}
        case "set" if chart.inputs:
            declared = random.choice(chart.inputs)
            value = SeededHost(chart, random.randrange(2**31)).value(declared.type)
            value = to_json(value, declared.type)
            return {"do": "set", "m": name, "input": declared.name, "value": value}
        case "returns":
            operations = every_operation(chart)
            returning = [(n, one.result) for n, one in operations.items() if one.result]
            operation, type_ = random.choice([*returning, ("nothing", BOOL)])
            host = SeededHost(chart, random.randrange(2**31))
            results = [to_json(host.value(type_), type_) for _ in range(random.randrange(3))]
            return {"do": "returns", "m": name, "operation": operation, "results": results}
        case "timer" | "tick" as how:
            return {"do": "step", "how": how}
        case "run":
            speed = random.choice([0, 1, 10, 5e4, None])
            return {"do": "run", **({} if speed is None else {"speed": speed})}
        case "back":
            return {"do": random.choice(["back", "forward"]), "count": random.randrange(1, 9)}
        case "seek":
            return {"do": "seek", random.choice(["n", "at"]): random.randrange(0, 60)}
        case "break":
            log = {"log": f"is {{{_term(chart, random)}}}!"} if random.random() < 0.3 else {}
            return {**_break(chart, name, states, random), **log}
        case "micro":
            return {"do": "micro", "n": random.randrange(1, 40)}
        case "find":
            wanted = _break(chart, name, states, random)
            is_back = random.random() < 0.5
            return {**wanted, "do": "find", "from": random.randrange(60), "back": is_back}
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


@settings(
    max_examples=int(os.environ.get(MANY, "5")),
    deadline=None,
    derandomize=not IS_LONG,
    phases=[Phase.explicit, Phase.generate],
)
@example(seed=362962)  # two events of one name, a breakpoint on both
@example(seed=69779)  # a float beyond all integers
@given(seed=st.integers(0, 2**32))
def test_random_charts(seed: int) -> None:
    random = Random(seed)
    jobs = []
    for number in range(5):
        system = system_of(random_case(seed, number).chart)
        jobs.append((system, driven(system, random, 40)))
    compare(*jobs, seed=random.randrange(1, 2**31))


@settings(
    max_examples=int(os.environ.get(MANY, "4")),
    deadline=None,
    derandomize=not IS_LONG,
    phases=[Phase.generate],
)
@given(seed=st.integers(0, 2**32))
def test_random_systems(seed: int) -> None:
    random = Random(seed)
    jobs: list[Job] = []
    number = seed
    while len(jobs) < 5:
        number += 1
        with suppress(FsmkitError):  # a property names an element that no chart does
            system = load_files(random_system(number))
            jobs.append((system, driven(system, random, 40)))
    compare(*jobs, seed=random.randrange(1, 2**31))


@pytest.mark.parametrize("number", [0, 7])
def test_systems_of_the_repository(number: int) -> None:
    random = Random(number)
    names = ("production_cell/cell", "production_cell/feeder_belt", "fischer/fischer",
             "philosophers/table", "heated_mould/mould", "moulding_line/line")  # fmt: skip
    jobs = []
    for name in names:
        system = load_any(MACHINES / f"{name}.yaml", Findings())
        jobs.append((system, driven(system, random, 30)))
    compare(*jobs)


LIVELOCK = """\
chart: Loop
initial: a
states: {a: {after: {0ms: b}}, b: {after: {0ms: a}}}
"""


def test_time_that_stands_still() -> None:
    commands = [{"do": "run", "speed": 0}, *({"do": "advance", "us": 1} for _ in range(12))]
    (told,) = in_node([(system_of(elaborated(LIVELOCK)), commands)])
    (why,) = [m["why"] for each in told for m in each if m.get("why", [""])[0] == "fault"]
    assert why[1] == "livelock"
    assert why[2] == (
        "time stands still at 0ms: `Loop` takes more than 10,000 steps at one time, in `a`, `b`"
    )


def test_properties_and_conditions_given_beforehand() -> None:
    system = load_any(MACHINES / "philosophers/table.yaml", Findings())
    (own,) = in_node(
        [(system, [{"do": "break", "on": "property", "what": p.name} for p in system.properties])]
    )
    expected = in_python(
        system, [{"do": "break", "on": "property", "what": p.name} for p in system.properties]
    )
    assert compared(own) == compared(expected)
    gate = system_of(elaborated(GATE))
    steps = [{"do": "post", "m": "Gate", "event": "open"}, {"do": "step", "how": "timer"}]
    text = "(count << 1) == 2 and In(wide)"  # no page reads bit operators
    (told,) = in_node([(gate, steps)], conditions=[text])
    assert told[-1][-2]["why"] == ["breakpoint", 1]


SCRIPT = """\
input blocked 1
start 0
post open
run 100
input blocked 0
post open
post fault jam
run 200
post fault lost
run 5000
"""


def test_a_scenario_is_what_its_script_does(tmp_path: Path) -> None:
    path = tmp_path / "gate.txt"
    path.write_text(SCRIPT, encoding="utf-8")
    system = system_of(elaborated(GATE))
    scenario = read_scenario(system, path)
    commands: list[Json] = [{"do": "play", "scenario": "gate"}, {"do": "history"}]
    (told,) = in_node([(system, [*commands, {"do": "save", "as": "script"}])], scenarios=[scenario])
    steps = [message for message in told[2] if message["k"] == "step"]
    expected = [line for line in script_trace(system, SCRIPT.splitlines()) if line.startswith("@")]
    assert [step["at"] for step in steps] == [int(line[1:].split()[0]) for line in expected]
    saved = told[3][0]["result"].splitlines()
    assert script_trace(system, saved) == script_trace(system, SCRIPT.splitlines())


def test_a_saved_pytest_passes(tmp_path: Path) -> None:
    path = tmp_path / "gate.yaml"
    path.write_text(GATE, encoding="utf-8")
    system = load_any(path, Findings())
    commands = [{"do": "post", "m": "Gate", "event": "open"}, {"do": "step", "how": "timer"}]
    commands.append({"do": "save", "as": "pytest"})
    (told,) = in_node([(system, commands)], file=str(path))
    found: dict[str, Any] = {}
    exec(compile(told[-1][0]["result"], "test_saved.py", "exec"), found)
    found["test_it_does_so_again"]()
    found["TRACE"][-1] = "= nowhere"
    with pytest.raises(AssertionError):
        found["test_it_does_so_again"]()


@pytest.mark.slow
def test_an_hour_of_the_cell() -> None:
    """Compare all steps of an hour, with an event from outside every ten seconds."""
    system = load_any(MACHINES / "production_cell/cell.yaml", Findings())
    charts = {machine.name: machine.chart for machine in system.machines}
    random = Random(2026)
    script = ["start", "run 0"]
    commands: list[Json] = [{"do": "history"}]
    for second in range(0, 3600, 10):
        machine, _, event = random.choice(
            ["plant.press_start"] * 5 + ["feeder.resume", "molder.resume"] * 2
            + ["plant.press_estop", "plant.press_stop", "feeder.pause", "molder.pause"]
        ).partition(".")  # fmt: skip
        script += [f"post {machine}.{event}", f"run {1000 * (second + 10)}"]
        commands.append({"do": "post", "m": machine, "event": event})
        commands += [{"do": "run", "speed": 1000}, {"do": "advance", "us": 10_000}]
    (told,) = in_node([(system, commands)])
    steps = [m for each in told for m in each if m["k"] == "step"]
    lines: list[str] = []
    on: dict[str, list[str]] = {machine.name: [] for machine in system.machines}
    for step in (msgspec.convert(message, Step) for message in steps):
        lines += [f"{step.m}: {line}" for line in lines_of(charts[step.m], step, on[step.m])]
        if not isinstance(step.on, msgspec.UnsetType):
            on[step.m] = step.on
    assert lines[-1].startswith(("plant", "feeder", "molder"))
    assert len(steps) > 3_000
    assert lines == [line for line in script_trace(system, script) if "full queue" not in line]


@pytest.mark.cc
def test_a_counterexample_is_a_scenario(tmp_path: Path) -> None:
    hasty = MACHINES / "fischer/hasty.yaml"
    assert execute(["check", str(hasty), "--save-trace", str(tmp_path)]) == 1
    path = tmp_path / "Hasty_exclusion.json"
    recording, _ = read_trace(path)
    scenario = read_scenario(recording.system, path)
    commands = [{"do": "play", "scenario": path.stem}, {"do": "history"}]
    commands += [{"do": "watch", "expression": "p[1].turn"}, {"do": "step", "how": "timer"}]
    (told,) = in_node([(recording.system, commands)], scenarios=[scenario])
    assert told[1][-2]["why"] == ["property", "exclusion"]
    expected: list[Json] = []
    hub = Hub(recording)
    client = hub.join(lambda text: expected.extend(as_list(json.loads(text))))
    expected.clear()
    hub.receive(client, '{"id": 2, "do": "history"}')
    assert compared([told[2][:-1]]) == compared([expected[:-1]])
    assert told[3][0]["result"] == {"value": 2, "type": "0..16"}
    assert told[4][-1]["k"] == "done"


def as_list(found: Any) -> list[Json]:
    return found if isinstance(found, list) else [found]
