"""``explain`` and ``targets``."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import rules


@pytest.mark.parametrize("name", ["FK0350", "fk0350", "unreachable-state", "Unreachable-State"])
def test_explains_by_code_and_name(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["explain", name]) == 0
    told = capsys.readouterr().out
    assert told.startswith("FK0350  warning unreachable-state\n")
    for heading in ("What it does", "Why it matters", "Example", "Instead"):
        assert heading in told


def test_lists_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["explain"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(rules())
    assert execute(["explain", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == len(rules())


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["explain", "FK0350", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["name"] == "unreachable-state"
    assert document["explanation"].startswith("## What it does")


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("unreachble-state", "did you mean `unreachable-state`?"),
        ("FK9999", "FK"),
        ("", "lists all"),
    ],
)
def test_an_unknown_name_is_a_usage_error(
    name: str, advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["explain", name]) == 2
    assert advice in capsys.readouterr().err


def test_targets(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["targets"]) == 0
    told = capsys.readouterr().out
    assert "compile --target  python" in told
    assert "convert --to      scxml        charts in .scxml or .xml" in told
    assert execute(["targets", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {"name": "scxml", "suffixes": [".scxml", ".xml"]} in document["notations"]
    assert all(target["summary"] for target in document["targets"])


@pytest.mark.cc
def test_python_runs_the_package_as_the_command_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "fsmkit", "targets"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert "python" in done.stdout
