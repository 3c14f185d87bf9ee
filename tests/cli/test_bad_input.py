"""Bad input through the command line: a diagnostic with its place and a way out, nothing else.

Never a traceback, never half of an output.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest

from fsmkit.cli import execute
from tests.needs import where

HEAD = """\
chart: A
data:
  n: 0..9 = 0
  b: bool = false
events: {in: [go, fault(code 0..3)]}
initial: one
states:
"""
SCXML = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">\n'
BASE = HEAD + "  one: {on: {go: {id: first, target: two}}}\n  two: {rest: true, entry: n = 1}\n"
SYSTEM = "system: S\nmachines: {a: base.yaml}\n"

# What is wrong: the file, its text, the rule, the place (line:column).
CASES: dict[str, tuple[str, str | bytes, str, str]] = {
    # broken XML and YAML
    "xml not closed": ("a.scxml", SCXML + '  <state id="a">\n</scxml>\n', "broken-xml", "3:3"),
    "xml of something else": ("a.scxml", "<project/>\n", "not-scxml", "1:1"),
    "bytes as xml": ("a.scxml", bytes(range(256)), "unknown-encoding", "2:117"),
    "yaml not closed": ("a.yaml", "chart: A\nstates: {a: {\n", "broken-yaml", "3:1"),
    "a tab": ("a.yaml", "chart: A\n\tinitial: a\n", "broken-yaml", "2:1"),
    "a list": ("a.yaml", "- a\n- b\n", "unexpected-shape", "1:1"),
    "nothing": ("a.yaml", "", "empty-file", "1:1"),
    "not UTF-8": ("a.yaml", "chart: A\ndoc: café\n".encode("latin-1"), "invalid-encoding", "2:9"),
    # wrong types
    "number as guard": (
        "a.yaml",
        HEAD + "  one: {on: {go: {target: one, if: n}}}\n",
        "type-mismatch",
        "8:36",
    ),
    "number in a bool": (
        "a.yaml",
        HEAD + "  one: {on: {go: {do: b = 3}}}\n",
        "type-mismatch",
        "8:27",
    ),
    "no such type": (
        "a.yaml",
        "chart: A\ndata: {n: integer = 0}\ninitial: one\nstates: {one: {}}\n",
        "unknown-name",
        "2:11",
    ),
    # unknown and duplicate names, dangling targets
    "unknown variable": (
        "a.yaml",
        HEAD + "  one: {on: {go: {do: m = 3}}}\n",
        "unknown-name",
        "8:23",
    ),
    "unknown event": ("a.yaml", HEAD + "  one: {on: {gone: one}}\n", "unknown-name", "8:14"),
    "unknown key": ("a.yaml", HEAD + "  one: {onn: {go: one}}\n", "unknown-key", "8:9"),
    "two states of a name": (
        "a.yaml",
        HEAD + "  one: {initial: two, states: {two: {}}}\n  two: {}\n",
        "duplicate-state",
        "9:3",
    ),
    "a key twice": ("a.yaml", HEAD + "  one: {}\n  one: {}\n", "duplicate-key", "9:3"),
    "data twice": (
        "a.scxml",
        SCXML + '<datamodel>\n<data id="n" expr="0"/>\n<data id="n" expr="1"/>\n</datamodel>\n'
        '<state id="a"/>\n</scxml>\n',
        "duplicate-name",
        "4:11",
    ),
    "dangling target": ("a.yaml", HEAD + "  one: {on: {go: tow}}\n", "unknown-name", "8:18"),
    "dangling target in xml": (
        "a.scxml",
        SCXML + '<state id="a">\n<transition event="go" target="b"/>\n</state>\n</scxml>\n',
        "unknown-name",
        "3:32",
    ),
    "dangling initial": (
        "a.yaml",
        "chart: A\ninitial: nine\nstates: {one: {}}\n",
        "unknown-name",
        "2:10",
    ),
    # inheritance
    "a chart extends itself": (
        "a.yaml",
        "chart: A\nextends: a.yaml\n",
        "inheritance-cycle",
        "2:10",
    ),
    "a base that is not there": (
        "a.yaml",
        "chart: A\nextends: nowhere.yaml\n",
        "unreadable-file",
        "2:10",
    ),
    "an inherited state again": (
        "a.yaml",
        "chart: A\nextends: base.yaml\nrefine:\n  one: {states: {two: {}}}\n",
        "redefines-inherited",
        "4:18",
    ),
    "a wider range": (
        "a.yaml",
        "chart: A\nextends: base.yaml\ndata:\n  n: 0..20 = 0\n",
        "widened-range",
        "4:3",
    ),
    "content replaced by accident": (
        "a.yaml",
        "chart: A\nextends: base.yaml\nrefine:\n  two: {entry: n = 2}\n",
        "unmarked-override",
        "4:3",
    ),
    "override of nothing": (
        "a.yaml",
        "chart: A\nextends: base.yaml\nrefine:\n  one: {on: {go: {override: second}}}\n",
        "override-of-nothing",
        "4:29",
    ),
    # ranges
    "a start beyond the range": (
        "a.yaml",
        "chart: A\ndata: {n: 0..9 = 12}\ninitial: one\nstates: {one: {}}\n",
        "value-out-of-range",
        "2:18",
    ),
    "a value beyond the range": (
        "a.yaml",
        HEAD + "  one: {on: {go: {do: n = 12}}}\n",
        "value-out-of-range",
        "8:27",
    ),
    "a payload beyond the range": (
        "a.yaml",
        HEAD + "  one: {on: {go: {do: raise fault(code = 9)}}}\n",
        "value-out-of-range",
        "8:42",
    ),
    "a range beyond 64 bits": (
        "a.yaml",
        "chart: A\ndata: {n: 0..99999999999999999999 = 0}\ninitial: one\nstates: {one: {}}\n",
        "integer-too-wide",
        "2:14",
    ),
    "a delay beyond the clock": (
        "a.yaml",
        HEAD + "  one: {after: {2000h: one}}\n",
        "invalid-duration",
        "8:17",
    ),
    "division by zero": (
        "a.yaml",
        HEAD + "  one: {on: {go: {do: n = 3 / 0}}}\n",
        "division-by-zero",
        "8:31",
    ),
    # what a target cannot express
    "abstract": (
        "a.yaml",
        "chart: A\nabstract: true\ninitial: one\nstates: {one: {}}\n",
        "abstract-chart",
        "1:1",
    ),
    "spontaneous": ("a.yaml", HEAD + "  one: {sometimes: [one]}\n", "c-limit", "8:21"),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder to work in, which holds a sound chart `base.yaml` and nothing else."""
    monkeypatch.chdir(tmp_path)
    Path("base.yaml").write_text(BASE, encoding="utf-8")
    return tmp_path


def demand(captured: pytest.CaptureFixture[str], rule: str, place: str = "") -> str:
    """Demand a rendered diagnostic: severity, code and rule, the place, a help; no traceback."""
    told = captured.readouterr()
    assert "Traceback" not in told.out + told.err
    head = rf"^error\[FK0\d\d\d\] {rule}: .+\n"
    where = rf" --> {re.escape(place)}\n(.*\n)*?" if place else r"(.*\n)*?"
    assert re.search(head + where + r"  = help: \S", told.err, re.MULTILINE), told.err
    return told.err


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("name", CASES)
def test_compile_says_what_is_wrong_and_writes_nothing(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, text, rule, place = CASES[name]
    Path(file).write_bytes(text if isinstance(text, bytes) else text.encode())
    before = content(folder)
    assert execute(["compile", file, "--out", "made"]) == 1
    demand(capsys, rule, f"{file}:{place}")
    assert content(folder) == before
    assert not Path("made").exists()


@pytest.mark.parametrize(
    ("path", "rule"),
    [
        ("nowhere.yaml", "unreadable-file"),
        ("folder.yaml", "unreadable-file"),
        ("base.yaml/chart.yaml", "unreadable-file"),
        ("chart.uml", "unknown-suffix"),
        ("chart", "unknown-suffix"),
    ],
)
def test_no_such_file(
    path: str, rule: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "folder.yaml").mkdir()
    assert execute(["compile", path, "--out", "made"]) == 1
    demand(capsys, rule)
    assert not (folder / "made").exists()


@where(os.name == "posix" and os.geteuid() != 0, "root may read everything")
def test_a_file_that_may_not_be_read(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "base.yaml").chmod(0)
    assert execute(["compile", "base.yaml"]) == 1
    demand(capsys, "unreadable-file")


def test_a_cycle_of_two_files_is_told_where_it_closes(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "a.yaml").write_text("chart: A\nextends: b.scxml\n")
    (folder / "b.scxml").write_text(
        SCXML.replace("<scxml", '<scxml xmlns:fk="urn:fsmkit:scxml" fk:extends="a.yaml"')
        + "</scxml>\n"
    )
    assert execute(["compile", "a.yaml"]) == 1
    demand(capsys, "inheritance-cycle", "b.scxml:1:48")


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        ("machines: {a: nowhere.yaml}", "unreadable-file", "2:15"),
        ("machines: {a: base.yaml, b: broken.yaml}", "unexpected-shape", ""),
        ("machines: {a: base.yaml}\nconnect: [a.go -> b.go]", "unknown-name", "3:19"),
        ("machines: {a: base.yaml}\nenvironment: {may: [a.going]}", "unknown-name", "3:23"),
        ("machines: {a: base.yaml}\nproperties: {P: {never: a.m > 1}}", "unknown-name", "3:27"),
        ("machines: {a: base.yaml}\nproperties: {P: {newer: a.n > 1}}", "unknown-name", "3:18"),
        ("machines: {}", "empty-system", "1:9"),
    ],
)
def test_a_wrong_system(
    text: str, rule: str, place: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "broken.yaml").write_text("- 1\n")
    (folder / "s.yaml").write_text(f"system: S\n{text}\n")
    assert execute(["check", "s.yaml", "--engine", "python"]) == 1
    demand(capsys, rule, f"s.yaml:{place}" if place else "")


@pytest.mark.parametrize(
    ("replace", "rule", "code"),
    [("b=base.yaml", "no-such-machine", 2), ("a=nowhere.yaml", "unreadable-file", 1)],
)
def test_a_wrong_replacement(
    replace: str, rule: str, code: int, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "s.yaml").write_text(SYSTEM)
    assert execute(["check", "s.yaml", "--replace", replace]) == code
    demand(capsys, rule)


def test_a_replacement_needs_a_system(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert folder.is_dir()
    assert execute(["check", "base.yaml", "--replace", "a=base.yaml"]) == 2
    demand(capsys, "not-a-system")


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "base.yaml", "--engine", "c"],
        ["run", "base.yaml", "--target", "c", "--events", "go"],
    ],
)
def test_no_c_compiler(
    arguments: list[str],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for variable, value in (("CC", "no-such-compiler"), ("CC", ""), ("PATH", str(folder))):
        monkeypatch.setenv(variable, value)
        if variable == "CC" and not value:
            continue  # without CC the usual names are looked for, on the PATH that follows
        assert execute(arguments) == 1
        demand(capsys, "no-c(-c)?ompiler")


def test_without_a_c_compiler_python_explores(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert folder.is_dir()
    assert execute(["check", "base.yaml"]) == 0
    told = capsys.readouterr()
    assert "no-compiler" in told.err
    assert "interpreter" in told.out


@pytest.mark.parametrize("out", ["base.yaml", "base.yaml/deeper", "/dev/null/made"])
@pytest.mark.parametrize(
    "arguments", [["compile"], ["compile", "--target", "python"], ["draw"], ["check"]]
)
def test_an_output_that_cannot_be_written(
    arguments: list[str], out: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verb, *more = arguments
    option = "--save-trace" if verb == "check" else "--out"
    if verb == "check":
        more = ["--engine", "python"]
        (folder / "s.yaml").write_text(f"{SYSTEM}properties: {{P: {{reachable: a.In(one)}}}}\n")
    before = content(folder)
    place = f"{out}/x.mmd" if verb == "draw" else out
    file = "s.yaml" if verb == "check" else "base.yaml"
    assert execute([verb, file, *more, option, place]) == 1
    assert f" with `{option}`" in demand(capsys, "unwritable-output")
    assert content(folder) == before


def test_an_output_that_is_an_argument(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = content(folder)
    assert execute(["new", "base.yaml/gate.yaml"]) == 1
    assert "choose another place, or" in demand(capsys, "unwritable-output")
    assert content(folder) == before


def test_one_bad_chart_of_a_system_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "bad.yaml").write_text(HEAD.replace("A", "B", 1) + "  one: {sometimes: [one]}\n")
    (folder / "s.yaml").write_text("system: S\nmachines: {a: base.yaml, b: bad.yaml}\n")
    assert execute(["compile", "s.yaml", "--out", "made"]) == 1
    demand(capsys, "c-limit", "bad.yaml:8:21")
    assert not (folder / "made").exists()


def test_old_output_stays_as_it_was(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["compile", "base.yaml", "--out", "made"]) == 0
    (folder / "made" / "fsm.c").unlink()
    (folder / "made" / "fsm.c").mkdir()  # the last file cannot be written
    before = content(folder)
    (folder / "base.yaml").write_text(BASE.replace("n = 1", "n = 2"))
    assert execute(["compile", "base.yaml", "--out", "made"]) == 1
    demand(capsys, "unwritable-output")
    after = content(folder)
    del before["base.yaml"], after["base.yaml"]
    assert after == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["compile"],
        ["compil", "base.yaml"],
        ["compile", "base.yaml", "--prefix", "9"],
        ["check", "base.yaml", "--memory", "lots"],
        ["check", "base.yaml", "--timeout", "soon"],
        ["check", "base.yaml", "--replace", "a"],
        ["check", "base.yaml", "--assume-watchdogs-silent"],
    ],
)
def test_wrong_usage(
    arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert folder.is_dir()
    assert execute(arguments) == 2
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    assert "Error: " in told.err or "error[FK0411]" in told.err


@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        (["check", "nowhere.yaml"], "unreadable-file"),
        (["check", "base.yaml", "--property", "none"], "no-such-property"),
        (["compile", "base.yaml", "--prefix", "texts"], "wrong-option"),
    ],
)
def test_a_refusal_is_json_where_that_is_asked_for(
    arguments: list[str], rule: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert folder.is_dir()
    assert execute([*arguments, "--json"]) != 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "error"
    assert rule in {finding["rule"] for finding in found["findings"]}
