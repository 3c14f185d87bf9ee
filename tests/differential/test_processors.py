"""Generated C does the same on processors of 32 bits and of either byte order, as do snapshots.

The long run is ``python -m devtools.differential --saved --targets c-powerpc,c-size-arm``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from devtools import snapshots
from devtools.differential import Case, compare_all, random_case, traces_of
from devtools.processors import CROSS, PROCESSORS
from devtools.random_charts.choices import SeededChoices
from devtools.random_charts.scripts import random_script
from fsmkit.chart.loading import load
from fsmkit.testing.harness.harness import INTERPRETER

pytestmark = [pytest.mark.slow, pytest.mark.external]

RequireTool = Callable[[str], str]
CELL = Path(__file__).parents[2] / "machines/production_cell"
SEED, RANDOM = 2031, 6


def require(name: str, require_tool: RequireTool) -> None:
    """Skip the test where the tools of a processor are missing."""
    processor = PROCESSORS[name.rpartition("-")[2]]
    for tool in (processor.compiler[0], processor.emulator[0]):
        require_tool(tool)


@pytest.mark.parametrize("name", CROSS)
def test_traces_and_snapshots_are_those_of_the_interpreter(
    name: str, require_tool: RequireTool
) -> None:
    require(name, require_tool)
    cases = [random_case(SEED, number, is_saved=True) for number in range(RANDOM)]
    for part in ("feeder", "molder"):
        chart = load(CELL / f"{part}.yaml")
        script = random_script(SeededChoices(part), chart, 200, is_saved=True)
        cases.append(Case((), chart, script, part))
    totals = compare_all(cases, [CROSS[name]])
    assert (totals.divergences, totals.rejected) == ([], 0)
    saved = [line for case in cases for line in INTERPRETER.run(case.chart, case.script)]
    assert sum(line.startswith("saved ") for line in saved) > len(cases)


def test_damaged_snapshots_are_rejected_alike_in_the_other_byte_order(
    require_tool: RequireTool,
) -> None:
    require("c-powerpc", require_tool)
    totals = snapshots.run_chart(0, 3, 40, ["c-powerpc"])
    assert totals.divergences == 0
    assert totals.accepted < totals.tried


BYTES = """
chart: Bytes
data: {n: uint32 = 0, f: float64 = 0.1, g: float32 = 0.1, wide: int64 = -5}
events: {in: ["add(n uint32, f float64, wide int64)"]}
states:
  a: {on: {add: {do: "n += event.n; f = f * 3.0 + event.f; g = f; wide += event.wide"}}}
"""


@pytest.mark.parametrize("name", CROSS)
def test_wide_values_and_fractions(name: str, tmp_path: Path, require_tool: RequireTool) -> None:
    require(name, require_tool)
    path = tmp_path / "bytes.yaml"
    path.write_text(BYTES, encoding="utf-8")
    adds = [f"post add {7**n % 2**32} {10.0**-n} {-(3**n)}" for n in range(30)]
    lines = [line for add in adds for line in (add, "run 0", "dump")]
    case = Case((), load(path), ("start 0", *lines, "save", "restore 0", "dump"))
    assert traces_of(CROSS[name], [case]) == [list(INTERPRETER.run(case.chart, case.script))]
