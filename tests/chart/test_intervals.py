"""Delays that are intervals: read from both notations, refused where code is to be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.chart import OPEN_ENDED, Chart
from fsmkit.chart.format import format_trigger
from fsmkit.chart.loading import load_with_findings
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.runtime.clock import SimulatedClock
from fsmkit.runtime.session import Session

CHART = """
chart: C
constants: {LONG: 50ms}
initial: a
states:
  a: {after: {DELAY: b}}
  b: {rest: true}
"""


def load(folder: Path, delay: str, key: str = "after") -> Chart:
    file = folder / "c.yaml"
    file.write_text(CHART.replace("DELAY", delay).replace("after", key))
    return load_with_findings(file, Findings())


@pytest.mark.parametrize(
    ("delay", "least", "greatest", "told"),
    [
        ("20ms..LONG", 20, 50, "after 20ms..50ms"),
        ("0ms..1s", 0, 1000, "after 0s..1s"),
        ("LONG..50ms", None, 50, "after 50ms"),
        ("LONG", None, 50, "after 50ms"),
        ("20ms..", 20, 20 + OPEN_ENDED, "after 20ms.."),
    ],
)
def test_bounds_are_read(tmp_path: Path, delay: str, least: int, greatest: int, told: str) -> None:
    chart = load(tmp_path, delay)
    (timed,) = (t for t in chart.transitions if t.delay)
    assert (timed.least, timed.delay) == (least, greatest)
    assert format_trigger(timed, chart) == told


@pytest.mark.parametrize(
    ("delay", "key", "rule"),
    [("50ms..20ms", "after", "bad-delay"), ("20ms..50ms", "every", "bad-delay"),
     ("20ms..", "every", "bad-delay"), ("13d..", "after", "bad-delay"),
     ("20..50ms", "after", None), ("1ms..2ms..3ms", "after", None)],
)  # fmt: skip
def test_bad_bounds_are_told(tmp_path: Path, delay: str, key: str, rule: str | None) -> None:
    with pytest.raises(FsmkitError) as caught:
        load(tmp_path, delay, key)
    assert all(d.primary is not None for d in caught.value.diagnostics)
    if rule is not None:
        assert rule in {d.rule.name for d in caught.value.diagnostics}


@pytest.mark.parametrize("target", ["c", "python", "transitions"])
def test_no_code_is_written(tmp_path: Path, target: str) -> None:
    load(tmp_path, "20ms..50ms")
    arguments = ["compile", str(tmp_path / "c.yaml"), "--target", target]
    assert execute([*arguments, "--out", str(tmp_path / "out")]) == 1
    assert not (tmp_path / "out").exists()


def test_both_notations_have_them(tmp_path: Path) -> None:
    chart = load(tmp_path, "20ms..LONG")
    out = tmp_path / "c.scxml"
    assert execute(["convert", str(tmp_path / "c.yaml"), "--to", "scxml", "--out", str(out)]) == 0
    again = load_with_findings(out, Findings())
    assert again.transitions == chart.transitions


def test_a_session_chooses_by_its_seed(tmp_path: Path) -> None:
    chart = load(tmp_path, "20ms..LONG")

    def left(seed: int) -> int:
        session = Session(chart, clock=SimulatedClock(), seed=seed)
        return session.snapshot.timers[0].deadline

    found = [left(seed) for seed in range(20)]
    assert found == [left(seed) for seed in range(20)]
    assert len(set(found)) > 3
    assert all(20 <= deadline <= 50 for deadline in found)
