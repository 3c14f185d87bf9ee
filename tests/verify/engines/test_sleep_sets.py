"""Steps that sleep: what is found without them is what is found with them, at the same distance."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import fsmkit
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.any_file import load_any
from fsmkit.verify.engines.c.engine import CEngine, Progress
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from tests.verify.conftest import Load
from tests.verify.random_systems import load_files, random_loop, random_system

pytestmark = [
    pytest.mark.cc,
    pytest.mark.usefixtures("own_cache", "quickly_compiled"),
]

MACHINES = Path(__file__).parents[3] / "machines"


def told(program: Path, *more: str) -> dict[str, Any]:
    """Return what the explorer tells; of a path its length."""
    command = [str(program), "--livelock", "--traps", "--timeout", "60", *more]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])["result"]
    result["marks"] = {mark["mark"]: len(mark["path"]) for mark in result["marks"]}
    result["traps"] = sorted(map(len, result["traps"] or []))
    result["livelock"] = result["livelock"] is not None
    for answer in result["temporal"]:
        answer.pop("cycle", None)
        answer["path"] = len(answer.get("path", []))
    return result


def slept(closed: ClosedSystem) -> tuple[int, int]:
    """Compare, and return how many steps slept, of how many."""
    with closing(CEngine(closed, Findings())) as built:
        more = built.temporal_options()
        some, every = told(built.program, *more), told(built.program, "--sleepless", *more)
        on_two = told(built.program, "--cores", "2", "--share", "1,1", *more)
    assert some["outcome"] == "complete"
    asleep = some["left_out"]
    assert every["left_out"] == 0
    assert on_two["left_out"] == asleep
    for found in (some, on_two):
        for name in ("bytes", "left_out", "dense", "cores", "seconds"):
            found.pop(name, None)
        assert found == {name: every[name] for name in found}
    return asleep, some["transitions"]


@pytest.mark.parametrize("seed", range(300, 308))
@pytest.mark.parametrize("untimed", [False, True])
def test_random_systems_are_the_same_asleep(seed: int, untimed: bool) -> None:
    slept(close(load_files(random_system(seed)), untimed=untimed))


@settings(max_examples=1, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 1_000_000), st.booleans(), st.booleans())
def test_any_random_system_is_the_same_asleep(seed: int, untimed: bool, loop: bool) -> None:
    files = random_loop(seed) if loop else random_system(seed)
    try:
        closed = close(load_files(files), untimed=untimed)
    except FsmkitError:
        assume(False)
    slept(closed)


def test_steps_of_philosophers_that_share_no_fork_sleep() -> None:
    closed = close(load_any(MACHINES / "philosophers/table.yaml", Findings()), untimed=True)
    asleep, steps = slept(closed)
    assert 0 < asleep < steps / 2


LAMP = """
chart: Lamp
events: {in: [press], out: [lit]}
initial: dark
states:
  dark: {on: {press: {target: light, do: send lit}}}
  light: {on: {press: dark}}
"""
LAMPS = """
system: Lamps
machines: {"lamp[i in 0..2]": lamp.yaml}
environment: {will: ["lamp[i].press"]}
"""


def test_a_state_of_a_cube_takes_the_steps_of_the_last_mover_and_those_after_it(load: Load) -> None:
    """Three lamps that nobody connects; the last one that is lit was the last to be switched."""
    closed = close(load(lamps=LAMPS, lamp=LAMP), untimed=True)
    asleep, steps = slept(closed)
    dark, first, second, third = 3, 3, 2 * 2, 4 * 1
    assert steps == 8 * 3
    assert steps - asleep == dark + first + second + third


def test_where_steps_are_evaluated_none_sleeps(load: Load) -> None:
    evaluated = LAMPS + 'properties: {p: {never: "occurs(lamp[0].press) and lamp[1].In(light)"}}\n'
    asleep, _ = slept(close(load(lamps=evaluated, lamp=LAMP), untimed=True))
    assert asleep == 0


def test_what_makes_the_environment_answer_is_no_step_to_sleep(load: Load) -> None:
    """Each switch is told to a machine of the environment, which answers before anything else."""
    counter = """
chart: Counter
data: {n: 0..3 = 0}
events: {in: [lit]}
initial: counts
states: {counts: {rest: true, on: {lit: {do: n = (n + 1) % 4}}}}
"""
    told_of = LAMPS.replace("lamp.yaml}", "lamp.yaml, counter: counter.yaml}")
    told_of = told_of.replace('press"]', 'press", counter]')
    told_of += 'connect: ["lamp[i].lit -> counter.lit"]\n'
    lamp = LAMP.replace("press: dark", "press: {target: dark, do: send lit}")
    asleep, _ = slept(close(load(lamps=told_of, lamp=lamp, counter=counter), untimed=True))
    assert asleep == 0


def test_the_switch_of_the_api_reaches_the_explorer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lamp.yaml").write_text(LAMP, encoding="utf-8")
    path = tmp_path / "lamps.yaml"
    path.write_text(LAMPS, encoding="utf-8")
    left_out: list[int] = []
    ask = CEngine.result

    def asked(self: CEngine, command: list[str], progress: Progress | None) -> Mapping[str, Any]:
        result = ask(self, command, progress)
        left_out.append(result["left_out"])
        return result

    monkeypatch.setattr(CEngine, "result", asked)
    found = [
        fsmkit.check(path, reductions=names).exploration for names in (("dead", "sleep"), ("dead",))
    ]
    assert left_out[0] > left_out[1] == 0
    assert [(e.states, e.transitions) for e in found] == [(8, 24), (8, 24)]
