"""Free inputs of a system: inputs that the environment sets."""

from __future__ import annotations

import re

import pytest

from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.system.system import System
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.report.verdict import Verdict
from fsmkit.verify.statespace.closed_system import close
from fsmkit.verify.statespace.exploration import End
from tests.parameters import sampled
from tests.verify.conftest import Load
from tests.verify.random_systems import load_files, random_system
from tests.verify.systems import DOOR, FREE, GUEST

WILD = """
chart: Wild
inputs: {position: 0..4000, list: "0..3[2]", lit: bool}
outputs: {on: bool = false}
data: {n: 0..4000 = 0}
events: {in: [go]}
initial: a
states: {a: {rest: true, on: {go: {if: "lit and list[0] > 0", do: n = 4000 - position}}}}
"""


def wild(may: str, more: str = "") -> dict[str, str]:
    text = f"system: S\nmachines: {{m: wild.yaml, other: wild.yaml}}\n{more}\n"
    return {"s": f"{text}environment: {may}\n", "wild": WILD}


def test_values_are_those_that_make_a_difference_or_are_named(load: Load) -> None:
    system = load(free=FREE, door=DOOR, guest=GUEST)
    assert [free.values for free in system.free_inputs] == [
        (False, True),
        (-400, 0, 777, 778, 801),
        (0, 2),
    ]
    assert system.sampled == ()


@pytest.mark.parametrize(
    ("values", "expected"),
    [("in {5, 7}", (5, 7)), ("= 3", (3,)), ("in 1..4", (1, 2, 3, 4))],
)
def test_values_that_are_named_need_no_samples(
    load: Load, values: str, expected: tuple[int, ...]
) -> None:
    system = load(**wild(f'{{may: [m.go, "m.position {values}"]}}'))
    assert [free.values for free in system.free_inputs] == [expected]
    assert system.sampled == ()


def test_what_is_computed_with_is_sampled_and_its_place_named(load: Load) -> None:
    system = load(**wild("{may: [m.go, m.position]}"))
    ((what, use),) = system.sampled
    assert what == "the input `m.position`"
    assert use.span is not None
    assert use.span.source.text[use.span.start : use.span.end] == "position"
    report = check(system, Findings(), options=ExplorationOptions("python", time="untimed"))
    assert report.verdict is Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("may", "more", "rule"),
    [
        ("{will: [m.lit]}", "", "input-that-will"),
        ("{may: [m.list]}", "", "connection-mismatch"),
        ("{may: [m.lit]}", "connect: [other.on -> m.lit]", "duplicate-connection"),
        ("{may: [m.lit, m.lit]}", "", "duplicate-connection"),
        ('{may: ["m.nothing in {1}"]}', "", "unknown-name"),
        ('{may: ["m.position in {red}"]}', "", "unknown-name"),
        ('{may: ["m.position in"]}', "", "broken-connection"),
        ('{may: ["m.go in {1}"]}', "", "unknown-name"),
    ],
)
def test_what_cannot_be_free_is_a_finding(load: Load, may: str, more: str, rule: str) -> None:
    with pytest.raises(FsmkitError) as caught:
        load(**wild(may, more))
    assert rule in {found.rule.name for found in caught.value.diagnostics}


def test_an_input_that_nothing_sets_is_reported_with_the_way_out(load: Load) -> None:
    findings = Findings()
    load(findings, **wild("{may: [m.go, m.position, m.lit]}"))
    dry = [found for found in findings if found.rule.name == "unconnected-input"]
    assert ["`list` of `m`" in found.message for found in dry] == [True, False]
    assert dry[0].help is not None
    assert "may: [m.list]" in dry[0].help


@pytest.mark.slow
def test_a_counterexample_replays_with_the_values(load: Load) -> None:
    system = load(free=FREE, door=DOOR, guest=GUEST)
    report = check(system, Findings(), options=ExplorationOptions("python", time="discrete"))
    (odd,) = (result for result in report.results if result.name == "odd")
    assert odd.trace is not None
    assert odd.trace.differs == ""
    set_to = [d.what for step in odd.trace.steps for d in step.deliveries if not d.is_event]
    assert "temp = 777" in set_to


# --- a machine that sets it -----------------------------------------------------------------------

LIGHT = """
chart: Light
events: {in: ["set(v bool)"]}
outputs: {lit: bool = false}
initial: here
states: {here: {rest: true, on: {set: {do: lit = event.v}}}}
"""


def facts(system: System) -> object:
    found = Oracle(close(system, untimed=True)).run()
    assert found.end is End.COMPLETE
    figures = [(m.states, m.transitions) for m in found.machines]
    return found.states, found.transitions, found.livelock is None, figures[:2]


@pytest.mark.parametrize("seed", sampled([0, 5, 1, 3, 4], every=2))
def test_a_free_input_is_a_machine_that_sets_it(seed: int) -> None:
    files = random_system(seed)
    text = files["system"].replace("  - one.lamp -> m[i].lit\n", "")
    may = re.search(r"  may: \[(.*)\]", text)
    assert may is not None
    others = f"{may[1]}, " if may[1] else ""
    free = text.replace(may[0], f"  may: [{others}one.lit]")
    dummy = text.replace(may[0], f"  may: [{others}light.set]")
    dummy = dummy.replace("  one: one.yaml", "  one: one.yaml\n  light: light.yaml")
    dummy = dummy.replace("connect:", "connect:\n  - light.lit -> one.lit")
    found = facts(load_files({**files, "system": free}))
    assert found == facts(load_files({**files, "system": dummy, "light": LIGHT}))
