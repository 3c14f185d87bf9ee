"""Clocks that jump forward, go back and wrap around: every target does what the interpreter does.

Delays of random charts are stretched to the longest there is, and the clock jumps by as much as
the reference allows. ``FSMKIT_CLOCKS`` is the number of random charts, 8 by default.
"""

from __future__ import annotations

import os
import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from devtools.differential import (
    Case,
    compare_all,
    elaborated,
    explain,
    reduce_case,
    target_names,
)
from devtools.random_charts.charts import random_document
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from devtools.runtimes import harness, harnesses
from fsmkit.chart.loading import load
from fsmkit.diagnostics import Findings, FsmkitError, Source
from fsmkit.language import CLOCK_MARGIN, LONGEST_DURATION
from fsmkit.language.units import read_microseconds
from fsmkit.testing.harness.harness import INTERPRETER, Harness
from fsmkit.yaml.reader import read_document
from fsmkit.yaml.writer import write_document

CHARTS = int(os.environ.get("FSMKIT_CLOCKS", "8"))
DURATION = re.compile(r"\b\d+m?s\b")
LONGEST_DRAWN = 20
"""Milliseconds of a long delay of a random chart."""
MANY = (
    *(CLOCK_MARGIN, CLOCK_MARGIN, CLOCK_MARGIN, CLOCK_MARGIN - 1, CLOCK_MARGIN // 3, 0, 1, 5),
    *(-1, -5, -CLOCK_MARGIN // 3, -CLOCK_MARGIN),
)
FEW = (0, 1, 2, 5, 10, 50, -1, -2, -5, -10, -50, -CLOCK_MARGIN)
"""Charts of short delays fire too many timers in a long jump forward."""
SOLO = """
chart: Solo
events: {{in: [a]}}
data: {{n: 0..1000000 wrap = 0}}
initial: waiting
states:
  waiting: {{after: {{{0}ms: late}}, on: {{a: both}}}}
  late: {{}}
  both:
    regions:
      l: {{initial: l0, states: {{l0: {{after: {{{0}ms: l1}}}}, l1: {{}}}}}}
      r: {{initial: r0, states: {{r0: {{on: {{a: r1}}}}, r1: {{every: {{10ms: {{do: n += 1}}}}}}}}}}
"""


def stretched(text: str) -> str:
    """Return the text of a chart, its delays so much longer that the longest is the limit."""

    def longer(found: re.Match[str]) -> str:
        ticks = read_microseconds(found[0]) // 1000 * (LONGEST_DURATION // LONGEST_DRAWN)
        return f"{min(ticks, LONGEST_DURATION)}ms"

    return DURATION.sub(longer, text)


@cache
def cases(*, is_stretched: bool, is_saved: bool = False) -> tuple[Case, ...]:
    """Return random charts whose timers fire, with scripts whose clock jumps."""
    found: list[Case] = []
    number = 0
    while len(found) < CHARTS:
        number += 1
        choices = SeededChoices(f"clocks:{number}")
        document = random_document(choices, has_functions=number % 3 == 0)
        text = write_document(document)
        if is_stretched:
            read = read_document(Source("chart.yaml", stretched(text)), Findings())
            assert read is not None
            document = read
        chart = elaborated((document,))
        jumps = MANY if is_stretched else FEW
        script = random_script(choices, chart, is_saved=is_saved, jumps=jumps)
        case = Case((document,), chart, script, f"chart {number}")
        if sum("> timeout" in line for line in trace_of(case)) > 1:
            found.append(case)
    return tuple(found)


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("is_stretched", [True, False])
@pytest.mark.parametrize("target", target_names())
def test_a_clock_that_jumps(target: str, *, is_stretched: bool) -> None:
    agree(target, cases(is_stretched=is_stretched))


@pytest.mark.slow
@pytest.mark.external
@pytest.mark.parametrize("target", ["c", "javascript", "python"])
def test_a_clock_that_jumps_around_a_save(target: str) -> None:
    agree(target, cases(is_stretched=True, is_saved=True))


def agree(target: str, some: tuple[Case, ...]) -> None:
    totals = compare_all(some, [harness(target)])
    for name, found in totals.divergences[:1]:
        case = next(case for case in some if case.name == name)
        small, less = reduce_case(case, harness(target), 300)
        pytest.fail(explain(small, less or found))
    assert totals.macrosteps > CHARTS


@pytest.mark.slow
def test_the_random_clocks_do_jump() -> None:
    """Guard against scripts that never go back while a long timer is armed."""
    scripts = [case.script for case in cases(is_stretched=True)]
    readings = [[int(x.split()[1]) for x in s if x.startswith("run")] for s in scripts]
    passed = [(b - a) % 2**32 for one in readings for a, b in pairwise(one)]
    assert sum(ticks >= 2**31 for ticks in passed) > CHARTS
    assert sum(CLOCK_MARGIN - 1 <= ticks < 2**31 for ticks in passed) > CHARTS


def trace_of(case: Case) -> list[str]:
    return INTERPRETER.run(case.chart, case.script)


@pytest.mark.external
@pytest.mark.parametrize("runtime", harnesses(), ids=lambda runtime: runtime.name)
def test_a_timer_of_the_longest_delay_waits_for_its_deadline(
    runtime: Harness, tmp_path: Path
) -> None:
    path = tmp_path / "solo.yaml"
    path.write_text(SOLO.format(LONGEST_DURATION), encoding="utf-8")
    chart = load(path)
    script: list[str] = []
    expected: list[str] = []
    for back in (1, 10, CLOCK_MARGIN):
        turned, due, late = (
            5000 - back,
            5000 + LONGEST_DURATION,
            5000 + LONGEST_DURATION + CLOCK_MARGIN,
        )
        script += ["start 5000", "run 5000", f"run {turned % 2**32}", f"run {due - 1}", "dump"]
        script += [f"run {due}", "dump"]
        expected += ["= waiting", "= late"]
        script += ["start 5000", "post a", "run 5000", "post a", f"run {turned % 2**32}"]
        script += [f"run {(turned + 25) % 2**32}", "dump"]
        expected += ["= l0 r1"]
        # an event arms the longest timer before a timer fires that is late
        script += ["start 5000", "post a", f"run {late}", "post a", f"run {late + 20}", "dump"]
        script += ["start 5000", f"run {late}", "dump"]
        expected += ["= l0 r1", "= late"]
    trace = runtime.run(chart, script)
    assert trace == INTERPRETER.run(chart, script)
    ends = [a for a, b in pairwise(trace) if b.startswith("d n")]
    assert ends == expected


def test_a_longer_delay_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "solo.yaml"
    path.write_text(SOLO.format(LONGEST_DURATION + 1), encoding="utf-8")
    with pytest.raises(FsmkitError) as error:
        load(path)
    found = [d for d in error.value.diagnostics if d.rule.name == "invalid-duration"]
    assert len(found) == 2
    assert f"longer than {LONGEST_DURATION}ms" in found[0].message
