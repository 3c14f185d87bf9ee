"""Charts of thousands of states are explored: by tables, as the oracle explores smaller ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.engines.c.binding import MOST_STRAIGHT, options_for
from fsmkit.verify.explore import ExplorationOptions, check, explore
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.exploration import End
from tests.codegen.c.sized import KINDS
from tests.verify.engines.test_engines import facts

pytestmark = [
    pytest.mark.cc,
    pytest.mark.usefixtures("own_cache", "quickly_compiled"),
]

MANNER = ExplorationOptions("c", time="discrete", memory=1 << 30, timeout=60)


def system_of_text(text: str, folder: Path) -> System:
    path = folder / "chart.scxml"
    path.write_text(text, encoding="utf-8")
    return load_any(path, Findings())


def ring(count: int, trap: int | None = None) -> str:
    """A ring of states, one of which may lead into a state that is never left."""
    lines = ['<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Ring">']
    for place in range(count):
        end = "<transition event='fall' target='end'/>" if place == trap else ""
        to = f"<transition event='go' target='s{(place + 1) % count}'/>"
        lines.append(f"<state id='s{place}'>{to}{end}</state>")
    lines.append("<state id='end'/>" if trap is not None else "")
    return "\n".join([*lines, "</scxml>"])


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize(
    "text",
    [KINDS["flat"](300), KINDS["sparse"](300), KINDS["uneven"](300)],
    ids=["flat", "sparse", "uneven"],
)
def test_tables_find_what_the_oracle_finds(text: str, tmp_path: Path) -> None:
    system = system_of_text(text, tmp_path)
    assert options_for(system.machines[0].chart).is_small
    in_c = explore(system, Findings(), MANNER)
    in_python = explore(system, Findings(), replace(MANNER, engine="python"))
    assert facts(in_c) == facts(in_python)
    assert in_c.end is End.COMPLETE


def test_small_charts_are_explored_as_they_are_shipped(tmp_path: Path) -> None:
    for count in (MOST_STRAIGHT - 1, MOST_STRAIGHT):  # and the root
        (machine,) = system_of_text(ring(count), tmp_path).machines
        assert options_for(machine.chart).is_small == (count == MOST_STRAIGHT)


@pytest.mark.slow
@pytest.mark.cc
def test_three_thousand_states_are_counted_and_a_trap_is_found(tmp_path: Path) -> None:
    report = check(system_of_text(ring(3_000, trap=2_500), tmp_path), Findings(), options=MANNER)
    found = report.exploration
    assert (found.end, found.states, found.transitions) == (End.COMPLETE, 3_001, 3_001)
    assert len(found.traps) == 1
    broken = [result for result in report.results if result.verdict is Verdict.VIOLATED]
    assert [result.name for result in broken] == ["trap"]
    counterexample = broken[0].trace
    assert counterexample is not None
    assert not counterexample.differs
    assert "generated C" in counterexample.replayed
