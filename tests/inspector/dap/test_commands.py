"""What the command line has of the adapter: `check --debug`, `serve --dap`."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.inspector.dap.framing import Frames
from tests.inspector.dap.editor import Editor, Json
from tests.inspector.dap.test_serving import requests

SYSTEM = """\
system: Door
machines: {left: leaf.yaml, right: leaf.yaml}
environment: {may: [left.push, right.push]}
properties:
  apart: {never: left.In(open) and right.In(open)}
  once: {reachable: left.In(open)}
"""
LEAF = """\
chart: Leaf
events: {in: [push]}
states:
  shut: {on: {push: open}, after: {5s: open}}
  open: {on: {push: shut}, after: {5s: shut}}
"""


@pytest.fixture
def door(tmp_path: Path) -> Path:
    """Write a system with a property that is broken."""
    (tmp_path / "leaf.yaml").write_text(LEAF, encoding="utf-8")
    path = tmp_path / "door.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    return path


def checked(door: Path, launch: Path, *more: str) -> int:
    given = ["check", "-q", str(door), "--engine", "python", "--property", "apart"]
    return execute([*given, "--debug", str(launch), *more])


def test_a_counterexample_becomes_a_launch_configuration(door: Path, tmp_path: Path) -> None:
    launch = tmp_path / ".vscode" / "launch.json"
    assert checked(door, launch) == 1
    found = json.loads(launch.read_text(encoding="utf-8"))
    (own,) = found["configurations"]
    assert (own["type"], own["request"], own["name"]) == ("fsmkit", "launch", "Door: apart")
    assert Path(own["program"]).parent == launch.parent / "traces"
    editor = Editor()
    editor.get("initialize")
    editor.get("launch", **own)
    editor.get("configurationDone")
    (stopped,) = editor.events("stopped")
    assert (stopped["reason"], stopped["text"].endswith("apart is violated")) == ("exception", True)
    assert editor.stack(1)[0].startswith("open")


def test_what_a_file_of_configurations_holds_stays(door: Path, tmp_path: Path) -> None:
    launch = tmp_path / "launch.json"
    mine = {"type": "node", "request": "launch", "name": "mine"}
    old = {"type": "fsmkit", "name": "Door: apart", "program": "old.json", "speed": 0}
    before = {"version": "0.1.0", "configurations": [mine, old], "compounds": []}
    launch.write_text(json.dumps(before), encoding="utf-8")
    assert checked(door, launch, "--save-trace", str(tmp_path / "t")) == 1
    after = json.loads(launch.read_text(encoding="utf-8"))
    assert after["configurations"][0] == mine
    changed = after["configurations"][1]
    assert (changed["speed"], Path(changed["program"]).parent.name) == (0, "t")
    assert (after["version"], after["compounds"]) == ("0.1.0", [])
    stamp = launch.stat().st_mtime_ns
    assert checked(door, launch, "--save-trace", str(tmp_path / "t")) == 1
    assert launch.stat().st_mtime_ns == stamp


@pytest.mark.parametrize("text", ["// mine\n{}", "[]", '{"configurations": 1}', "\xff"])
def test_a_file_that_nothing_can_be_added_to_stays(
    door: Path, tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = tmp_path / "launch.json"
    launch.write_bytes(text.encode("latin-1"))
    assert checked(door, launch) == 1
    assert "unwritable-output" in capsys.readouterr().err
    assert launch.read_bytes() == text.encode("latin-1")
    assert not (tmp_path / "traces").exists()


def test_without_a_counterexample_nothing_is_written(door: Path, tmp_path: Path) -> None:
    door.write_text(SYSTEM.replace("left.In(open) and right", "left.In(shut) and left"))
    assert checked(door, tmp_path / "launch.json") == 0
    assert not (tmp_path / "launch.json").exists()


@pytest.mark.cc
def test_an_editor_joins_what_is_served(door: Path) -> None:
    argv = [sys.executable, "-m", "fsmkit", "serve", str(door), "--dap", "0", "--json"]
    with subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as serving:
        try:
            assert serving.stdout is not None
            text = b""
            while not text.endswith(b"}\n"):
                text += serving.stdout.readline()
            told = json.loads(text)
            assert re.match(r"http://127\.0\.0\.1:\d+/#", told["address"])
            with socket.create_connection(("127.0.0.1", told["dap"]), 20) as editor:
                names = ("initialize", "attach", "fsmkit/live", "threads")
                editor.sendall(requests(*((name, {}) for name in names)))
                frames = Frames()
                answers: dict[str, Json] = {}
                while len(answers) < len(names):
                    bodies = [json.loads(body) for body in frames.feed(editor.recv(65_536))]
                    answers |= {m["command"]: m["body"] for m in bodies if "command" in m}
        finally:
            serving.terminate()
    assert answers["fsmkit/live"]["address"] == told["address"]
    assert [thread["name"] for thread in answers["threads"]["threads"]] == ["left", "right"]
