"""Charts without a test: how far each gets, told line by line, in numbers and as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from fsmkit.cli import execute
from fsmkit.testing.conformance.charts import CAUSES, REFUSED, Reading, Stage, meaning, read_chart
from fsmkit.testing.conformance.conformance import Result
from fsmkit.testing.conformance.suites import find_cases, find_charts

HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"'
GOOD = f'{HEAD}><state id="s"><transition event="e" target="s"/></state></scxml>'
NO_TARGET = f'{HEAD}><state id="s"><transition event="e" target="t"/></state></scxml>'
NO_VERSION = GOOD.replace(' version="1.0"', "")
YAML = "chart: Lamp\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: a}}}\n"
FILES = {
    "a/good.scxml": GOOD,
    "a/warned.xml": NO_VERSION,
    "a/lamp.yaml": YAML,
    "b/target.scxml": NO_TARGET,
    "b/broken.scxml": "<scxml",
    "pom.xml": "<project/>",
    "notes.txt": "no chart",
    ".hidden/good.scxml": GOOD,
}


@pytest.fixture
def folder(tmp_path: Path, require_tool: Callable[[str], str]) -> Path:
    require_tool("cc")
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.cc
def test_each_file_goes_as_far_as_it_can(folder: Path) -> None:
    paths = find_charts(folder)
    names = [path.relative_to(folder).as_posix() for path in paths]
    readings = dict(zip(names, (read_chart(p, p.name, 20) for p in paths), strict=True))
    assert {name: reading.stage for name, reading in readings.items()} == {
        "a/good.scxml": Stage.COMPILED,
        "a/lamp.yaml": Stage.COMPILED,
        "a/warned.xml": Stage.COMPILED,
        "b/broken.scxml": Stage.NOWHERE,
        "b/target.scxml": Stage.READ,
        "pom.xml": Stage.NOWHERE,
    }
    assert readings["a/good.scxml"].warnings == 0
    assert readings["a/warned.xml"].warnings == 1
    assert "no state `t` at target.scxml:1:" in readings["b/target.scxml"].reason
    assert readings["pom.xml"].result is Result.SKIPPED
    assert readings["b/broken.scxml"].result is Result.FAILED


@pytest.mark.parametrize(("more", "stage"), [("", Stage.READ), ("<", Stage.NOWHERE)])
def test_a_file_whose_script_is_missing_is_read(more: str, stage: Stage, tmp_path: Path) -> None:
    path = tmp_path / "chart.scxml"
    path.write_text(GOOD.replace("<state", f'{more}<script src="missing.js"/><state', 1))
    assert read_chart(path, path.name, 20).stage is stage


def test_a_chart_that_takes_too_long_stops_nothing(folder: Path) -> None:
    reading = read_chart(folder / "a/good.scxml", "good", 0.000001)
    assert (reading.stage, reading.reason) == (Stage.NOWHERE, "takes too long")


@pytest.mark.cc
def test_what_the_compiler_says_is_the_reason(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = folder / "cc"
    compiler.write_text(
        "#!/bin/sh\necho 'a.c:1: note: x' >&2\necho 'a.c:2: error: y' >&2\nexit 1\n"
    )
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    reading = read_chart(folder / "a/good.scxml", "good", 20)
    assert reading.stage is Stage.CHART
    assert reading.reason.endswith("rejected the generated code: a.c:2: error: y")


def test_tests_are_no_charts_as_they_are_found(folder: Path) -> None:
    (folder / "a/good.json").write_text('{"initialConfiguration": ["s"], "events": []}')
    (folder / "w3c/ecma").mkdir(parents=True)
    (folder / "w3c/ecma/test1.scxml").write_text(GOOD)
    (folder / "w3c/manifest.xml").write_text("<tests/>")
    assert [case.name for case in find_cases(folder)] == ["test1", "a/good"]
    names = [path.name for path in find_charts(folder)]
    assert names == ["lamp.yaml", "warned.xml", "broken.scxml", "target.scxml", "pom.xml"]


@pytest.mark.cc
def test_the_verb_tells_how_far(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["conformance", str(folder)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "read yes  chart yes  C yes  a/good.scxml"
    assert lines[2] == "read yes  chart yes  C yes  a/warned.xml  1 warnings"
    assert lines[4].startswith("read yes  chart no   C no   b/target.scxml  FK0201 unknown-name: ")
    assert lines[5].split() == ["no", "chart", "pom.xml"]
    assert lines[6] == ("charts: 5 files, 4 read, 3 charts, 3 compiled, 2 compiled without warning")
    assert lines[7:] == [
        "meaning kept: 3 of 5 files; 0 places are an error at run time",
        "    2 files     2 places  the file is not a chart",
    ]
    assert execute(["conformance", str(folder), "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert (document["passed"], document["failed"], document["skipped"]) == (3, 2, 1)
    assert document["charts"]["compiled"] == 3
    target = next(test for test in document["tests"] if test["name"] == "b/target.scxml")
    assert (target["read"], target["chart"], target["compiled"]) == (True, False, False)
    assert execute(["conformance", str(folder / "a"), "--quiet"]) == 0
    assert capsys.readouterr().out.startswith("charts: 3 files")


REPLACED = {
    '<transition cond="nosuch" target="s"/>': "a name, state or operation that is not there",
    "<onentry><script>a.b(1)</script></onentry>": "a call on an object",
    '<onentry><send event="e" target="#_b"/></onentry>': "a target that nothing is reached under",
    '<onentry><send event="e" type="DOM"/></onentry>': (
        "a service, processor or chart that is not there"
    ),
    '<invoke src="absent.scxml"/>': "a service, processor or chart that is not there",
    '<onentry><assign name="x"/></onentry>': (
        "an element without what SCXML demands, or of no SCXML"
    ),
    "<onentry><vendor/></onentry>": "an element without what SCXML demands, or of no SCXML",
    "<onentry><script>for (;;) {}</script></onentry>": "a function, loop, class or module",
    '<transition cond="{" target="s"/>': "an object or a list that grows",
    '<transition event="e" cond="_event.data == _event.data" target="s"/>': (
        "`_event.data` as a whole"
    ),
    '<transition cond="n[0] == 1" target="s"/>': "an object or a list that grows",
    '<transition event="e" cond="_event.invokeid == 1" target="s"/>': "`_event.type` and its like",
    '<onentry><send event="f"><param name="b" expr="1"/></send></onentry>'
    '<transition event="f" cond="_event.data.a == 1"/>': "a field that the event does not have",
    "<onentry><script>text = text + n</script></onentry>": "strings joined at run time",
    '<transition cond="Math.pow(n, d) == 0" target="s"/>': "`Math`",
    '<transition cond="text == n" target="s"/>': "types that do not agree",
    "<onentry><script>n; n = 1</script></onentry>": "text of another language, or broken",
    '<transition cond="n ==" target="s"/>': "text of another language, or broken",
}


DATA = (
    '<datamodel><data id="n" expr="1"/><data id="text" expr="\'a\'"/><data id="d" expr="0.5"/>'
    "</datamodel>"
)


def test_each_cause_has_an_example() -> None:
    """A message in other words than the pattern of its cause would be counted as `other`."""
    assert set(REPLACED.values()) == set(CAUSES)


@pytest.mark.cc
@pytest.mark.parametrize(("inside", "cause"), REPLACED.items())
def test_a_place_that_is_an_error_has_a_cause(tmp_path: Path, inside: str, cause: str) -> None:
    path = tmp_path / "a.scxml"
    path.write_text(f'{HEAD}>{DATA}<state id="s">{inside}</state></scxml>', encoding="utf-8")
    reading = read_chart(path, "a", 20)
    assert set(reading.causes) == {cause}
    kept = meaning([reading, Reading("b", Stage.CHART, 0, ""), Reading("c", Stage.READ, 0, "x")])
    assert (kept.files, kept.kept, kept.places) == (3, 1, len(reading.causes))
    assert {one.name for one in kept.causes} == {cause, REFUSED}
