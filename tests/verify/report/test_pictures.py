"""`fsmkit check --draw`: a sequence diagram for each trace."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from fsmkit.cli import execute
from tests.verify.systems import SYSTEMS


def written(name: str, folder: Path) -> Path:
    """Write a system and return its file."""
    for file, text in SYSTEMS[name].items():
        (folder / f"{file}.yaml").write_text(text, encoding="utf-8")
    return next(p for p in folder.iterdir() if p.read_text().lstrip().startswith("system:"))


def texts(path: Path) -> list[str]:
    root = ET.fromstring(path.read_text(encoding="utf-8"))
    return [element.text for element in root.iter() if element.text and element.text.strip()]


def test_each_trace_has_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, folder = written("drive", tmp_path), tmp_path / "out"
    drawings = [str(folder / f"drive{suffix}") for suffix in (".svg", ".mmd", ".puml")]
    options = [word for path in drawings for word in ("--draw", path)]
    assert execute(["check", str(file), "--engine", "python", *options]) == 1
    names = {path.name for path in folder.iterdir()}
    assert {f"drive_{p}.{s}" for p in ("never_twice", "done") for s in ("svg", "mmd")} <= names
    shown = texts(folder / "drive_never_twice.svg")
    assert "violated: never_twice: never: driver.tries == 2" in shown
    assert {"driver", "axis", "outside", "400ms", "800ms", "move(slow = true)"} <= set(shown)
    assert "wrote" in capsys.readouterr().out
    assert "move(slow = true)" in (folder / "drive_never_twice.puml").read_text()


def test_one_trace_is_where_it_was_asked_for(tmp_path: Path) -> None:
    file, path = written("drive", tmp_path), tmp_path / "wrong.svg"
    command = ["check", str(file), "--engine", "python", "--property", "never_twice"]
    execute([*command, "--draw", str(path)])
    assert "driver" in texts(path)


def test_connections_are_arrows_and_no_machines(tmp_path: Path) -> None:
    file = written("losing", tmp_path)
    execute(["check", str(file), "--engine", "python", "--draw", str(tmp_path / "l.svg")])
    shown = texts(tmp_path / "l_two_lost.svg")
    assert shown.count("lost") == 2
    assert not any(">" in text and "source." in text for text in shown)
    assert "event, by a connection that can lose it" in shown


def test_an_endless_run_is_marked(tmp_path: Path) -> None:
    file = written("livelock", tmp_path)
    execute(["check", str(file), "--engine", "python", "--draw", str(tmp_path / "l.svg")])
    assert "for ever" in texts(tmp_path / "l.svg")


def test_an_unknown_suffix_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", str(written("drive", tmp_path)), "--draw", "a.gif"]) == 2
    assert "unknown-suffix" in capsys.readouterr().err
