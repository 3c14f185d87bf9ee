"""What cannot leave its range by its guards never does, whatever the variables hold."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from fsmkit.chart.analysis.leaving_ranges import facts_in_content, leaving
from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load_with_findings
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.testing.harness.harness import INTERPRETER

GUARDS = (
    *("true", "n < 8", "n <= 7", "n > 0", "n != 8", "n == 8", "not (n >= 8)", "8 > n"),
    *("n < 8 and m > 0", "n < 8 or m < 2", "n + m < 9", "n < m", "not (n > 2 or m == 0)"),
)
CONTENTS = (
    *("n += 1", "n -= 1", "n = n + m", "n = m; n += 1", "m += 1; n += 1", "n += 1; n += 1"),
    *("if n < 8 { n += 1 }", "if n >= 8 { m = 0 } else { n += 1 }", "n += 1 if n < 8 else 0"),
    *("n -= 1 if n > 0 else 0", "n += (2 if m > 3 else 1) if n < 7 else 0", "n = n * m"),
    *("if n < 8 { m = 3; n += 1; n -= 1 }", "for i in 0..2 { n += 1 }", "n = min(n + 1, 8)"),
    *("if n < 7 { for i in 0..1 { n += 1 } }", "n = 8 - n", "n = n - m if n >= m else m - n"),
    *("if n < 8 { if m < 8 { n += 1; m += 1 } }", "n = abs(n - m)", "n = (n + m) / 2"),
)


def chart_of(folder: Path, states: str) -> Chart:
    path = folder / "chart.yaml"
    events = ", ".join(f"e{place}" for place in range(len(GUARDS) * len(CONTENTS)))
    path.write_text(
        "chart: Ranges\ndata: {n: 0..8 = 0, m: 0..8 = 0}\n"
        f'events: {{in: [{events}, "put(n 0..8, m 0..8)"]}}\n{states}'
    )
    return load_with_findings(path, Findings())


@pytest.mark.slow
def test_what_cannot_leave_never_does(tmp_path: Path) -> None:
    pairs = list(product(GUARDS, CONTENTS))
    listed = "".join(
        f"      e{place}: {{if: {guard!r}, do: {content!r}}}\n"
        for place, (guard, content) in enumerate(pairs)
    )
    chart = chart_of(
        tmp_path,
        f"states:\n  a:\n    on:\n{listed}      put: {{do: n = event.n; m = event.m}}\n"
        "      error.range: {}\n",
    )
    told = {
        t.events[0]
        for t in chart.transitions
        if list(leaving(chart, t.content, facts_in_content(chart, t)))
    }
    left = set()
    for place in range(len(pairs)):
        event = chart.event_index[f"e{place}"]
        script = ["start 0"]
        for n, m in product((0, 1, 2, 6, 7, 8), (0, 1, 3, 8)):
            script += [f"post put {n} {m}", f"post e{place}", "run 1"]
        if any("error.range" in line for line in INTERPRETER.run(chart, script)):
            left.add(event)
    assert left <= told
    assert len(told - left) < len(pairs) // 6, [
        pairs[int(chart.events[e].name[1:])] for e in told - left
    ]


@pytest.mark.parametrize(
    ("states", "is_told"),
    [
        ("a: {on: {e0: {if: n < 8, do: n += 1}}}", False),
        ("a: {on: {e0: {if: n < 8, target: b, do: n += 1}}}\n  b: {}", False),
        ("a: {on: {e0: {if: n < 8, target: b, do: n += 1}}, exit: n = 8}\n  b: {}", True),
        ("a: {on: {e0: {if: n < 8, do: n += 1}}, exit: m = 8}", False),
        (("a: {regions: {p: {states: {x: {on: {e0: {do: n = 8}}}}}, "
         "q: {states: {y: {on: {e0: {if: n < 8, do: n += 1}}}}}}}"), True),
        (("a: {regions: {p: {states: {x: {on: {e0: {do: m = 8}}}}}, "
         "q: {states: {y: {on: {e0: {if: n < 8, do: n += 1}}}}}}}"), False),
        ("a: {entry: n += 1}", True),
    ],
)  # fmt: skip
def test_a_guard_counts_as_long_as_it_holds(states: str, is_told: bool, tmp_path: Path) -> None:
    chart = chart_of(tmp_path, f"states:\n  {states}\n")
    found = [
        *(
            f
            for t in chart.transitions
            for f in leaving(chart, t.content, facts_in_content(chart, t))
        ),
        *(f for s in chart.states for block in s.on_entry for f in leaving(chart, block, ())),
    ]
    assert bool(found) is is_told


@pytest.mark.parametrize("machine", ["feeder_belt", "sorter"])
def test_machines_that_count_are_written_for_the_library(machine: str, tmp_path: Path) -> None:
    chart = Path(__file__).parents[3] / "machines" / "production_cell" / f"{machine}.yaml"
    argv = ["compile", str(chart), "--target", "transitions", "--out", str(tmp_path), "--quiet"]
    assert execute(argv) == 0
    assert list(tmp_path.glob("*.py"))
