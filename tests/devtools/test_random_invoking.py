"""Random charts that invoke others: what they are there for does happen in them."""

from __future__ import annotations

from collections import Counter

import pytest

from devtools.differential import elaborated
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.invoking import random_invoking
from devtools.random_charts.scripts import random_script
from fsmkit.runtime.script import run_script

SEEN = {
    "runs": "i0: @",
    "within": "i0: i0: @",
    "to the invoker": "to #_parent",
    "to the invoked": "to #_i",
    "the end": "> event done.invoke.",
    "nobody there": "error error.communication",
}


@pytest.mark.slow
def test_everything_between_two_machines_happens() -> None:
    counted: Counter[str] = Counter()
    for number in range(60):
        choices = SeededChoices(f"inv:{number}")
        chart = elaborated((random_invoking(choices),))
        trace = run_script(chart, random_script(choices, chart))
        counted.update(name for name, part in SEEN.items() if any(part in line for line in trace))
    assert set(counted) == set(SEEN), counted
