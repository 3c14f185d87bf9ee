"""A help that proposes a text is right: with that text the finding is gone, and no error comes."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.cli import execute

CHART = """
chart: Oven
data: {n: 0..9 = 0, full: "bool[2] = false"}
inputs: {temp: 0..300, door: bool}
outputs: {heat: bool = false}
operations: ["weigh() -> 0..100"]
events: {in: [start, "hall(floor 0..1)"]}
initial: off
states:
  off: {rest: true, on: {start: {target: hot}}}
  hot:
    entry: heat = true
    on: {hall: {do: n = 1}}
    after: {5s: off}
"""
MISTAKES: dict[str, tuple[str, str, str, str]] = {
    "brackets within braces": (
        "{do: n = 1}",
        "{if: not full[event.floor], do: n = 1}",
        '`"not full[event.floor]"`',
        '{if: "not full[event.floor]", do: n = 1}',
    ),
    "a choice within braces": (
        "{target: hot}",
        "{if: temp > 3 ? door : not door, target: hot}",
        '`"temp > 3 ? door : not door"`',
        "{if: door if temp > 3 else not door, target: hot}",
    ),
    "a number for a truth value": ("bool = false}", "bool = 0}", "`false`", "bool = false}"),
    "one for a truth value": ("heat = true", "heat = 1", "`true`", "heat = true"),
    "an operation in a property": (
        "initial: off",
        "properties: {p: {never: weigh() > 3}}\ninitial: off",
        "assign its result to a variable",
        "properties: {p: {never: n > 3}}\ninitial: off",
    ),
    "every under after": (
        "after: {5s: off}",
        "after: {every 5s: off}",
        "`every: {5s: ...}`",
        "every: {5s: off}",
    ),
    "a blank before the unit": (
        "hall: {do: n = 1}",
        "hall: {do: send start after 1.5 s}",
        "`1.5s`",
        "hall: {do: send start after 1.5s}",
    ),
}
"""What is replaced in the chart, by a mistake; what its help says; the text that it leads to."""


@pytest.mark.parametrize("name", MISTAKES)
def test_the_text_that_is_proposed_is_right(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, mistake, advice, right = MISTAKES[name]
    path = tmp_path / "oven.yaml"
    assert old in CHART
    path.write_text(CHART.replace(old, mistake))
    assert execute(["check", str(path), "--engine", "python", "--quiet"]) == 1
    assert advice in capsys.readouterr().err
    path.write_text(CHART.replace(old, right))
    execute(["check", str(path), "--engine", "python", "--quiet"])
    assert "error[FK01" not in capsys.readouterr().err


def test_errors_are_printed_before_warnings_and_notes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "oven.yaml"
    path.write_text(CHART.replace("after: {5s: off}", "after: {5s: of}"))
    execute(["check", str(path)])
    printed = capsys.readouterr().err
    kinds = [line.split("[")[0] for line in printed.splitlines() if "[FK0" in line]
    assert kinds == sorted(kinds, key=["error", "warning", "note"].index)
    assert kinds[0] == "error"
