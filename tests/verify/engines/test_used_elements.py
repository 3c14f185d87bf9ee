"""Arrays are cut in the C to the elements that a machine uses: nobody can tell it."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.runtime.interpreter.macrostep import initial
from fsmkit.system.system import System
from fsmkit.verify.engines.c import engine
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.c.local_states import local_states
from fsmkit.verify.engines.c.used_elements import Cut, cut_arrays
from fsmkit.verify.engines.python.oracle import explore_in_python
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import Exploration
from fsmkit.verify.statespace.spread import UNKNOWN
from fsmkit.verify.statespace.symbolic_search import Search
from tests.verify.random_systems import load_files, random_system

pytestmark = [pytest.mark.usefixtures("own_cache", "quickly_compiled")]

SYSTEM = """
system: Table
machines:
  "m[i in 0..2]": {chart: many.yaml, with: {LEFT: i + 1, RIGHT: (i + 1) % 3 + 1}}
  one: one.yaml
shared: {forks: "0..3[6] = [0, 1, 0, 1, 0, 0]"}
properties:
  p: {invariant: "forks[2] != 3"}
  q: {invariant: "one.own[1] == 0 and count(k in 0..1: one.own[k] == 3) < 2"}
"""
MANY = """
chart: Many
constants: {LEFT: 0, RIGHT: 1}
data: {forks: "0..3[6] = [0, 1, 0, 1, 0, 0]", seen: 0..3 = 0}
initial: a
states:
  a:
    rest: true
    sometimes: {if: "forks[LEFT] < 3", do: "forks[LEFT] += 1; seen = forks[RIGHT]"}
"""
ONE = """
chart: One
data: {forks: "0..3[6] = [0, 1, 0, 1, 0, 0]", own: "0..3[4]", whole: "bool[3]", by: 0..2 = 0}
initial: a
states:
  a:
    rest: true
    sometimes:
      - {if: "not whole[by] and forks[5] < 2", do: "forks[5] += 1; whole[by] = true; own[0] = 3"}
      - {if: "forks[5] == 2", do: "forks[3] = 3; by = (by + 1) % 3", target: a}
"""


def uncut(closed: ClosedSystem) -> Cut:
    return Cut(closed, closed, ({},) * len(closed.charts))


def table() -> System:
    return load_files({"system": SYSTEM, "many": MANY, "one": ONE})


def test_what_is_used_by_constants_is_cut_and_nothing_else() -> None:
    cut = cut_arrays(close(table()))
    first, second, third, other = cut.used
    assert (first["forks"], second["forks"], third["forks"]) == ((1, 2), (2, 3), (3, 1))
    assert other == {"forks": (5, 3), "own": (0, 1)}  # `whole` has an index that is a variable
    assert [d.init.value for d in cut.closed.charts[0].data] == [(1, 0), 0]
    whole = initial(cut.whole.charts[3])
    assert cut.cut(3, whole).data[:2] == ((0, 1), (0, 0))
    changed = replace(whole, data=((0, 1, 0, 3, 0, 2), (3, 0, 0, 0), *whole.data[2:]))
    assert cut.restored(3, cut.cut(3, changed)) == changed


def everything(found: Exploration) -> object:
    marks = [(mark.number, mark.count, mark.path) for mark in found.marks]
    machines = [replace(figures, saved=(), spread=UNKNOWN) for figures in found.machines]
    return found.end, found.states, found.transitions, found.depth, marks, machines


def compare(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = close(system)
    assert any(cut_arrays(closed).used)
    found = []
    for how in (cut_arrays, uncut):
        monkeypatch.setattr(engine, "cut_arrays", how)
        monkeypatch.setattr("fsmkit.verify.engines.c.local_states.cut_arrays", how)
        with closing(CEngine(closed, Findings())) as built:
            explicit = built.explore(1 << 28, 0, None, shows_locals=True)
            symbolic = built.explore(1 << 28, 0, None, search=Search.SYMBOLIC)
        machines = range(len(closed.charts))
        own = {m: set(s) for m, s in local_states(closed, explicit, machines).items()}
        found.append((everything(explicit), symbolic.states, own))
    assert found[0] == found[1]
    of_oracle, _ = explore_in_python(closed, traps=False)
    assert found[0][1] == explicit.states == of_oracle.states


@pytest.mark.cc
def test_a_system_has_the_same_states_and_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    compare(table(), monkeypatch)


@pytest.mark.cc
@pytest.mark.parametrize("seed", [3, 5, 11])
def test_random_systems_have_the_same_states_and_paths(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        name: text.replace("b[a]", "b[ME]")
        .replace("bool[3]", "bool[5]")
        .replace("0..2: b", "0..1: b")
        for name, text in random_system(seed).items()
    }
    files["one"] += "  s3: {entry: 'b[1] = b[4]; b[0] = b[1]'}\n"  # holds what properties name
    compare(load_files(files), monkeypatch)


@pytest.mark.cc
def test_counterexamples_show_whole_arrays() -> None:
    report = check(table(), Findings(), options=ExplorationOptions("c"))
    trace = next(result.trace for result in report.results if result.name == "p")
    assert trace is not None
    assert trace.replayed == ("interpreter", "generated C")
    assert trace.steps[-1].deliveries[0].what == "forks[2] = 3"
    state = trace.steps[-1].state
    assert state is not None
    assert state.data[0] == (0, 1, 3, 1, 0, 0)
