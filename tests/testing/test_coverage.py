"""Counts of coverage: they add up, are refused where they do not fit, and others read them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from base64 import b64decode
from pathlib import Path

import pytest
from lxml import etree

import fsmkit
from fsmkit.cli import execute
from fsmkit.diagnostics import FsmkitError
from fsmkit.testing.coverage import reports
from fsmkit.testing.coverage.page import page
from fsmkit.testing.coverage.record import FOLDER, Recorder, add_coverage, erase, load, save
from fsmkit.testing.machines import assert_in, calls, make_machine

CHART = """\
chart: Valve
inputs: {high: bool, low: bool}
operations: [drive(open bool), level() -> 3..9]
events: {in: [tick]}
initial: shut
states:
  shut:
    on: {tick: [{if: high and not low, target: open}, {if: low, do: drive(false)}]}
  open:
    entry: drive(true)
    on: {tick: {if: level() > 2, target: shut}}
  never: {}
"""


@pytest.fixture
def valve(tmp_path: Path) -> Path:
    (tmp_path / "valve.yaml").write_text(CHART.replace("  never: {}\n", ""))
    return tmp_path / "valve.yaml"


def test_counts_of_a_session(valve: Path) -> None:
    recorder = Recorder()
    machine = make_machine(valve, None, recorder)
    for high, low in ((True, False), (False, False)):
        machine.inputs.update({"high": high, "low": low})
        machine.post("tick")
        machine.run()
    (chart,) = recorder.coverage()
    assert [(s.text, s.count) for s in chart.states] == [("shut", 2), ("open", 1)]
    assert [t.count for t in chart.transitions] == [1, 0, 1]
    first = chart.decisions[0]
    assert (first.text, first.true, first.false) == ("high and not low", 1, 0)
    assert first.seen == (((True, False), 1),)
    assert machine.active == ("shut",)
    assert_in(machine, "shut")
    assert calls(machine) == (("drive", True), ("level",))
    with pytest.raises(AssertionError, match="not in open: active is shut"):
        assert_in(machine, "open")


def run(valve: Path, *inputs: tuple[bool, bool]) -> Recorder:
    recorder = Recorder()
    machine = make_machine(valve, None, recorder)
    for high, low in inputs:
        machine.inputs.update({"high": high, "low": low})
        machine.dispatch("tick")
    return recorder


def test_counts_add_up_in_any_order(valve: Path, tmp_path: Path) -> None:
    parts = [
        run(valve, (True, False)),
        run(valve, (False, False), (True, True)),
        run(valve, (False, True)),
    ]
    whole = [part.coverage() for part in parts]
    assert add_coverage(whole) == add_coverage(reversed(whole))
    for part in parts:
        save(part.coverage(), tmp_path / "counts")
    (loaded,) = load(tmp_path / "counts")
    assert (loaded,) == add_coverage(whole)
    figures = reports.figures(loaded)
    assert figures.states == reports.Figure(2, 2)
    assert figures.transitions == reports.Figure(2, 3)
    assert figures.decisions == reports.Figure(4, 6)
    assert figures.conditions == reports.Figure(3, 4)
    erase(tmp_path / "counts")
    with pytest.raises(FsmkitError, match="holds no counts"):
        load(tmp_path / "counts")


def test_the_folder_of_the_tests_leads_to_the_counts(valve: Path, tmp_path: Path) -> None:
    recorder = run(valve, (True, False))
    save(recorder.coverage(), tmp_path / FOLDER)
    assert load(tmp_path) == load(tmp_path / FOLDER)
    assert execute(["coverage", str(tmp_path)]) == 0
    assert execute(["coverage", str(tmp_path), "--erase"]) == 0
    assert execute(["coverage", str(tmp_path)]) == 1


def test_counts_of_another_chart_are_refused(valve: Path) -> None:
    before = run(valve, (True, False)).coverage()
    valve.write_text(CHART)
    after = run(valve, (True, False)).coverage()
    with pytest.raises(FsmkitError, match=r"`Valve` of `.*` has changed between two runs"):
        add_coverage((before, after))


def test_machines_with_other_constants_are_not_another_chart(tmp_path: Path) -> None:
    """The same text with constants given by a system has the same places."""
    recorders = []
    for limit in (3, 4):
        path = tmp_path / "a.yaml"
        path.write_text(
            f"chart: A\nconstants: {{N: {limit}}}\ndata: {{n: 0..9 = 0}}\nevents: {{in: [go]}}\n"
            "initial: a\nstates: {a: {on: {go: {if: n < N, do: n += 1}}}}\n"
        )
        recorder = Recorder()
        make_machine(path, None, recorder).dispatch("go")
        recorders.append(recorder.coverage())
    assert len(add_coverage(recorders)) == 2


def test_charts_of_one_name_that_are_invoked_inline(tmp_path: Path) -> None:
    inline = "<invoke><content><scxml name='Part'>{}</scxml></content></invoke>"
    path = tmp_path / "whole.scxml"
    parts = [inline.format(f"<state id='{name}'/>") for name in ("one", "two")]
    text = "".join(f"<state id='s{n}'>{part}</state>" for n, part in enumerate(parts))
    path.write_text(
        f"<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' name='W'>{text}</scxml>"
    )
    runs = []
    for _ in range(2):
        recorder = Recorder()
        make_machine(path, None, recorder)
        runs.append(recorder.coverage())
    charts = [chart for chart in add_coverage(runs) if chart.name == "Part"]
    assert [[s.text for s in chart.states] for chart in charts] == [["one"], ["two"]]
    path.write_text(path.read_text().replace("two", "three"))
    make_machine(path, None, changed := Recorder())
    with pytest.raises(FsmkitError, match="has changed between two runs"):
        add_coverage((*runs, changed.coverage()))


@pytest.mark.parametrize(
    "content",
    ["", "{}", "[]", '{"format": "other"}', "\x00", "[" * 100_000,
     '{"format": "fsmkit coverage 1", "charts": [{"name": 3}]}'],
)  # fmt: skip
def test_files_that_hold_no_counts_are_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "run-1.json"
    path.write_text(content)
    with pytest.raises(FsmkitError, match="holds no counts of coverage"):
        load(path)


def test_outcomes_must_fit_the_conditions(valve: Path, tmp_path: Path) -> None:
    path = save(run(valve, (True, False)).coverage(), tmp_path)
    document = json.loads(path.read_text())
    document["charts"][0]["decisions"][0]["seen"][0][0] = [True]
    path.write_text(json.dumps(document))
    with pytest.raises(FsmkitError, match="do not fit its conditions"):
        load(path)


def test_a_full_disk_is_said(valve: Path) -> None:
    with pytest.raises(FsmkitError, match="cannot be written"):
        save(run(valve).coverage(), Path("/dev/full/counts"))


def test_the_verb(valve: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    counts = tmp_path / "counts"
    before = save(run(valve, (True, False)).coverage(), tmp_path / "before")
    save(run(valve, (True, False), (False, False), (False, False)).coverage(), counts)
    assert execute(["coverage", str(before), "--missing"]) == 0
    told = capsys.readouterr().out
    assert "2 of 2" in told
    assert "guard never evaluated: low" in told
    assert execute(["coverage", str(counts), "--fail-under", "99"]) == 1
    capsys.readouterr()
    assert execute(["coverage", str(counts), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["charts"][0]["chart"] == "Valve"
    files = [str(tmp_path / name) for name in ("c.info", "c.xml")]
    assert execute(["coverage", str(counts), *(w for f in files for w in ("-o", f))]) == 0
    assert all(Path(file).stat().st_size > 200 for file in files)
    assert execute(["coverage", str(counts), "-o", "c.txt"]) == 2
    capsys.readouterr()
    assert execute(["coverage", str(counts), "--against", str(before)]) == 0
    assert "+ " in capsys.readouterr().out
    assert execute(["coverage", str(before), "--against", str(counts)]) == 1
    assert execute(["coverage", str(counts), "--erase"]) == 0
    assert execute(["coverage", str(counts)]) == 1


@pytest.mark.external
@pytest.mark.cc
def test_the_page_has_the_drawing_in_colours(valve: Path, tmp_path: Path) -> None:
    from tests.needs import tool

    tool("dot")
    save(run(valve, (True, False)).coverage(), tmp_path / "counts")
    file = tmp_path / "c.html"
    assert execute(["coverage", str(tmp_path / "counts"), "-o", str(file)]) == 0
    drawn = re.search(r"data:image/svg[+]xml;base64,([^\"]+)", file.read_text())
    assert drawn is not None
    svg = b64decode(drawn[1]).decode()
    assert re.search(r"#s1 path, #s1 polygon { stroke: #2e7d32", svg)
    assert re.search(r"#t\d+ path, #t\d+ polygon { stroke: #c62828; stroke-dasharray: 4 3", svg)


HOSTILE = "<script>alert(1)</script>&'\"\u202e]]>"


def test_texts_of_charts_are_texts_on_the_page(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    name = json.dumps(HOSTILE)
    path.write_text(f"chart: {name}\ninitial: a\nstates: {{a: {{}}}}  # {HOSTILE}\n")
    recorder = Recorder()
    make_machine(path, None, recorder)
    text = page(recorder.coverage(), {str(path): path.read_text()})
    assert "<script" not in text
    assert "\u202e" not in text
    assert "&lt;script&gt;" in text


def test_cobertura_is_as_its_schema_says(valve: Path) -> None:
    """Elements and attributes of coverage-04.dtd, in its order."""
    text = reports.cobertura(run(valve, (True, False)).coverage(), fsmkit.__version__, 0)
    root = etree.fromstring(text.encode(), etree.XMLParser(load_dtd=False, no_network=True))
    assert [child.tag for child in root] == ["sources", "packages"]
    assert set(root.attrib) == {
        "line-rate", "branch-rate", "lines-covered", "lines-valid", "branches-covered",
        "branches-valid", "complexity", "version", "timestamp",
    }  # fmt: skip
    (one,) = root.iter("class")
    assert set(one.attrib) == {"name", "filename", "line-rate", "branch-rate", "complexity"}
    assert [child.tag for child in one] == ["methods", "lines"]
    branches = [line for line in root.iter("line") if line.get("branch") == "true"]
    assert all("%" in str(line.get("condition-coverage")) for line in branches)
    assert branches


@pytest.mark.external
@pytest.mark.cc
def test_genhtml_reads_the_tracefile(valve: Path, tmp_path: Path) -> None:
    from tests.needs import tool

    tool("genhtml")
    (tmp_path / "c.info").write_text(reports.lcov(run(valve, (True, False)).coverage()))
    done = subprocess.run(
        [str(shutil.which("genhtml")), "--branch-coverage", "c.info", "-o", "html"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "lines" in done.stdout
