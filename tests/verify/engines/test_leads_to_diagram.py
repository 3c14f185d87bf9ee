"""`leads_to` on a decision diagram: the verdicts of the explicit search, and runs that are fair."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.system import System
from fsmkit.system.system_file import load_system
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.c.symbolic_search import why_unknown
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import MANY_COMBINATIONS, NO_RUN, Verdict, conclude
from fsmkit.verify.statespace.closed_system import UNLIMITED, close
from fsmkit.verify.statespace.exploration import End
from fsmkit.verify.statespace.symbolic_search import Search
from tests.machines.test_philosophers import sized
from tests.verify.random_systems import KINDS, load_files, with_leads_to
from tests.verify.runs import FairRun

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]

MEMORY = 1 << 28


def compared(system: System, *, untimed: bool, max_pending: int = 1) -> tuple[int, int, int]:
    """Return how many answers were compared, how many are violations, and how many of cycles."""
    closed = close(system, untimed=untimed, max_pending=max_pending)
    compared = violated = round_ = 0
    with closing(CEngine(closed, Findings())) as built:
        explicit = built.explore(MEMORY, 0, None)
        assert explicit.end is End.COMPLETE  # else the system is too large to be compared
        for slots in (False, True):
            found = built.explore(MEMORY, 0, None, search=Search.SYMBOLIC, slots=slots)
            assert (found.states, found.transitions) == (explicit.states, explicit.transitions)
            for ours, theirs in zip(found.temporal, explicit.temporal, strict=True):
                assert ours.known
                assert ours.violated == theirs.violated
                assert bool(ours.path) == ours.violated
                compared += 1
                violated += ours.violated
                round_ += bool(ours.cycle)
                if ours.violated:
                    FairRun(closed, ours, built.trail(ours.path + ours.cycle)).check()
    return compared, violated, round_


@pytest.mark.parametrize(
    ("kind", "seed"),
    [("system", 1), ("system", 4), ("deferring", 5), ("deferring", 8), ("open", 2), ("open", 7)],
)
def test_random_systems_have_the_same_verdicts_and_fair_runs(kind: str, seed: int) -> None:
    files = with_leads_to(KINDS[kind](seed), seed)
    max_pending = (1, UNLIMITED, 2)[seed % 3]
    compared(load_files(files), untimed=seed % 2 == 0, max_pending=max_pending)


FED = """
  E: {leads_to: ["phil[0].In(eating)", "phil[0].In(thinking)"]}
  W: {leads_to: ["phil[0].In(holding)", "phil[0].In(eating)"]}
"""


def test_a_philosopher_may_wait_for_ever_at_a_table_of_thirty_two(tmp_path: Path) -> None:
    path = sized("ordered_table.yaml", 32, tmp_path)
    table = path.read_text().partition("properties:")[0]
    path.write_text(f"{table}environment: {{will: ['phil[i]']}}\nproperties:{FED}")
    system = load_system(path, Findings())
    options = ExplorationOptions("c", time="untimed", search=Search.SYMBOLIC)
    report = check(system, Findings(), options=options)
    found = {one.name: one for one in report.results}
    # the ways to hold forks, counted fork by fork, times 2 ** 32 for the parities of meals
    assert report.exploration.states == 114_636_797_429_496_953_310_281_728
    assert found["E"].verdict is Verdict.HOLDS
    assert found["W"].verdict is Verdict.VIOLATED
    trace = found["W"].trace
    assert trace is not None
    assert trace.replayed == ("interpreter", "generated C")
    assert trace.loop is not None
    round_ = {step.machine for step in trace.steps[trace.loop :]}
    assert "phil[0]" not in round_
    assert "phil[1]" in round_  # it has the fork that is waited for, again and again
    (answer,) = [one for one in report.exploration.temporal if one.violated]
    FairRun(report.closed, answer, trace.trail).check()

    # what is violated by no run that is shown is not said to be
    lost = replace(
        report.exploration,
        temporal=tuple(replace(one, path=(), cycle=()) for one in report.exploration.temporal),
    )
    again = conclude(report.closed, lost, lambda *_: None, frozenset({"W"}), Findings())
    (waits,) = [one for one in again.results if one.name == "W"]
    assert (waits.verdict, waits.reason) == (Verdict.UNDECIDED, NO_RUN)


def test_why_an_answer_is_not_known() -> None:
    assert why_unknown({"unknown": "time"}) == "the time limit was reached"
    assert why_unknown({"unknown": "combinations"}) == MANY_COMBINATIONS
    assert why_unknown({}) == ""
