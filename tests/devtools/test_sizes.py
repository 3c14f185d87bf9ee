"""Everything that is counted agrees at the edges of 8 bits, or is rejected; 16 bits: make sizes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from devtools.sizes import (
    BY_NAME,
    BYTE,
    COUNTED,
    DEPTHS,
    NESTED,
    RUNTIMES,
    WORD,
    Sized,
    is_defect,
    outcomes,
)
from fsmkit.cli import execute
from tests.needs import where

LARGE = where(os.environ.get("FSMKIT_SIZES"), "long: make sizes")
LIMITS = {
    "timers": (255, "too-large"),
    "timed_states": (32_768, "too-large"),
    "states": (65_534, "too-large"),
    "fields": (1_023, "too-large"),
    "record_fields": (1_023, "too-large"),
    "parameters": (1_023, "too-large"),
    "copies": (1_024, "bad-index"),
    "machines": (16_384, "bad-index"),
    "queued": (250, "bad-capacity"),
    "deferred": (250, "bad-capacity"),
    "raised": (250, "bad-capacity"),
    "delayed": (250, "bad-capacity"),
    "microsteps": (65_535, "bad-capacity"),
}
"""The largest size of a counted thing, and the rule that rejects one more."""
FAST = ("timers", "deferred", "microsteps", "events", "transitions")
"""What the suite runs at its limit or at 256; the others are run by `make sizes`."""


def defects(
    sized: Sized, folder: Path, runtimes: Sequence[str], engines: Sequence[str]
) -> dict[str, str]:
    """Return the outcomes that are neither agreement nor a rejection."""
    found = dict(outcomes(sized, folder, runtimes, engines))
    assert found
    return {name: outcome for name, outcome in found.items() if is_defect(outcome)}


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[LARGE] if kind in ("timed_states", "states") else [])
        for kind in LIMITS
    ],
)
def test_one_more_than_the_limit_is_rejected_by_every_command(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    most, rule = LIMITS[kind]
    path = str(BY_NAME[kind](most + 1).write(tmp_path))
    for command in (["check"], ["run", "--events", "go"], ["compile", "--out", str(tmp_path)]):
        assert execute([command[0], path, *command[1:]]) == 1
        assert f" {rule}:" in capsys.readouterr().err


@pytest.mark.cc
@pytest.mark.slow
@pytest.mark.parametrize("kind", FAST)
def test_runtimes_and_engines_agree_at_eight_bits(kind: str, tmp_path: Path) -> None:
    count = min(LIMITS.get(kind, (256, ""))[0], 256)
    sized = BY_NAME[kind](count)
    assert defects(sized, tmp_path, ("python", "c", "c-size"), ("c", "python")) == {}


@pytest.mark.parametrize(
    ("kind", "count"),
    [
        pytest.param(each.__name__, count, marks=[pytest.mark.slow] if count > 1_000 else [])
        for each in NESTED
        for count in DEPTHS
        if each.__name__ != "nested_copies" or count <= 100  # each one is a file
    ],
)
def test_depth_is_a_finding(kind: str, count: int, tmp_path: Path) -> None:
    """Beyond what is read, and never a RecursionError."""
    assert defects(BY_NAME[kind](count), tmp_path, (), ()) == {}


@LARGE
@pytest.mark.external
@pytest.mark.parametrize("count", [*BYTE, *WORD])
@pytest.mark.parametrize("kind", [each.__name__ for each in COUNTED])
def test_runtimes_and_engines_agree_at_every_size(kind: str, count: int, tmp_path: Path) -> None:
    if count in WORD and kind in ("copies", "invocations", "machines", "regions"):
        pytest.skip("takes hours; see `python -m devtools.sizes`")
    assert defects(BY_NAME[kind](count), tmp_path, RUNTIMES, ("c", "python")) == {}
