"""``compile``: what is written, what is said of it, and that nothing is left of a failure."""

from __future__ import annotations

import json
from pathlib import Path
from textwrap import dedent

import pytest

from fsmkit.cli import execute

CHART = """
    chart: Lamp
    data: {n: 0..9 = 0}
    events: {in: [toggle]}
    capacity: {queue: 3}
    initial: dark
    states:
      dark: {on: {toggle: {target: bright, do: n = 1}}}
      bright: {after: {2s: dark}, on: {toggle: dark}}
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.yaml"
    path.write_text(dedent(CHART), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("target", "expected"),
    [("c", {"lamp.h", "lamp.c", "fsm.h", "fsm.c"}), ("python", {"lamp.py"})],
)
def test_writes_files_and_names_them(
    lamp: Path, target: str, expected: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = lamp.parent / "made" / "here"
    assert execute(["compile", str(lamp), "--target", target, "--out", str(folder)]) == 0
    assert {path.name for path in folder.iterdir()} == expected
    told = capsys.readouterr().out
    assert all(str(folder / name) in told for name in expected)
    assert "Lamp:" in told


def test_json(lamp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = lamp.parent / "made"
    assert execute(["compile", str(lamp), "--out", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {Path(name).name for name in said["files"]} == {"lamp.h", "lamp.c", "fsm.h", "fsm.c"}
    assert said["capacities"]["queue"] == 3
    assert said["capacities"]["timers"] == 1
    assert said["struct_bytes"] > 0
    assert [finding["rule"] for finding in said["findings"]] == ["unread-data"]


def test_same_chart_gives_same_bytes(lamp: Path) -> None:
    for name in ("one", "two"):
        assert execute(["compile", str(lamp), "--out", str(lamp.parent / name)]) == 0
    for path in (lamp.parent / "one").iterdir():
        assert path.read_bytes() == (lamp.parent / "two" / path.name).read_bytes()


def test_prefix(lamp: Path) -> None:
    folder = lamp.parent / "made"
    assert execute(["compile", str(lamp), "--out", str(folder), "--prefix", "left_lamp"]) == 0
    assert "left_lamp_post_toggle" in (folder / "left_lamp.h").read_text(encoding="utf-8")


def test_prefix_that_is_no_identifier_is_a_matter_of_usage(lamp: Path) -> None:
    assert execute(["compile", str(lamp), "--prefix", "../x"]) == 2
    assert execute(["compile", str(lamp), "--prefix", ""]) == 2


def test_parts_are_left_out_of_c_alone(lamp: Path) -> None:
    folder = lamp.parent / "made"
    assert execute(["compile", str(lamp), "--out", str(folder), "--without", "queue,counters"]) == 0
    assert "lamp_post" not in (folder / "lamp.h").read_text(encoding="utf-8")
    assert execute(["compile", str(lamp), "--target", "python", "--without", "queue"]) == 2
    assert execute(["compile", str(lamp), "--trace"]) == 2


def test_unknown_target_names_those_there_are(
    lamp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["compile", str(lamp), "--target", "fortran"]) == 2
    assert "there is no target `fortran`: c, fmu, javascript, package" in capsys.readouterr().err


def test_abstract_chart_is_refused_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "base.yaml"
    path.write_text("chart: Base\nabstract: true\ninitial: a\nstates: {a: {}}\n", encoding="utf-8")
    assert execute(["compile", str(path), "--out", str(tmp_path / "made")]) == 1
    assert "abstract" in capsys.readouterr().err
    assert not (tmp_path / "made").exists()


def test_unwritable_folder_is_a_finding(lamp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["compile", str(lamp), "--out", str(lamp)]) == 1
    assert "cannot write" in capsys.readouterr().err


def test_system_gives_every_machine_once(
    tmp_path: Path, lamp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    del lamp
    path = tmp_path / "pair.yaml"
    path.write_text(
        "system: Pair\nmachines: {a: lamp.yaml, b: lamp.yaml}\n"
        "environment: {may: [a.toggle, b.toggle]}\n",
        encoding="utf-8",
    )
    folder = tmp_path / "made"
    assert execute(["compile", str(path), "--out", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [machine["name"] for machine in said["machines"]] == ["Lamp"]
    machines = {"lamp.h", "lamp.c", "fsm.h", "fsm.c"}
    assert {p.name for p in folder.iterdir()} == machines | {"pair.h", "pair.c"}
