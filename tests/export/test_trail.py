"""``fsmkit export --replay-trail``: what SPIN finds is performed by interpreter and generated C."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from fsmkit.cli import execute

HASTY = Path(__file__).parents[2] / "machines/fischer/hasty.yaml"
REPLAY = ("export", HASTY, "--to", "promela")


def said(*arguments: object) -> tuple[int, str, str]:
    """Return the exit code, and what was printed."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = execute([str(a) for a in arguments])
    return code, out.getvalue(), err.getvalue()


def exported(folder: Path, time: str) -> Path:
    """Return the model of the processes that do not wait long enough."""
    model = folder / "hasty.pml"
    assert said(*REPLAY, "--time", time, "--out", model)[0] == 0
    return model


@pytest.mark.external
@pytest.mark.parametrize("time", ["untimed", "discrete"])
def test_a_path_of_spin_is_performed(
    tmp_path: Path, time: str, require_tool: Callable[[str], str]
) -> None:
    spin, cc = require_tool("spin"), require_tool("cc")
    model = exported(tmp_path, time)
    for command in (
        [spin, "-a", model.name],
        [cc, "-O1", "-w", "-DNOREDUCE", "-o", "pan", "pan.c"],
        ["./pan", "-N", "exclusion"],
    ):
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    code, out, _ = said(*REPLAY, "--time", time, "--replay-trail", model, "--json")
    told = json.loads(out)
    assert code == 1
    assert (told["property"], told["verdict"]) == ("exclusion", "violated")
    assert told["replayed"] == ["interpreter", "generated C"]
    last: dict[str, list[str]] = {}
    for step in told["trace"]:
        last[step["machine"]] = step["to"]
    assert last["p[1]"] == last["p[2]"] == ["critical"]


def printed(model: Path, wanted: list[str]) -> str:
    """Return what SPIN would print of a path, of which the comments before the steps are given."""
    lines = model.read_text(encoding="utf-8").splitlines()
    found = []
    for number, what in enumerate(wanted, 1):
        at = next(n for n, line in enumerate(lines) if what in line)
        while not lines[at].lstrip().startswith(":: d_step"):
            at += 1
        found.append(f" {number}:\tproc  1 (x:1) hasty.pml:{at + 1} (state 3)\t[true]")
        found.append(f" {number}:\tproc  1 (x:1) hasty.pml:3 (state 4)\t[true]")
    return "\n".join([*found, "spin: trail ends after 9 steps", "proc - (exclusion:1)"])


@pytest.mark.cc
def test_a_printed_path_needs_no_spin(tmp_path: Path) -> None:
    path = tmp_path / "path.txt"
    model = exported(tmp_path, "untimed")
    path.write_text(printed(model, ["init {", "leaves idle"]), encoding="utf-8")
    code, out, _ = said(*REPLAY, "--time", "untimed", "--replay-trail", path, "--json")
    assert code == 1
    assert json.loads(out)["trace"][-1]["to"] == ["wants"]


@pytest.mark.cc
@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "there is no step in it"),
        (" 2: proc  1 (x:1) hasty.pml:3 (state 3)", "line 3 of the model is no step"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "path.txt"
    path.write_text(text, encoding="utf-8")
    code, _, err = said(*REPLAY, "--time", "untimed", "--replay-trail", path)
    assert code == 1
    assert "FK0549" in err
    assert why in err


@pytest.mark.cc
def test_a_path_that_cannot_be_taken_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "path.txt"
    model = exported(tmp_path, "untimed")
    path.write_text(printed(model, ["init {", "timeout in waits"]), encoding="utf-8")
    code, _, err = said(*REPLAY, "--time", "untimed", "--replay-trail", path)
    assert code == 1
    assert "FK0549" in err


@pytest.mark.cc
def test_a_model_of_something_else_is_refused(tmp_path: Path) -> None:
    model = exported(tmp_path, "untimed")
    code, _, err = said(*REPLAY, "--time", "discrete", "--replay-trail", model)
    assert code == 1
    assert "the model does not match this system" in err
    assert said("export", HASTY, "--to", "aut", "--replay-trail", model)[0] == 2
    assert said(*REPLAY, "--time", "untimed", "--replay-trail", tmp_path / "no.pml")[0] == 1
