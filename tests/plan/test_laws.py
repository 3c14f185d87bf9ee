"""Laws of the Plan, on random charts: it says in numbers what the tree says."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import combinations
from pathlib import Path

import pytest

from devtools.differential import random_case
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.chart.structure import is_internal, lcca
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan import Branch, Enter, Op, Plan, Restore, lower
from tests.parameters import sampled


@cache
def random_plan(number: int) -> Plan:
    return lower(random_case(23, number).chart)


@pytest.fixture(params=sampled(range(60), every=4))
def plan(request: pytest.FixtureRequest) -> Plan:
    return random_plan(request.param)


def real(chart: Chart) -> list[int]:
    return [s.index for s in chart.states if s.index and not s.is_history]


def test_regions_part_the_states(plan: Plan) -> None:
    members = [state for region in plan.regions for state in region.states]
    assert sorted(members) == real(plan.chart)
    for region in plan.regions:
        assert {plan.region_of[s] for s in region.states} <= {region.index}


def test_a_region_is_the_root_or_a_child_of_a_parallel_state(plan: Plan) -> None:
    states = plan.chart.states
    owned = {
        child
        for state in states
        if state.kind is Kind.PARALLEL
        for child in state.children
        if not states[child].is_history
    }
    assert {r.top for r in plan.regions} == owned | {0}
    assert all(r.owner == states[r.top].parent for r in plan.regions)


def test_numbers_tell_descent(plan: Plan) -> None:
    chart = plan.chart
    for a, b in combinations(real(chart), 2):
        if plan.region_of[a] == plan.region_of[b]:
            inside = a <= b <= plan.last_below[a]
            assert inside == chart.is_descendant(b, a)


def test_domains_are_those_of_appendix_d(plan: Plan) -> None:
    chart = plan.chart
    for transition in chart.transitions:
        variants = plan.variants[transition.index]
        assert not variants[-1].conditions
        assert all(variant.conditions for variant in variants[:-1])
        if transition.trigger is Trigger.INITIAL:
            continue
        if not transition.targets:
            assert len(variants) == 1
            assert variants[0].domain is None
        elif not any(chart.states[t].is_history for t in transition.targets):
            assert len(variants) == 1
            expected = (
                transition.source
                if is_internal(chart, transition)
                else lcca(chart, (transition.source, *transition.targets))
            )
            assert variants[0].domain == expected


def paths(ops: tuple[Op, ...]) -> list[tuple[list[int], bool]]:
    """Return the entered states of each path through the branches, and whether all are known."""
    found: list[tuple[list[int], bool]] = [([], True)]
    for op in ops:
        match op:
            case Enter(state):
                found = [([*entered, state], known) for entered, known in found]
            case Branch(_, recorded, unrecorded):
                found = [
                    (entered + more, known and also)
                    for entered, known in found
                    for more, also in (*paths(recorded), *paths(unrecorded))
                ]
            case Restore():
                found = [(entered, False) for entered, _ in found]
            case _:
                pass
    return found


def assert_legal(chart: Chart, entered: list[int], domain: int) -> None:
    """Below each active state: one child of a compound state, all regions of a parallel one."""
    assert entered == sorted(set(entered))  # document order, each once
    for state in (domain, *entered):
        children = [c for c in chart.states[state].children if not chart.states[c].is_history]
        active = [c for c in children if c in entered]
        if chart.states[state].kind is Kind.PARALLEL:
            assert active == children
        elif children:
            assert len(active) == 1
        assert state == domain or chart.states[state].parent in (domain, *entered)


def test_what_is_entered_is_a_configuration(plan: Plan) -> None:
    chart = plan.chart
    programs = [(plan.start, 0)]
    for transition in chart.transitions:
        programs += [
            (variant.entry, variant.domain)
            for variant in plan.variants[transition.index]
            if variant.domain is not None
        ]
    for ops, domain in programs:
        for entered, is_known in paths(ops):
            if is_known:
                assert_legal(chart, entered, domain)


def test_random_charts_have_what_is_worth_trying() -> None:
    kinds = {state.kind for plan in map(random_plan, range(60)) for state in plan.chart.states}
    assert kinds >= {Kind.PARALLEL, Kind.SHALLOW_HISTORY, Kind.DEEP_HISTORY, Kind.FINAL}
    assert any(len(each) > 1 for plan in map(random_plan, range(60)) for each in plan.variants)


DEEP = """\
chart: Deep
initial: s
events: {in: [go, back, out]}
states:
  s:
    initial: a
    on: {out: rest}
    states:
      a:
        initial: b
        states:
          b: {on: {back: h, go: c}}
          c: {on: {go: d}}
      d: {on: {go: b}}
      h: {history: deep, default: d}
  rest: {on: {back: h}}
"""


def test_the_domain_can_depend_on_what_was_recorded(tmp_path: Path) -> None:
    path = tmp_path / "deep.yaml"
    path.write_text(DEEP, encoding="utf-8")
    plan = lower(load(path))
    index = plan.chart.state_index
    (from_within,) = [
        plan.variants[t]
        for t in plan.chart.states[index["b"]].transitions
        if plan.chart.transitions[t].targets == (index["h"],)
    ]
    inner, otherwise = from_within[0], from_within[-1]
    assert inner.domain == index["a"]
    (condition,) = inner.conditions
    numbers = range(condition.first, condition.last + 1)
    assert list(numbers) == [index["b"], index["c"]]
    assert otherwise.domain == index["s"]
    (from_outside,) = [plan.variants[t] for t in plan.chart.states[index["rest"]].transitions]
    assert len(from_outside) == 1


def size(ops: tuple[Op, ...]) -> int:
    return sum(
        1 + (size(op.recorded) + size(op.unrecorded) if isinstance(op, Branch) else 0) for op in ops
    )


def states_in_a_row(count: int) -> list[str]:
    lines = ["initial: s0", "states:"]
    for i in range(count):
        lines.append(f"  s{i}:")
        lines.append(f"    initial: s{i}_a")
        lines.append(f"    on: {{go: s{(i + 1) % count}}}")
        lines.append(f"    states: {{s{i}_a: {{}}, s{i}_b: {{}}}}")
    return lines


def regions_side_by_side(count: int) -> list[str]:
    lines = ["initial: all", "states:", "  all:", "    regions:"]
    for i in range(count):
        lines.append(f"      s{i}:")
        lines.append(f"        initial: s{i}_a")
        lines.append(f"        states: {{s{i}_a: {{on: {{go: s{i}_b}}}}, s{i}_b: {{}}}}")
    return lines


@pytest.mark.parametrize("states", [states_in_a_row, regions_side_by_side])
def test_size_grows_with_the_chart(tmp_path: Path, states: Callable[[int], list[str]]) -> None:
    sizes = []
    for count in (40, 80):
        lines = ["chart: Wide", "events: {in: [go]}", *states(count)]
        path = tmp_path / f"{count}.yaml"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        plan = lower(load(path))
        sizes.append(sum(size(v.entry) for variants in plan.variants for v in variants))
    assert sizes[1] <= 2.1 * sizes[0]
