"""The targets of `make fuzz` begin with what the project has, which none of them refuses."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import pytest

from devtools.fuzz.seeds import charts, strings_of_tests
from devtools.fuzz.through import FOLDER, through
from fsmkit.document.front_ends import FrontEnd
from fsmkit.plugins import plugin

pytestmark = pytest.mark.slow
HEAD = "chart: T\ninputs: {at_far: bool}\noperations: ['goto(position 0..4000)']\ninitial: a\n"
EVERY = 25
"""Of the seeds one in so many is tried."""


def seeds(suffix: str) -> Iterator[str]:
    yield from charts(suffix)
    yield from (text for text in strings_of_tests("chart") if "use: axis.yaml" in text)


@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_seeds_end_as_charts_or_with_findings(notation: str) -> None:
    tried = list(islice(seeds(f".{notation}"), 0, None, EVERY))
    assert len(tried) > 5
    for text in tried:
        through(text.encode(errors="replace"), f"fuzz.{notation}", plugin(FrontEnd, notation))


def test_a_state_of_a_fuzzed_chart_can_be_filled() -> None:
    text = f"{HEAD}states: {{a: {{use: axis.yaml, exits: {{there: a, jammed: a}}}}}}\n"
    assert (FOLDER / "axis.yaml").is_file()
    through(text.encode(), "fuzz.yaml", plugin(FrontEnd, "yaml"))
