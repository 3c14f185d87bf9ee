"""Models of the literature in dense time, and the zone search by hand that they stand beside."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.zones import networks
from benchmarks.zones.search import Automaton, Edge, Network, search
from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Report, Verdict

MACHINES = Path(__file__).parents[2] / "machines"


def checked(path: Path, **parameters: str) -> Report:
    system = load_system(path, Findings(), parameters=parameters)
    return check(system, Findings(), options=ExplorationOptions("c"))


def violated(report: Report) -> set[str]:
    assert all(r.verdict in (Verdict.HOLDS, Verdict.VIOLATED) for r in report.results)
    return {r.name for r in report.results if r.verdict is Verdict.VIOLATED}


@pytest.mark.cc
@pytest.mark.parametrize(
    ("folder", "count", "file", "old", "new", "broken"),
    [
        (
            "train_gate",
            2,
            "train.yaml",
            'red[ME]", target: stopped',
            'red[0]", target: stopped',
            {"exclusion"},
        ),
        ("csma_cd", 3, "cable.yaml", "CABLE: 26us", "CABLE: 27us", {"detected"}),
        (
            "csma_cd",
            3,
            "station.yaml",
            "line == Line.silent or",
            "line != Line.collided or",
            {"alone"},
        ),
        ("fddi", 3, "fddi.yaml", "50ms * N - 20ms", "50ms * N - 21ms", {"returns"}),
        ("fddi", 3, "station.yaml", "SYNC: 20ms", "SYNC: 66ms", {"returns"}),
    ],
)
def test_models_of_the_literature_hold_and_mistakes_are_found(
    folder: str, count: int, file: str, old: str, new: str, broken: set[str], tmp_path: Path
) -> None:
    copy = shutil.copytree(MACHINES / folder, tmp_path / folder)
    system = copy / f"{folder}.yaml"
    assert violated(checked(system, N=str(count))) == set()
    text = (copy / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (copy / file).write_text(text.replace(old, new), encoding="utf-8")
    assert broken <= violated(checked(system, N=str(count)))


@pytest.mark.cc
def test_the_search_by_hand_keeps_as_many_zones_as_the_explorer_of_fischers_protocol() -> None:
    found = search(networks.fischer(5))
    explored = checked(MACHINES / "fischer/fischer.yaml", N="5").exploration
    assert found.discrete == explored.states == 727
    assert found.zones == explored.zones == 727


def test_a_zone_is_passed_over_where_a_larger_one_is_known() -> None:
    # A clock that is read below 3 only: what it is beyond makes no difference, so one zone is kept.
    loop = Edge("a", "a", ((1, ">=", 1),))
    ends = Edge("a", "b", ((1, "<=", 3), (1, ">", 2)), (1,))
    found = search(Network((Automaton("a", (loop, ends), {"b": ((1, "<=", 1),)}),), 1))
    assert (found.discrete, found.zones, found.steps) == (2, 2, 2)


def test_no_time_passes_in_a_committed_location_and_only_its_edges_are_taken() -> None:
    hurry = Automaton(
        "x",
        (Edge("x", "y", (), (1,), "go!"), Edge("y", "z", ((1, ">=", 1),))),
        {},
        frozenset({"y"}),
    )
    other = Automaton("p", (Edge("p", "q", channel="go?"), Edge("q", "r")))
    assert search(Network((hurry, other), 1)).discrete == 2  # y needs time, and hides q -> r
    free = Automaton(hurry.initial, hurry.edges)
    assert search(Network((free, other), 1)).discrete == 5
