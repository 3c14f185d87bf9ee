"""Local states by their components: told apart, in cubes, and steps by what they change."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsmkit.export.changes import Joint, changes, joint_moves, shifting_components
from fsmkit.export.collect import network_of
from fsmkit.export.components import Code, Cubes, Parts
from fsmkit.export.exporter import ExportOptions
from fsmkit.export.jani.model import model_of
from fsmkit.export.network import Automaton, Network
from tests.export.other_checkers import has_storm
from tests.needs import need
from tests.verify.conftest import Load

CODES = st.lists(
    st.tuples(*[st.integers(0, most) for most in (1, 3, 5)]), min_size=1, max_size=40, unique=True
)


@pytest.mark.cc
def test_components_tell_local_states_apart(supervisor: Network) -> None:
    (automaton,) = supervisor.automata
    parts = Parts(supervisor)
    (components,), (codes,) = parts.components, parts.codes
    assert len(set(codes)) == len(automaton.locals) == len(codes)
    for column, component in zip(zip(*codes, strict=True), components, strict=True):
        assert set(column) == component.texts.keys()
        assert component.words.keys() == component.texts.keys()
        assert len(set(component.words.values())) == len(component.words) > 1


@given(CODES, st.data())
def test_cubes_hold_what_is_wanted_and_nothing_else(codes: list[Code], data: st.DataObject) -> None:
    wanted = data.draw(st.sets(st.sampled_from(range(len(codes)))))
    cubes = Cubes(codes).cover(wanted)
    held = {
        number
        for number, code in enumerate(codes)
        if any(all(code[n] in values for n, values in cube.items()) for cube in cubes)
    }
    assert held == wanted
    assert len(cubes) <= len(wanted)


def test_a_cube_leaves_out_what_makes_no_difference() -> None:
    codes = [(a, b) for a in range(3) for b in range(4)]
    of_two = [n for n, (a, _) in enumerate(codes) if a == 2]
    assert Cubes(codes).cover(of_two) == [{0: frozenset({2})}]
    but_one = [n for n, (a, b) in enumerate(codes) if a == 2 and b != 1]
    assert Cubes(codes).cover(but_one) == [{0: frozenset({2}), 1: frozenset({0, 2, 3})}]


@given(CODES, st.data())
def test_each_step_is_made_by_one_change(codes: list[Code], data: st.DataObject) -> None:
    number = st.sampled_from(range(len(codes)))
    steps = data.draw(st.lists(st.tuples(number, number), max_size=30))
    made: list[int] = []
    for change, places in changes(codes, steps):
        made += places
        for before, after in (steps[place] for place in places):
            assert codes[after] == tuple(change.get(n, old) for n, old in enumerate(codes[before]))
    assert sorted(made) == list(range(len(steps)))


@given(CODES, st.data())
def test_components_that_change_by_themselves(codes: list[Code], data: st.DataObject) -> None:
    number = st.sampled_from(range(len(codes)))
    steps = list(data.draw(st.dictionaries(number, number)).items())
    alone = shifting_components(codes, steps)
    for change, places in changes(codes, steps, but=alone):
        assert not change.keys() & alone.keys()
        for before, after in (steps[place] for place in places):
            found = list(codes[before])
            for component, value in change.items():
                found[component] = value
            for component, shifts in alone.items():
                old = codes[before][component]
                found[component] += sum(s for s, numbers in shifts.items() if old in numbers)
            assert tuple(found) == codes[after]


def check(automaton: Automaton, found: tuple[Joint, ...]) -> None:
    """Check that each move is made once, by something that is of one deed."""
    moves = [move for joint in found for move in joint.moves]
    assert sorted(map(repr, moves)) == sorted(map(repr, automaton.moves))
    assert len(found) < len(automaton.moves) / 4
    for joint in found:
        assert len(set(map(automaton.signature, joint.moves))) == 1


@pytest.mark.cc
def test_options_of_promela(supervisor: Network) -> None:
    (automaton,) = supervisor.automata
    check(automaton, joint_moves(automaton, Parts(supervisor).codes[0]))


@pytest.mark.cc
def test_edges_of_jani(supervisor: Network) -> None:
    """From each local state there are as many steps as moves, with their names."""
    (automaton,) = supervisor.automata
    found = joint_moves(automaton, Parts(supervisor).codes[0], named=True)
    check(automaton, found)
    for edge in found:
        assert len(edge.sources) == len(edge.moves)
        assert len({move.label for move in edge.moves}) == 1


@pytest.mark.cc
def test_storm_has_each_state_and_each_step(supervisor: Network) -> None:
    need(has_storm(), "stormpy")
    import stormpy

    model, _ = stormpy.parse_jani_model_from_string(json.dumps(model_of(supervisor)))
    built = stormpy.build_model(model)
    assert (built.nr_states, built.nr_transitions) == (supervisor.states, supervisor.transitions)


RACES = """
chart: Races
events: {in: [on]}
initial: idle
states:
  idle: {on: {on: {target: busy}}}
  busy:
    after: {1s: {if: false, target: idle}, 2s: {if: false, target: idle}, 3s: {target: idle}}
    on: {on: {target: busy, type: internal}}
"""


@pytest.mark.cc
def test_timers_of_one_state_are_told_apart(load: Load) -> None:
    """Each of its three timeouts is another component."""
    for untimed in (False, True):
        network = network_of(load(races=RACES), ExportOptions(untimed=untimed))
        parts = Parts(network)
        assert len(set(parts.codes[0])) == len(network.automata[0].locals)
        timers = [c for c in parts.components[0] if c.name == "timeout of busy"]
        assert len(timers) == 3
