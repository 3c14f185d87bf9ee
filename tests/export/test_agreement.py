"""The explorer, SPIN and Storm agree; `make agreement` has the whole table."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import islice
from pathlib import Path

import pytest

from tests.export.agreement import Case, loaded, random_cases
from tests.export.other_checkers import Compared, compare, has_storm
from tests.needs import need
from tests.verify.conftest import Load
from tests.verify.systems import SYSTEMS

MACHINES = Path(__file__).parents[2] / "machines"


@cache
def small() -> tuple[Case, ...]:
    return tuple(islice(random_cases(), 6))


pytestmark = [pytest.mark.cc, pytest.mark.external]


@pytest.fixture(name="checkers", autouse=True)
def all_checkers(require_tool: Callable[[str], str]) -> None:
    require_tool("spin")
    need(has_storm(), "stormpy")


def agree(found: Compared) -> None:
    assert found.differences() == []
    assert found.storm is not None
    assert found.spin.holds.keys() == found.storm.holds.keys() - unclaimed(found)


def unclaimed(found: Compared) -> set[str]:
    """Return what JANI says and no never claim does."""
    return {name for name in found.explorer.holds if name.startswith("again")}


@pytest.mark.parametrize(
    ("file", "states", "violated"),
    [
        ("fischer/fischer.yaml", 68, set()),
        ("fischer/hasty.yaml", 70, {"exclusion"}),
        ("philosophers/table.yaml", 280, {"D"}),
        ("philosophers/ordered_table.yaml", 192, set()),
    ],
)
def test_on_the_examples(file: str, states: int, violated: set[str]) -> None:
    found = compare(file, loaded(MACHINES / file))
    agree(found)
    assert found.storm is not None
    assert found.storm.states == states
    assert {name for name, holds in found.storm.holds.items() if not holds} == violated


@pytest.mark.parametrize("name", ["livelock", "deadlock", "drive"])
def test_on_small_systems(load: Load, name: str) -> None:
    agree(compare(name, load(**SYSTEMS[name])))


ANSWERED = {
    "asks": """
system: Asks
machines: {lamp: lamp.yaml}
environment: {may: [lamp.on], will: [lamp.off]}
properties:
  goes_out: {leads_to: [lamp.In(lit), lamp.In(dark)]}
  stays: {leads_to: [lamp.In(dark), lamp.In(broken)]}
  again_dark: {recoverable: lamp.In(dark)}
""",
    "lamp": """
chart: Lamp
events: {in: [on, off]}
initial: dark
states:
  dark: {rest: true, on: {on: lit}}
  lit: {on: {off: dark, on: broken}}
  broken: {rest: true}
""",
}


def test_temporal_properties(load: Load) -> None:
    found = compare("asks", load(**ANSWERED))
    agree(found)
    assert found.storm is not None
    assert found.storm.holds["again_dark"] is False
    assert found.unfair == {"goes_out", "stays"}
    assert not found.storm.holds["stays"]


SEVERAL_STARTS = {
    "dice": """
system: Dice
machines: {one: die.yaml, two: die.yaml}
properties: {same: {never: one.n == two.n}, high: {reachable: one.n + two.n == 4}}
""",
    "die": """
chart: Die
operations: [throw() -> 0..2]
data: {n: 0..2 = 0}
initial: here
states:
  here: {rest: true, entry: n = throw()}
""",
}


def test_several_initial_states(load: Load) -> None:
    found = compare("dice", load(**SEVERAL_STARTS))
    agree(found)
    assert found.explorer.states == 9
    assert found.explorer.holds["same"] is False


def test_on_a_chart_alone() -> None:
    agree(compare("process", loaded(MACHINES / "fischer/process.yaml")))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(6))
def test_on_random_systems(number: int) -> None:
    agree(small()[number].compare())
