"""jani-models: of the form that the format asks for, with the names of their source."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from fsmkit.diagnostics import FsmkitError
from fsmkit.export.collect import network_of
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.jani.model import WIDTH, write_model
from fsmkit.export.network import Network
from tests.export.agreement import loaded
from tests.export.other_checkers import CheckerError, by_spin, by_storm, has_storm
from tests.needs import need
from tests.verify.conftest import Load
from tests.verify.random_systems import random_loop
from tests.verify.systems import SYSTEMS

MACHINES = Path(__file__).parents[2] / "machines"
SCHEMA = json.loads(Path(__file__).with_name("jani_model.schema.json").read_text(encoding="utf-8"))
BOTH = ["jani", "promela"]

WATCHED = {
    "pair": """
system: Pair
machines: {one: lamp.yaml, two: lamp.yaml}
connect: [one.lit -> two.on]
environment: {may: [one.on]}
properties:
  never_both: {never: one.In(lit) and two.In(lit)}
  heard: {never: occurs(two.on) and two.In(lit)}
  calm: livelock_free
  soon: {within: [one.In(lit), 50ms, two.In(lit)]}
""",
    "lamp": """
chart: Lamp
capacity: {queue: 3}
events: {in: [on], out: [lit]}
initial: dark
states:
  dark: {rest: true, on: {on: {target: lit, do: send lit}}}
  lit: {after: {100ms: dark}}
""",
}


def exported(system: Any, *, untimed: bool = False) -> tuple[Network, dict[str, Any]]:
    network = network_of(system, ExportOptions(untimed))
    return network, json.loads(write_model(network))


def strings(value: object) -> Iterator[str]:
    """Yield all strings of an expression but its operators."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, part in value.items():
            if key not in {"op", "comment", "function"}:
                yield from strings(part)
    elif isinstance(value, list):
        for part in value:
            yield from strings(part)


@pytest.mark.cc
@pytest.mark.parametrize(
    "file", ["fischer/fischer.yaml", "philosophers/table.yaml", "fischer/process.yaml"]
)
def test_models_have_the_form_of_the_format(file: str) -> None:
    _, model = exported(loaded(MACHINES / file))
    jsonschema.Draft202012Validator(SCHEMA).validate(model)


@pytest.mark.cc
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_name_is_declared_once(load: Load, name: str) -> None:
    _, model = exported(load(**SYSTEMS[name]))
    jsonschema.Draft202012Validator(SCHEMA).validate(model)
    declared = [part["name"] for kind in ("constants", "variables") for part in model[kind]]
    assert len(declared) == len(set(declared))
    actions = {action["name"] for action in model["actions"]}
    used = {edge["action"] for automaton in model["automata"] for edge in automaton["edges"]}
    assert used == actions == {sync["result"] for sync in model["system"]["syncs"]}
    for automaton in model["automata"]:
        for edge in automaton["edges"]:
            (destination,) = edge["destinations"]
            assert set(strings(edge["guard"])) <= {*declared, *FUNCTIONS}
            refs = [(a["ref"], a.get("index", 0)) for a in destination["assignments"]]
            assert len(refs) == len(set(refs))
            assert {name for a in destination["assignments"] for name in strings(a)} <= set(
                declared
            )
    for function in model["functions"]:
        assert set(strings(function["body"])) <= set(declared)


FUNCTIONS = {"calm", "few_wait", "monitors_wait", "plant_waits"}


@pytest.mark.cc
def test_names_and_places_are_kept() -> None:
    _, model = exported(loaded(MACHINES / "fischer/fischer.yaml"))
    assert [a["comment"] for a in model["automata"][:2]] == ["p[1]", "p[2]"]
    assert {"p[1]: timeout in wants", "tick"} <= {a["name"] for a in model["actions"]}
    constants = {c["name"]: c for c in model["constants"]}
    assert {"p_1__state__critical", "p_1__timeout_of_waits__none"} <= constants.keys()
    assert {p["name"] for p in model["properties"]} == {"exclusion", "second", "D", "foreseen"}


@pytest.mark.cc
def test_what_is_not_carried_over_is_told(load: Load) -> None:
    _, model = exported(load(**WATCHED))
    assert [p["name"] for p in model["properties"]] == ["never_both", "foreseen"]
    told = model["metadata"]["description"].splitlines()[1:]
    assert len(told) == 3
    assert all("is not carried over" in line for line in told)
    assert [line.split("`")[1] for line in told] == ["heard", "calm", "soon"]


@pytest.mark.cc
def test_lines_are_short_but_for_expressions() -> None:
    network = network_of(loaded(MACHINES / "philosophers/table.yaml"), ExportOptions())
    long = [line for line in write_model(network).splitlines() if len(line) > WIDTH]
    texts = ("comment", "description", "op")
    assert all(any(f'"{text}": ' in line for text in texts) for line in long)


@pytest.mark.parametrize("notation", BOTH)
def test_a_cyclic_schedule_is_refused_where_it_stands(load: Load, notation: str) -> None:
    from fsmkit.export.exporter import Exporter
    from fsmkit.plugins import plugin

    system = load(**random_loop(1))
    with pytest.raises(FsmkitError, match="a cyclic schedule is not exported") as refused:
        plugin(Exporter, notation).export(system, ExportOptions())
    (found,) = refused.value.diagnostics
    assert found.rule.name == "not-exported"
    assert found.primary is not None
    assert "without `schedule`" in str(found.help)


HALVES = """
chart: Halves
data: {x: float64 = 1.0}
events: {in: [less]}
initial: here
states:
  here: {on: {less: {if: x > 0.1, do: x = x / 2}}}
"""


@pytest.mark.cc
def test_floats_are_told_one_by_one(load: Load) -> None:
    network, model = exported(load(halves=HALVES))
    assert network.states == 5
    told = [c["comment"] for c in model["constants"] if c["name"].startswith("Halves__")]
    assert told == [f"{2.0**-n}" for n in range(4, -1, -1)]


def forgetful(network: Network) -> Network:
    """Return a network whose explorer has missed what a message does to a local state."""
    automata = list(network.automata)
    for number, automaton in enumerate(automata):
        if automaton.receives:
            kept = dict(list(automaton.receives.items())[:-1])
            automata[number] = replace(automaton, receives=kept)
    return replace(network, automata=tuple(automata))


@pytest.mark.cc
def test_storm_tells_what_the_explorer_never_saw() -> None:
    need(has_storm(), "stormpy")
    network = network_of(loaded(MACHINES / "philosophers/table.yaml"), ExportOptions())
    assert by_storm(network).states == network.states
    with pytest.raises(CheckerError, match="the explorer never saw"):
        by_storm(forgetful(network))


@pytest.mark.external
def test_spin_tells_what_the_explorer_never_saw(require_tool: Callable[[str], str]) -> None:
    require_tool("spin")
    network = network_of(loaded(MACHINES / "philosophers/table.yaml"), ExportOptions())
    with pytest.raises(CheckerError, match="the explorer saw less"):
        by_spin(forgetful(network))
