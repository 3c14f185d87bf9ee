"""Limit and time bound a comparison in the middle of a state, whatever one step reads."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import read_chart
from fsmkit.verify.certify import comparison
from fsmkit.verify.certify.certify import options_of
from fsmkit.verify.certify.comparison import Comparison, Request, exploration, packets, reasons
from fsmkit.verify.certify.program import program_of
from fsmkit.verify.certify.steps import MOST_UNREAD

COUNTS = "; ".join(f"if i{number} {{ count += 1 }}" for number in range(24))
HEAD = "chart: Many\ndata: {count: 0..1000 = 0}"
CHARTS = {
    "results": """
operations: ['ready() -> bool']
events: {in: [go]}
states:
  idle: {on: {go: {do: "for n in 0..23 { if ready() { count = 1 } }"}}}
""",
    "results of an endless loop": """
operations: ['ready() -> bool']
states:
  one: {always: [{if: count >= 0, target: two, do: "if ready() { count = 1 }"}]}
  two: {always: [{if: count >= 0, target: one, do: "if ready() { count = 2 }"}]}
""",
    "inputs": f"""
inputs: {{{", ".join(f"i{number}: bool" for number in range(24))}}}
events: {{in: [go]}}
states:
  idle: {{on: {{go: {{do: "count = 0; {COUNTS}"}}}}}}
""",
}


def compared(chart: Chart, request: Request) -> Comparison:
    """Return an exploration, as if each execution were equal."""
    found = exploration(chart, program_of(chart, None, options_of("")), request)
    for _, packet in packets(found, request, saved=100):
        found.taken += sum(step.count for step in packet.steps if step.is_explored)
    return found


@pytest.fixture(params=CHARTS)
def chart(request: pytest.FixtureRequest, tmp_path: Path) -> Chart:
    path = tmp_path / "chart.yaml"
    path.write_text(f"{HEAD}{CHARTS[request.param]}")
    return read_chart(path, Findings())


@pytest.mark.parametrize("limit", [1, 2, 40, 300])
def test_the_limit_holds_within_a_step_of_many_choices(chart: Chart, limit: int) -> None:
    request = Request(limit=limit)
    found = compared(chart, request)
    assert limit <= found.taken < limit + MOST_UNREAD
    assert found.steps.interpreted <= limit + 4
    assert f"the limit of {limit:,} steps is reached" in reasons(found, request)[0]


def test_the_time_holds_within_a_step_of_many_choices(chart: Chart) -> None:
    request = Request(timeout=1e-9)
    found = compared(chart, request)
    assert found.taken == 0
    assert reasons(found, request)[0].startswith("the time of 1e-09 s is over, 1 of 1 states")


def test_a_step_with_too_many_choices_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison, "MOST_CHOICES", 8)
    path = tmp_path / "chart.yaml"
    path.write_text(f"{HEAD}{CHARTS['results']}")
    request = Request()
    found = compared(read_chart(path, Findings()), request)
    assert (found.stopped, found.explored) == ("", len(found.states))
    assert reasons(found, request) == [
        "one step reads more than 8 combinations of inputs and results: `dispatch go`, `post go`"
    ]
