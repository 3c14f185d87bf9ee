"""A carrier from outside: one folder, found as a plug-in, and usable as the others are."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
PAGE = ROOT / "docs/how-to/add-a-carrier.md"
CARRIER = HERE / "fsmkit_files"
FILES = {
    "button.yaml": """\
chart: Button
data: {presses: 0..9 wrap = 0}
inputs: {lit: bool}
events: {in: [press], out: [pressed(count 0..9)]}
initial: ready
states:
  ready:
    rest: true
    on: {press: {if: lit or presses < 9, do: "presses += 1; send pressed(count = presses)"}}
""",
    "lamp.yaml": """\
chart: Lamp
outputs: {lit: bool = false, changes: 0..9 wrap = 0}
events: {in: [pressed(count 0..9)]}
initial: dark
states:
  dark: {rest: true, on: {pressed: {target: bright, do: lit = true; changes += 1}}}
  bright: {rest: true, on: {pressed: {target: dark, do: lit = false; changes += 1}}}
""",
    "house.yaml": """\
system: House
machines: {button: button.yaml, lamp: lamp.yaml}
connect:
  - button.pressed -> lamp.pressed
  - lamp.lit -> button.lit
environment: {may: [button.press]}
""",
    "deployment.yaml": """\
system: house.yaml

nodes:
  wall: [button]
  hall: [lamp]

links:
  kind: files
  folder: frames
""",
}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """Return a folder with a deployment, and an environment with the carrier installed."""
    folder = tmp_path_factory.mktemp("house")
    for name, text in FILES.items():
        (folder / name).write_text(text)
    installed = folder / "site/fsmkit_files-1.dist-info"
    installed.mkdir(parents=True)
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: fsmkit_files\nVersion: 1\n")
    points = "[fsmkit.plugins]\nfiles = fsmkit_files.plugin:PLUGIN\n"
    (installed / "entry_points.txt").write_text(points)
    paths = [str(folder / "site"), str(HERE), str(ROOT)]
    return folder, {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


@pytest.fixture(scope="module")
def found(house: tuple[Path, dict[str, str]]) -> dict[str, Any]:
    folder, environment = house
    command = [sys.executable, str(HERE / "play.py"), str(folder)]
    told = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert told.returncode == 0, told.stderr
    result: dict[str, Any] = json.loads(told.stdout)
    return result


@pytest.mark.cc
def test_two_nodes_exchange_frames(found: dict[str, Any]) -> None:
    played = found["played"]
    assert played == {"kind": "FileLink", "presses": 5, "changes": 5, "lit": [True], "lost": 0}


@pytest.mark.cc
def test_the_deployment_is_read_by_the_carrier(found: dict[str, Any]) -> None:
    assert found["kind"] == [["unexpected-value", "there are no links of the kind `filez`"]]
    assert found["missing"] == [
        ["broken-deployment", "links of the kind `files` need a `folder`"],
    ]
    assert found["own"] == [["broken-deployment", "`~/frames` names a home"]]
    assert found["foreign"] == [
        ["broken-deployment", "links of the kind `zeromq` have no `folder`"],
    ]


@pytest.mark.cc
def test_the_editor_and_the_schema_know_its_keys(found: dict[str, Any]) -> None:
    assert "folder" in found["keys"]
    assert "files" in found["words"]
    assert "folder" in found["schema"]
    assert found["formatted"] == FILES["deployment.yaml"]


@pytest.mark.cc
def test_another_kind_at_run_time_is_a_finding(found: dict[str, Any]) -> None:
    """Whatever kind a program opens instead, with whatever options: never a traceback."""
    assert found["overridden"] == [
        ["can", "link-not-opened"],
        ["can", "wrong-option"],
        ["files", "wrong-option"],
        ["in_process", "link-not-opened"],
        ["in_process", "wrong-option"],
        ["zeromq", "link-not-opened"],
        ["zeromq", "wrong-option"],
        ["none", "unknown-plugin"],
        ["none", "unknown-plugin"],
    ]


@pytest.mark.cc
def test_verbs_take_the_deployment(house: tuple[Path, dict[str, str]]) -> None:
    folder, environment = house
    for verb in (["check"], ["compile", "--target", "python", "--out", "made"]):
        command = [sys.executable, "-m", "fsmkit", *verb, "deployment.yaml"]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, env=environment, check=False
        )
        assert done.returncode == 0, done.stderr


def test_the_page_shows_the_carrier_as_it_is() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    files = [path.read_text(encoding="utf-8") for path in CARRIER.glob("*.py")]
    assert len(blocks) >= 2
    assert [block for block in blocks if not any(block in file for file in files)] == []


def test_it_is_small() -> None:
    lines = [path.read_text(encoding="utf-8").count("\n") for path in CARRIER.glob("*.py")]
    assert (len(lines), sum(lines) <= 130) == (3, True)
