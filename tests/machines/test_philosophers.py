"""Dining philosophers: a table that deadlocks, one that does not, and larger ones."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.explore import ExplorationOptions, check

FOLDER = Path(__file__).parents[2] / "machines/philosophers"


def sized(file: str, n: int, folder: Path) -> Path:
    """Return the file of a table for ``n``."""
    text = (
        (FOLDER / file)
        .read_text(encoding="utf-8")
        .replace("philosopher.yaml", f"{FOLDER}/philosopher.yaml")
    )
    text = re.sub(r"% 3|N: 3|bool\[3\]", lambda m: m[0].replace("3", str(n)), text)
    (folder / file).write_text(text.replace("0..2", f"0..{n - 1}"), encoding="utf-8")
    return folder / file


@pytest.mark.cc
@pytest.mark.parametrize("engine", ["python", "c"])
@pytest.mark.parametrize(
    ("file", "n", "verdict", "states"),
    [("table.yaml", 3, "violated", 280), ("ordered_table.yaml", 3, "holds", 192),
     ("table.yaml", 4, "violated", None), ("ordered_table.yaml", 4, "holds", None)],
)  # fmt: skip
def test_only_the_ordered_table_is_free_of_deadlock(
    file: str, n: int, verdict: str, states: int | None, engine: str, tmp_path: Path
) -> None:
    report = check(
        load_system(sized(file, n, tmp_path), Findings()),
        Findings(),
        options=ExplorationOptions(engine, time="discrete"),
    )
    verdicts = {result.name: result.verdict.value for result in report.results}
    assert verdicts == {"apart": "holds", "counted": "holds", "livelock": "holds", "D": verdict}
    assert states in (None, report.exploration.states)
    if verdict == "violated":
        (deadlock,) = (r for r in report.results if r.name == "D")
        assert deadlock.trace is not None
        assert len(deadlock.trace.steps) == 2 * n  # n starts, and n forks taken
