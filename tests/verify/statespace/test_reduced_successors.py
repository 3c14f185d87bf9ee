"""Local steps that choose inputs when they are read, and sparing ones, are those that try all."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.runtime.interpreter.snapshot import Macrostep, Snapshot
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from fsmkit.verify.statespace.actions import Action, Chooser, Mover, Outcome, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.local_steps import LocalSteps
from fsmkit.verify.statespace.reduced_successors import ReducedSuccessors
from tests.verify.conftest import Load
from tests.verify.engines.test_engines import CELL, OPEN, random_chart
from tests.verify.random_systems import random_system
from tests.verify.systems import SYSTEMS

MOST = 20
"""So many local states of each machine are compared."""


def outcomes(steps: LocalSteps, machine: int, snapshot: Snapshot) -> list[Outcome]:
    """Return all that can happen to a local state of a machine."""
    view = steps.view(machine, snapshot)
    if not view.running:
        return []
    waits = view.waiting > 0
    return steps.own(machine, snapshot, view) + ([] if waits else steps.open(machine, snapshot))


def same(closed: ClosedSystem, most: int = MOST) -> tuple[int, int]:
    """Compare local states breadth first; return how many steps there were, and the runs spared."""
    slow, fast = Complete(closed), Sparing(closed)
    found = 0
    for machine in range(len(closed.charts)):
        first = slow.settled(machine, slow.initial(machine))
        start = Step(Action.START, machine)
        begun = slow.explore(machine, first, start, Mover.INTERNAL)
        assert fast.explore(machine, first, start, Mover.INTERNAL) == begun
        ahead = dict.fromkeys(outcome.after for outcome in begun)
        for snapshot in until(ahead, most):
            theirs, ours = (outcomes(s, machine, snapshot) for s in (slow, fast))
            assert ours == theirs
            found += len(theirs)
            ahead.update(dict.fromkeys(outcome.after for outcome in theirs))
            if closed.unit and not any(outcome.mover is Mover.INTERNAL for outcome in theirs):
                ahead[slow.elapsed(machine, snapshot)] = None
    assert fast.coverage == slow.coverage
    return found, slow.runs - fast.runs


def until(ahead: dict[Snapshot, None], most: int) -> Iterator[Snapshot]:
    """Yield what is in a dictionary that grows."""
    done = 0
    while done < min(len(ahead), most):
        yield list(ahead)[done]
        done += 1


class Counted(LocalSteps):
    """Local steps that count how often the interpreter runs."""

    runs = 0

    def perform(
        self, machine: int, snapshot: Snapshot, what: Step, chooser: Chooser
    ) -> Macrostep | None:
        self.runs += 1
        return super().perform(machine, snapshot, what, chooser)


class Complete(Counted):
    """The same, which chooses all inputs before each step."""

    def chooser(self, machine: int) -> Chooser:
        return Chooser(self.closed.results[machine])


class Sparing(ReducedSuccessors, Counted):
    """The same, sparing."""


@pytest.mark.parametrize("untimed", [False, True], ids=["discrete", "untimed"])
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n == "chooses" else n for n in OPEN]
)
def test_open_charts(load: Load, name: str, untimed: bool) -> None:
    assert same(close(load(**{name: OPEN[name]}), untimed=untimed))[0] > 3


@pytest.mark.parametrize("name", ["feeder", "sorter", "extraction_belt"])
def test_charts_of_the_cell(name: str) -> None:
    found, spared = same(close(load_any(CELL / f"{name}.yaml", Findings()), untimed=True), 3)
    assert found > 0
    assert spared > 100


@pytest.mark.slow
def test_random_charts() -> None:
    """Those that ask nothing of operations: some do so hundreds of times in a step."""
    charts = [chart for chart in map(random_chart, range(40)) if chart is not None]
    closed = [close(system_of(c), untimed=n % 2 == 0) for n, c in enumerate(charts)]
    found = [same(one, 5) for one in closed if not one.results[0]]
    assert sum(steps for steps, _ in found) > 60
    assert sum(runs for _, runs in found) > 50


@pytest.mark.parametrize("name", SYSTEMS)
def test_systems(load: Load, name: str) -> None:
    same(close(load(**SYSTEMS[name])))


@pytest.mark.parametrize("seed", [1, 5, 19])
def test_random_systems(load: Load, seed: int) -> None:
    same(close(load(**random_system(seed)), untimed=seed % 2 == 1))


READERS = {
    "guards": """
chart: Guards
inputs: {a: bool, b: 0..2}
data: {n: 0..2 = 0}
events: {in: [go, back, other], out: ["told(v 0..2)"]}
initial: here
states:
  here: {on: {go: {if: a, target: there, do: n = b}}}
  there: {on: {back: {target: here, do: send told(v = b)}}, entry: "n = a and b > 0 ? 1 : n"}
""",
    "eventless": """
chart: Eventless
inputs: {a: bool}
events: {in: [any, other]}
initial: here
states:
  here: {always: {if: a, target: there}, on: {any: here}}
  there: {on: {any: here}}
""",
    "asked": """
chart: Asked
inputs: {a: bool, b: bool}
events: {in: [any, other]}
initial: here
states: {here: {on: {any: there}}, there: {}}
""",
}


@pytest.mark.parametrize("name", READERS)
def test_what_inputs_do(load: Load, name: str) -> None:
    assert same(close(load(**{name: READERS[name]})))[0] > 0


WATCHED = {
    "watched": """
system: Watched
machines: {one: asked.yaml}
environment: {may: [one.other]}
properties: {heard: {never: occurs(one.other) and one.In(there)}}
""",
    "asked": READERS["asked"],
}


def test_an_event_that_a_property_asks_for_is_a_step(load: Load) -> None:
    closed = close(load(**WATCHED))
    assert same(closed)[0] > 0
    steps = ReducedSuccessors(closed)
    (begun,) = steps.explore(0, steps.initial(0), Step(Action.START), Mover.INTERNAL)
    assert [o.step.action for o in steps.open(0, begun.after)] == [Action.OCCUR]


MANY = """
chart: Many
inputs: {inputs}
events: {{in: [go, stop]}}
initial: here
states:
  here:
    invariant: i3 or not i3
    always: {guards}
    on: {{go: there}}
  there: {{on: {{stop: here}}}}
"""


def test_a_step_is_tried_once_for_each_way_through_its_guards(load: Load) -> None:
    """Of ten inputs the last one is read first; that which a property reads is chosen before."""
    inputs = ", ".join(f"i{n}: bool" for n in range(10))
    guards = ", ".join(f"{{if: i{n}, target: there}}" for n in reversed(range(10)))
    chart = MANY.format(inputs=f"{{{inputs}}}", guards=f"[{guards}]")
    closed = close(load(many=chart))
    assert closed.kept_inputs == {3}
    steps = Counted(closed)
    begun = steps.explore(0, steps.initial(0), Step(Action.START), Mover.INTERNAL)
    assert steps.runs == (9 + 1) + (6 + 1)
    assert [o.step.choices for o in begun] == [(0,) * 10, (*(0,) * 9, 1), (0, 0, 0, 1, *(0,) * 6)]
    assert [len(o.after.configuration) for o in begun] == [2, 2, 2]
