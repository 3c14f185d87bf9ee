"""Fischer's protocol: mutual exclusion by time, and what happens when nobody waits long enough."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.diagnostics import Findings
from fsmkit.system.system_file import load_system
from fsmkit.verify.explore import ExplorationOptions, check

FOLDER = Path(__file__).parents[2] / "machines/fischer"


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.parametrize("engine", ["python", "c"])
@pytest.mark.parametrize(
    ("file", "wait", "n", "verdict"),
    [("fischer.yaml", None, 2, "holds"), ("fischer.yaml", None, 3, "holds"),
     ("hasty.yaml", None, 2, "violated"), ("hasty.yaml", "2ms", 2, "violated"),
     ("hasty.yaml", "3ms", 2, "holds"), ("hasty.yaml", None, 3, "violated")],
)  # fmt: skip
def test_exclusion_holds_if_all_wait_long_enough(
    file: str, wait: str | None, n: int, verdict: str, engine: str, tmp_path: Path
) -> None:
    text = (FOLDER / file).read_text(encoding="utf-8").replace("N: 2", f"N: {n}")
    text = text.replace("process.yaml", f"{FOLDER}/process.yaml")
    if wait is not None:
        text = text.replace("WAIT: 1ms", f"WAIT: {wait}")
    (tmp_path / file).write_text(text, encoding="utf-8")
    system = load_system(tmp_path / file, Findings())
    report = check(system, Findings(), options=ExplorationOptions(engine, time="discrete"))
    verdicts = {result.name: result.verdict.value for result in report.results}
    assert verdicts == {"exclusion": verdict, "second": "holds", "livelock": "holds", "D": "holds"}
