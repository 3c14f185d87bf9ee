"""``fsmkit paths``: folders, one a line or one alone, ready for another command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute


def test_each_is_a_folder_with_what_is_looked_for(capsys: pytest.CaptureFixture[str]) -> None:
    files = {
        "can": "fsm_can.h",
        "cmake": "fsmkit-config.cmake",
        "hosts": "fsm_mailbox.h",
        "in_process": "fsm_link_local.h",
        "include": "fsm.h",
        "links": "fsm_link.h",
        "pkgconfig": "fsmkit.pc",
        "ros": "fsm_ros_values.h",
        "schema": "chart.json",
        "wires": "fsm_io_map.h",
        "zeromq": "fsm_link_zmq.h",
    }
    for what, name in files.items():
        assert execute(["paths", what]) == 0
        printed = capsys.readouterr().out
        assert printed.endswith("\n")
        assert (Path(printed.removesuffix("\n")) / name).is_file()
    assert execute(["paths", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert set(document) == set(files)
    assert execute(["paths"]) == 0
    assert capsys.readouterr().out.split() == [word for pair in document.items() for word in pair]


def test_what_there_is_not_is_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["paths", "elsewhere"]) == 2
    assert "cmake" in capsys.readouterr().err


def test_the_project_file_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fsmkit.toml").write_text("")
    assert execute(["paths", "--project"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'fsmkit.toml'}\n"
    assert execute(["paths", "--project", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"project": str(tmp_path / "fsmkit.toml")}
    (tmp_path / "fsmkit.toml").unlink()
    assert execute(["paths", "--project"]) == 1


def test_the_folder_of_schemas_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["paths", "--schema"]) == 0
    assert (Path(capsys.readouterr().out.strip()) / "project.json").is_file()
    assert execute(["paths", "--schema", "--project"]) == 2
