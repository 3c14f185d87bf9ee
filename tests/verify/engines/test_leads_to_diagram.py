"""`leads_to` on a decision diagram: the verdicts of the explicit search, and runs that are fair."""

from __future__ import annotations

from contextlib import closing

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.statespace.closed_system import UNLIMITED, close
from fsmkit.verify.statespace.diagram import Search
from fsmkit.verify.statespace.exploration import End
from tests.verify.random_systems import KINDS, load_files, with_leads_to
from tests.verify.runs import FairRun

pytestmark = [pytest.mark.cc, pytest.mark.usefixtures("own_cache", "quickly_compiled")]

MEMORY = 1 << 28


def compared(system: System, *, untimed: bool, patience: int = 1) -> tuple[int, int, int]:
    """Return how many answers were compared, how many are violations, and how many of cycles."""
    closed = close(system, untimed=untimed, patience=patience)
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
    patience = (1, UNLIMITED, 2)[seed % 3]
    compared(load_files(files), untimed=seed % 2 == 0, patience=patience)
