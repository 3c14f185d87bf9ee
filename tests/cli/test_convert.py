from __future__ import annotations

import json
from pathlib import Path

import pytest

from fsmkit.chart.loading import load, read_document
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.runtime.script import run_script

ROOT = Path(__file__).parents[2]
CELL = ROOT / "machines/production_cell"


def test_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["convert", str(CELL / "feeder.yaml"), "--to", "yaml"]) == 0
    assert capsys.readouterr().out.startswith("chart: Feeder\nextends: module.scxml\n")


@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_writes_a_file_that_finds_its_base(notation: str, tmp_path: Path) -> None:
    out = tmp_path / f"new/feeder.{notation}"
    assert execute(["convert", str(CELL / "feeder.yaml"), "--to", notation, "--out", str(out)]) == 0
    assert load(out) == load(CELL / "feeder.yaml")


@pytest.mark.parametrize("name", ["module.scxml", "molder.yaml", "plant.yaml"])
def test_there_and_back(name: str, tmp_path: Path) -> None:
    first, second = tmp_path / "a.scxml", tmp_path / "b.yaml"
    assert execute(["convert", str(CELL / name), "--to", "scxml", "--out", str(first)]) == 0
    assert execute(["convert", str(first), "--to", "yaml", "--out", str(second)]) == 0
    assert load(second) == load(CELL / name)


@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_writes_a_file_that_finds_what_it_invokes(notation: str, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "inner.yaml").write_text("chart: Inner\nstates: {end: {final: true}}\n")
    shop = tmp_path / "old" / "shop.yaml"
    shop.write_text("chart: Shop\nstates: {open: {invoke: {id: i, src: inner.yaml}}}\n")
    out = tmp_path / f"shop.{notation}"
    assert execute(["convert", str(shop), "--to", notation, "--out", str(out)]) == 0
    assert load(out) == load(shop)
    assert len(load(out).invocations) == 1
    assert "old/inner.yaml" in out.read_text()


def test_writes_no_file_that_may_not_read_what_it_invokes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "inner.yaml").write_text("chart: Inner\nstates: {end: {final: true}}\n")
    shop = tmp_path / "shop.yaml"
    shop.write_text("chart: Shop\nstates: {open: {invoke: {id: i, src: inner.yaml}}}\n")
    out = tmp_path / "new" / "shop.scxml"
    assert execute(["convert", str(shop), "--to", "scxml", "--out", str(out)]) == 1
    assert "shop.yaml:2:38" in capsys.readouterr().err
    assert not out.exists()


def test_says_that_a_computed_name_is_not_moved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shop = tmp_path / "shop.scxml"
    shop.write_text(
        '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
        "<state id='open'><invoke srcexpr=\"'inner.' + 'scxml'\"/></state></scxml>"
    )
    out = tmp_path / "new" / "shop.yaml"
    assert execute(["convert", str(shop), "--to", "yaml", "--out", str(out)]) == 0
    assert "not-expressible" in capsys.readouterr().err
    assert "src_expr: \"'inner.' + 'scxml'\"" in out.read_text()


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    path = CELL / "module.scxml"
    assert execute(["convert", str(path), "--to", "yaml", "--json"]) == 0
    text = json.loads(capsys.readouterr().out)["text"]
    assert text.startswith("chart: Module\n")
    assert read_document(path, Findings()).name.value == "Module"


@pytest.mark.parametrize(
    ("arguments", "code", "rule"),
    [
        (["nowhere.yaml", "--to", "yaml"], 1, "unreadable-file"),
        (["feeder.yaml", "--to", "uml"], 2, "there is no notation `uml`: "),
        (["feeder.yaml"], 2, "--to"),
        (["feeder.yaml", "--to", "yaml", "--out", "."], 1, "unwritable-output"),
    ],
)
def test_what_goes_wrong(
    arguments: list[str],
    code: int,
    rule: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(CELL)
    assert execute(["convert", *arguments]) == code
    assert rule in capsys.readouterr().err


def test_a_base_whose_name_xml_cannot_hold_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "chart.yaml"
    path.write_text('chart: C\nextends: "a\\x01b.yaml"\nstates: {a: {}}\n')
    assert execute(["convert", str(path), "--to", "scxml"]) == 1
    told = capsys.readouterr()
    assert "characters that XML cannot hold" in told.err
    assert told.out == ""


BELL = """\
chart: Bell
operations: ["say(s symbol)"]
events: {in: [go]}
initial: a
states:
  a: {on: {go: {target: b, do: "say('\\t\\u0007 \\\\\\u0007 \\\\\\\\\\uFFFF')"}}}
  b: {}
"""


def test_characters_that_xml_cannot_hold_are_escaped_in_code(tmp_path: Path) -> None:
    path, other = tmp_path / "bell.yaml", tmp_path / "bell.scxml"
    path.write_text(BELL)
    assert execute(["convert", str(path), "--out", str(other)]) == 0
    assert "\\u0007 \\u0007 \\\\\\uffff" in other.read_text()
    script = ["start 0", "run 0", "post go", "run 1"]
    told = [run_script(load(file), script) for file in (path, other)]
    assert told[0] == told[1]
    assert any("say" in line for line in told[0])


def test_a_label_that_xml_cannot_hold_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bell.yaml"
    path.write_text("chart: C\nstates: {a: {entry: \"log 'a\\u0007'\"}}\n")
    assert execute(["convert", str(path), "--to", "scxml"]) == 1
    assert "characters that XML cannot hold" in capsys.readouterr().err


def test_a_used_chart_is_found_from_another_folder(tmp_path: Path) -> None:
    gantry = ROOT / "machines/gantry/gantry.yaml"
    for out in (tmp_path / "gantry.scxml", tmp_path / "gantry.yaml"):
        assert execute(["convert", str(gantry), "--out", str(out)]) == 0
        assert load(out) == load(gantry)


def test_no_notation_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["convert", str(CELL / "feeder.yaml")]) == 2
    assert "Missing option '--to'" in capsys.readouterr().err
    assert execute(["convert", str(CELL / "feeder.yaml"), "--out", str(tmp_path / "x.txt")]) == 1
    assert "unknown-suffix" in capsys.readouterr().err
