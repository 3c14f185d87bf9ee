"""Which moves share an edge in JANI, and where it leads from each local state."""

from __future__ import annotations

import json
from random import Random

import pytest

from fsmkit.verify.export.deeds import deed
from fsmkit.verify.export.jani.model import model_of
from fsmkit.verify.export.jani.sharing import Run, edges_of, runs_of
from fsmkit.verify.export.network import Network
from tests.verify.export.judges import has_storm


def test_moves_share_an_edge_where_they_do_the_same(supervisor: Network) -> None:
    (automaton,) = supervisor.automata
    found = edges_of(automaton)
    moves = [move for edge in found for move in edge]
    assert sorted(map(repr, moves)) == sorted(map(repr, automaton.moves))
    assert len(found) < len(automaton.moves) / 4
    for edge in found:
        assert len({move.source for move in edge}) == len(edge)
        assert len({(move.label, deed(automaton, move)) for move in edge}) == 1


def test_storm_has_each_state_and_each_step(supervisor: Network) -> None:
    if not has_storm():
        pytest.skip("`stormpy` is not installed (make tools)")
    import stormpy

    model, _ = stormpy.parse_jani_model_from_string(json.dumps(model_of(supervisor)))
    built = stormpy.build_model(model)
    assert (built.nr_states, built.nr_transitions) == (supervisor.states, supervisor.transitions)


def value(runs: list[Run], before: int) -> int:
    """Return where the last run leads that begins no later."""
    run = [run for run in runs if run.first <= before][-1]
    assert before <= run.last
    return before + run.shift if run.shifts else run.after


def test_runs_say_where_each_leads() -> None:
    random = Random(7)
    for _ in range(300):
        befores = random.sample(range(40), random.randrange(1, 30))
        maps = {n: random.choice([n, n + 3, 5, random.randrange(40)]) for n in befores}
        runs = runs_of(maps)
        assert {n: value(runs, n) for n in maps} == maps
        assert len(runs) <= len(maps)


def test_runs_are_few() -> None:
    assert runs_of({1: 4, 2: 5, 7: 10}) == [Run(1, 7, 4, shifts=True)]
    assert runs_of({1: 4, 3: 4, 4: 4}) == [Run(1, 4, 4, shifts=False)]
    assert runs_of({3: 3, 5: 5}) == [Run(3, 5, 3, shifts=True)]
    both = [Run(0, 1, 2, shifts=False), Run(2, 3, 8, shifts=True)]
    assert runs_of({0: 2, 1: 2, 2: 8, 3: 9}) == both
