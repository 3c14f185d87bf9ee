"""``fsmkit check`` of folders and several files: a line each, the worst exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.verify.explore import check_file

GOOD = "chart: Good\nevents: {in: [go]}\ninitial: a\n"
GOOD += "states: {a: {on: {go: b}, after: {1s: b}}, b: {after: {1s: a}}}\n"
TRAP = "chart: Trap\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: b}}, b: {}}\n"
BASE = "chart: Base\nabstract: true\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: a}}}\n"
BROKEN = "chart: Broken\ninitial: nowhere\nstates: {a: {}}\n"
SYSTEM = "system: Two\nmachines: {one: good.yaml}\nenvironment: {may: [one.go]}\n"
SCXML = (
    '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">'
    '<state id="a"><transition event="e" target="a"/></state></scxml>'
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    files = {
        "good.yaml": GOOD,
        "base.yaml": BASE,
        "below/deep.scxml": SCXML,
        "below/two.yaml": SYSTEM.replace("good.yaml", "../good.yaml"),
        ".hidden/trap.yaml": TRAP,
        "other.yaml": "name: something else\n",
        "pom.xml": "<project/>",
        "notes.txt": "chart: none\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def lines(capsys: pytest.CaptureFixture[str]) -> list[tuple[str, ...]]:
    told = capsys.readouterr().out.splitlines()
    return [tuple(line.split()[:2]) for line in told]


@pytest.mark.slow
@pytest.mark.cc
@pytest.mark.usefixtures("folder")
def test_a_folder_is_all_charts_and_systems_below_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", "."]) == 0
    assert lines(capsys) == [
        ("HOLDS", "good.yaml"),
        ("HOLDS", "below/deep.scxml"),
        ("HOLDS", "below/two.yaml"),
        ("3", "files:"),
    ]


@pytest.mark.cc
def test_the_worst_exit_code_counts_and_all_are_checked(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "broken.yaml").write_text(BROKEN, encoding="utf-8")
    (folder / "trap.yaml").write_text(TRAP, encoding="utf-8")
    assert execute(["check", "broken.yaml", "trap.yaml", "base.yaml", "below"]) == 1
    told = capsys.readouterr()
    assert [line.split()[0] for line in told.out.splitlines()] == [
        "ERROR",
        "VIOLATED",
        "HOLDS",
        "HOLDS",
        "4",
    ]
    assert "4 files: 2 hold, 1 violated, 1 with errors; 1 abstract skipped" in told.out
    assert "trap" in told.out.splitlines()[1]
    assert "`nowhere`" in told.err


@pytest.mark.cc
def test_json_of_several_is_one_document(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "broken.yaml").write_text(BROKEN, encoding="utf-8")
    assert execute(["check", "good.yaml", "broken.yaml", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["code"] == 1
    assert [(one["file"], one["verdict"]) for one in document["files"]] == [
        ("good.yaml", "holds"),
        ("broken.yaml", "error"),
    ]
    assert document["files"][0]["states"] == 2
    assert document["files"][1]["findings"][0]["at"]["line"] == 2


@pytest.mark.cc
@pytest.mark.usefixtures("folder")
def test_a_single_file_is_answered_as_ever(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", "good.yaml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["states"] == 2


@pytest.mark.parametrize(
    ("make", "message"),
    [
        ({}, "there is no chart or system in `.`"),
        ({"base.yaml": BASE}, "there is no chart that is not abstract in `.`"),
    ],
)
def test_a_folder_without_charts_is_told(
    make: dict[str, str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, text in make.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert execute(["check", "."]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
def test_what_is_about_one_file_goes_with_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["check", ".", "--property", "P"]) == 2
    assert "go with one file" in capsys.readouterr().err
    assert execute(["check", "good.yaml", "base.yaml", "--save-trace", "traces"]) == 2


@pytest.mark.cc
@pytest.mark.usefixtures("folder")
def test_an_interrupt_ends_all(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fsmkit.cli.common.many_files.received", lambda: 130)
    execute(["check", "."])
    assert lines(capsys)[:2] == [("HOLDS", "good.yaml"), ("1", "files:")]


@pytest.mark.cc
@pytest.mark.usefixtures("folder")
def test_a_bug_in_one_does_not_hide_the_others(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(path: Path, *arguments: object, **more: object) -> object:
        if path.name == "good.yaml":
            raise ZeroDivisionError
        return check_file(path, *arguments, **more)  # type: ignore[arg-type]

    monkeypatch.setattr("fsmkit.cli.proving.check.check_file", failing)
    assert execute(["check", "."]) == 3
    told = capsys.readouterr()
    assert "fsmkit has a bug" in told.err
    assert told.out.splitlines()[1].startswith("HOLDS")
