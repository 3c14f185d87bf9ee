"""A failing example becomes small, and what is shown of it says everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from devtools.differential import compare, explain, first_difference, random_case, reduce_case
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.document.document import Kind
from fsmkit.testing.harness.harness import INTERPRETER


@dataclass
class Deaf:
    """A runtime that loses the internal events it raises."""

    name: str = "deaf"

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        told = INTERPRETER.run(chart, script)
        return [line for line in told if not line.startswith("raise")]


def test_a_divergence_is_reduced_to_its_cause() -> None:
    case = next(case for n in range(100) if compare(case := random_case(1, n), Deaf()))
    small, divergence = reduce_case(case, Deaf())
    assert divergence is not None
    assert divergence.expected.startswith("raise")
    states = [state for state in small.chart.states[1:] if state.kind is not Kind.FINAL]
    assert len(states) <= 3
    assert len(small.script) <= 4
    assert "Raise" in repr(small.documents)
    text = explain(small, divergence)
    for part in ("chart: Random", "--- script", "start", "deaf:", "interpreter: raise"):
        assert part in text


class Choosy(Deaf):
    """Refuses charts without the content that it gets wrong."""

    def run(self, chart: Chart, script: Sequence[str]) -> list[str]:
        told = super().run(chart, script)
        if told == INTERPRETER.run(chart, script):
            raise fail("c-limit", "on purpose")
        return told


def test_a_chart_that_is_refused_is_not_what_a_divergence_is_reduced_to() -> None:
    case = next(case for n in range(100) if compare(case := random_case(1, n), Deaf()))
    _, divergence = reduce_case(case, Choosy(), 300)
    assert divergence is not None
    assert divergence.expected.startswith("raise")


def test_traces_of_different_length_differ_at_the_end_of_the_shorter() -> None:
    found = first_difference("c", ["a", "b"], ["a"])
    assert found is not None
    assert (found.line, found.expected, found.got, found.before) == (1, "b", "(the end)", ("a",))
    assert first_difference("c", ["a"], ["a"]) is None
