"""The counterexample of the Production Cell's mutant M5, from its end to its cause and forth."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.inspector.dap.editor import Editor, Json
from tests.inspector.dap.test_client import run_client

ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines" / "production_cell"
GOLDEN = Path(__file__).with_name("m5.txt")


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Check the cell with a feeder that ignores `mold_ready`; return the saved trace."""
    folder = tmp_path_factory.mktemp("m5")
    replaced = f"feeder={CELL / 'defects' / 'm5_feeder.yaml'}"
    given = ["--property", "P2", "--replace", replaced, "--save-trace", str(folder)]
    assert execute(["check", "-q", str(CELL / "cell.yaml"), *given]) == 1
    (found,) = folder.glob("*.json")
    return found


def transcript(editor: Editor, trace: Path) -> list[str]:
    """Go to the first `mold_ready` and forth again, as `m5.js` does."""
    told: list[str] = []

    def stopped(command: str, event: Json) -> str:
        number = next(t["id"] for t in editor.get("threads")["threads"] if t["name"] == "feeder")
        top = editor.frames(number)[0]
        place = f"{top['name']} {Path(top['source']['path']).name}:{top['line']}"
        what = event.get("text") or event["description"]
        told.append(f"{command}: {event['reason']}: {what}; feeder {place}")
        reason: str = event["reason"]
        return reason

    def go(command: str) -> str:
        does: Callable[[], Json] = editor.run
        return stopped(command, does() if command == "continue" else editor.stop(command))

    stopped("launch", editor.launch(trace, speed=0))
    editor.get("setFunctionBreakpoints", breakpoints=[{"name": "feeder.mold_ready"}])
    while go("reverseContinue") != "step":
        pass
    go("continue")
    while go("next") != "exception":
        pass
    go("stepBack")
    while "mold_ready" not in told[-1]:
        go("stepBack")
    go("stepIn")
    go("continue")
    return told


@pytest.mark.cc
def test_m5_is_stepped_back_to_its_cause_and_forth(trace: Path) -> None:
    told = transcript(Editor(), trace)
    if os.environ.get("FSMKIT_BLESS"):
        GOLDEN.write_text("".join(f"{line}\n" for line in told), encoding="utf-8")
    assert told == GOLDEN.read_text(encoding="utf-8").splitlines()
    assert "P2 is violated" in told[0]
    (first,) = [line for line in told if line.startswith("continue: function breakpoint")]
    assert "feeder: mold_ready, in at_home" in first


@pytest.mark.external
def test_the_client_of_microsoft_sees_the_same(trace: Path, tmp_path: Path) -> None:
    told = run_client("m5.js", tmp_path, str(trace))
    assert told == GOLDEN.read_text(encoding="utf-8").splitlines()


@pytest.mark.cc
def test_a_branch_leaves_the_counterexample(trace: Path) -> None:
    editor = Editor()
    editor.launch(trace)
    editor.type("back 20")
    editor.type("post plant.press_start")
    assert "0: steps" in editor.type("fork")
    assert editor.stop("next")["reason"] in ("step", "exception")
    editor.type("fork 0")
    assert editor.events("stopped")[-1]["reason"] == "exception"
