"""Machines of 1 to 65,535 states do in C as the interpreter does: tables and straight code."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from fsmkit.chart.chart import Chart
from fsmkit.chart.loading import load
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.runtime.script import run_script
from fsmkit.testing.harness import c as c_harness
from tests.codegen.c.conftest import SANITIZERS, WARNINGS
from tests.codegen.c.sized import KINDS, flat, script
from tests.needs import where

LARGE = where(os.environ.get("FSMKIT_SIZES"), "long: make sizes")
BORDERS = (1, 84, 255, 256, 257, 86, 300)
"""Each other one is built by gcc, those between by clang."""

Run = Callable[[str, int], tuple[Chart, list[str]]]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a function for a chart of a kind and a size, and its expected trace."""
    known: dict[tuple[str, int], tuple[Chart, list[str]]] = {}

    def chart_and_trace(kind: str, count: int) -> tuple[Chart, list[str]]:
        if (kind, count) not in known:
            path = tmp_path_factory.mktemp("chart") / f"{kind}.scxml"
            path.write_text(KINDS[kind](count), encoding="utf-8")
            chart = load(path)
            known[kind, count] = chart, run_script(chart, script(chart))
        return known[kind, count]

    return chart_and_trace


def traced(folder: Path, chart: Chart, command: Sequence[str]) -> list[str]:
    """Build the program in a folder; return the trace of the chart's script."""
    built(folder, [*command, "-std=c99", "-w", "main.c", "-o", "harness"])
    (trace,) = c_harness._run(folder, [script(chart)])
    return trace


def written(folder: Path, chart: Chart, *, is_small: bool) -> None:
    options = Options(extras=frozenset({"save"}), is_small=is_small)
    c_harness._write(folder, [generate_machine(chart, "x0", options)])


def built(folder: Path, command: Sequence[str]) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr[:2000]) == (0, "")


@pytest.mark.external
@pytest.mark.parametrize(("compiler", "counts"), [("gcc", BORDERS[::2]), ("clang", BORDERS[1::2])])
@pytest.mark.parametrize("kind", KINDS)
def test_tables_are_right_at_every_border(
    kind: str,
    compiler: str,
    counts: Sequence[int],
    tmp_path: Path,
    require_tool: Callable[[str], str],
    expected: Run,
) -> None:
    """All sizes of a kind are built in one run of a compiler."""
    charts = {count: expected(kind, count)[0] for count in counts}
    options = Options(extras=frozenset({"save"}), is_small=True)
    machines = [generate_machine(c, f"x{i}", options) for i, c in enumerate(charts.values())]
    c_harness._write(tmp_path, machines)
    flags = ["-O0", *SANITIZERS, "-std=c99", "-w"]
    built(tmp_path, [require_tool(compiler), *flags, "main.c", "-o", "harness"])
    traces = c_harness._run(tmp_path, [script(chart) for chart in charts.values()])
    for count, trace in zip(counts, traces, strict=True):
        assert trace == expected(kind, count)[1], count
    files = [f"{machine.names.prefix}.c" for machine in machines]
    for name in ("gcc", "clang"):
        built(tmp_path, [require_tool(name), "-std=c99", *WARNINGS, "-fsyntax-only", *files])


@pytest.mark.external
@pytest.mark.parametrize("kind", KINDS)
def test_straight_code_is_right_above_a_byte(
    kind: str, tmp_path: Path, require_tool: Callable[[str], str], expected: Run
) -> None:
    chart, trace = expected(kind, 300)
    written(tmp_path, chart, is_small=False)
    assert traced(tmp_path, chart, [require_tool("clang"), "-O0", *SANITIZERS]) == trace
    built(tmp_path, [require_tool("gcc"), "-std=c99", *WARNINGS, "-fsyntax-only", "x0.c"])


@LARGE
@pytest.mark.parametrize("form", ["size", "default"])
@pytest.mark.parametrize("kind", KINDS)
def test_large_machines_are_right(
    kind: str, form: str, tmp_path: Path, require_tool: Callable[[str], str], expected: Run
) -> None:
    chart, trace = expected(kind, 3_000)
    written(tmp_path, chart, is_small=form == "size")
    for compiler in ("gcc", "clang"):
        assert traced(tmp_path, chart, [require_tool(compiler), "-O0", *SANITIZERS]) == trace


@LARGE
@pytest.mark.parametrize(
    ("count", "form", "level"), [(10_000, "default", "-O1"), (65_535, "size", "-O0")]
)
@pytest.mark.parametrize("kind", ["flat", "parallel"])
def test_largest_machines_are_right(
    kind: str,
    count: int,
    form: str,
    level: str,
    tmp_path: Path,
    require_tool: Callable[[str], str],
    expected: Run,
) -> None:
    """Without sanitizers: with them, gcc did not end in 15 minutes for 65,535 states."""
    chart, trace = expected(kind, count)
    written(tmp_path, chart, is_small=form == "size")
    for compiler in ("gcc", "clang"):
        assert traced(tmp_path, chart, [require_tool(compiler), level]) == trace


COUNTING = """
import cProfile, sys
from fsmkit.codegen.c.generate import generate_machine
from fsmkit.codegen.c.options import Options
from fsmkit.chart.loading import load
chart = load(sys.argv[1])
for options in (Options(), Options(is_small=True)):
    profile = cProfile.Profile()
    profile.runcall(generate_machine, chart, "x0", options)
    print(sum(entry.callcount for entry in profile.getstats()))
"""


@pytest.mark.slow
@pytest.mark.cc
def test_calls_grow_with_the_states(tmp_path: Path) -> None:
    """Four times the states take at most five times the calls, in each form.

    Counted in a process of its own: in that of the tests CPython 3.11 was seen to loop for ever at
    the beginning of a profiled function, in `eval_frame_handle_pending`.
    """

    def calls(count: int) -> list[int]:
        path = tmp_path / f"flat{count}.scxml"
        path.write_text(flat(count), encoding="utf-8")
        command = [sys.executable, "-c", COUNTING, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
        return [int(line) for line in done.stdout.split()]

    for form, few, many in zip(("default", "size"), calls(50), calls(200), strict=True):
        assert many <= 5 * few, form
