"""The matrix from requirements to evidence, as the verb prints and writes it."""

from __future__ import annotations

import csv
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from fsmkit.cli import execute
from fsmkit.testing.requirements.reading import read_file

ROOT = Path(__file__).parents[3]
CELL = ROOT / "machines" / "production_cell"
GATE = """\
chart: Gate
req: SYS-1
inputs: {train: bool}
operations: [bell(): {req: SYS-2}]
events: {in: [request]}
properties:
  shut: {never: In(open) and train and not train, req: [SAFE-1, GONE-7]}
  opens: {reachable: In(open)}
initial: closed
states:
  closed: {rest: true, req: FUN-1, on: {request: {if: not train, target: open, req: FUN-1}}}
  open: {on: {request: {target: closed, req: FUN-1}}, entry: bell()}
"""
TESTS = """\
tests: Gate
chart: gate.yaml
before: [set train false]
cases:
  opens: {req: FUN-1, steps: [post request, {expect: {in: open}}]}
  fails: {req: FUN-2, steps: [post request, {expect: {in: closed}}]}
"""
TABLE = """\
id,text,kind
SYS-1,A gate.,system
SYS-2,A bell rings.,system
SAFE-1,It is never open while a train passes.,safety
FUN-1,It opens on request.,function
FUN-2,"It stays closed, sometimes.",function
"""


@pytest.fixture
def gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in (("gate.yaml", GATE), ("gate.test.yaml", TESTS), ("r.csv", TABLE)):
        (tmp_path / name).write_text(text)
    verdicts = [{"name": name, "kind": "", "verdict": "holds"} for name in ("shut", "opens")]
    (tmp_path / "report.json").write_text(json.dumps({"properties": verdicts}))
    monkeypatch.chdir(tmp_path)
    return tmp_path


RUN = ("trace-requirements", "gate.yaml", "-r", "r.csv", "--checked", "report.json")


def traced(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, dict[str, Any]]:
    code = execute([*RUN, "--json", *words])
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, dict)
    return code, found


def test_the_matrix_has_items_properties_tests_and_coverage(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, found = traced(capsys, "--tests", ".")
    assert code == 1
    rows = {row["id"]: row for row in found["requirements"]}
    assert {id_: row["status"] for id_, row in rows.items()} == {
        "SYS-1": "open", "SYS-2": "open", "SAFE-1": "verified", "FUN-1": "verified",
        "FUN-2": "failed",
    }  # fmt: skip
    assert [(i["kind"], i["name"], i.get("covered")) for i in rows["FUN-1"]["items"]] == [
        ("state", "closed", True),
        ("transition", "closed on request -> open", True),
        ("transition", "open on request -> closed", False),
    ]
    assert rows["FUN-1"]["coverage"] == {"covered": 2, "all": 3}
    assert [i["kind"] for i in rows["SYS-2"]["items"]] == ["operation"]
    assert [i["at"]["line"] for i in rows["FUN-1"]["items"]] == [11, 11, 12]
    assert rows["SAFE-1"]["properties"][0]["verdict"] == "holds"
    assert [unknown["id"] for unknown in found["unknown"]] == ["GONE-7"]
    rules = [one["rule"] for one in found["findings"]]
    assert sorted(rules) == ["unknown-requirement", "untested-requirement", "untested-requirement"]
    (gone,) = (one for one in found["findings"] if one["rule"] == "unknown-requirement")
    assert (gone["at"]["line"], gone["at"]["column"]) == (7, 65)
    assert gate


@pytest.mark.usefixtures("gate")
def test_results_of_other_tests_are_traced(capsys: pytest.CaptureFixture[str]) -> None:
    cases = (("opens", "FUN-1", ""), ("stays", "FUN-2", "<failure/>"), ("odd", "GONE-8", ""))
    written = "".join(
        f'<testcase name="{name}"><properties><property name="req" value="{id_}"/></properties>'
        f"{more}</testcase>"
        for name, id_, more in cases
    )
    Path("results.xml").write_text(f"<testsuites>{written}</testsuites>")
    code, found = traced(capsys, "--tests", "results.xml")
    assert code == 1
    tests = {
        row["id"]: [(one["case"], one["passed"]) for one in row["tests"]] for row in rows(found)
    }
    assert (tests["FUN-1"], tests["FUN-2"]) == ([("opens", True)], [("stays", False)])
    assert [one["id"] for one in found["unknown"]] == ["GONE-7", "GONE-8"]
    code, found = traced(capsys, "--tests", "results.xml", "--tests", "gate.test.yaml")
    assert [len(row["tests"]) for row in rows(found) if row["id"] == "FUN-1"] == [2]


def rows(found: dict[str, Any]) -> list[dict[str, Any]]:
    listed: list[dict[str, Any]] = found["requirements"]
    return listed


@pytest.mark.usefixtures("gate")
def test_strict_reports_properties_without_a_requirement(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, found = traced(capsys, "--strict", "--where", "kind=safety")
    rules = [(one["rule"], one["message"]) for one in found["findings"]]
    assert ("unrequired-property", "the property `opens` names no requirement") in rules
    assert [row["id"] for row in found["requirements"]] == ["SAFE-1"]
    assert [unknown["id"] for unknown in found["unknown"]] == ["GONE-7"]
    code, _ = traced(
        capsys, "--where", "kind=safety", "--allow", "unknown-requirement"
    )  # nothing is left
    assert code == 0


@pytest.mark.usefixtures("gate")
@pytest.mark.parametrize(
    ("verdicts", "status"),
    [
        ({"shut": "violated", "opens": "holds"}, "failed"),
        ({"shut": "undecided", "opens": "holds"}, "undecided"),
        ({"opens": "holds"}, "undecided"),
        ({"shut": "holds", "opens": "holds", "more": "violated"}, "verified"),
    ],
)
def test_verdicts_of_a_report(
    verdicts: dict[str, str], status: str, capsys: pytest.CaptureFixture[str]
) -> None:
    properties = [{"name": name, "verdict": verdict} for name, verdict in verdicts.items()]
    for document in (
        {"properties": properties},
        {"code": 0, "files": [{"file": "gate.yaml", "properties": properties}]},
    ):
        Path("report.json").write_text(json.dumps(document))
        code, found = traced(capsys, "--where", "kind=safety", "--allow", "unknown-requirement")
        assert [row["status"] for row in found["requirements"]] == [status]
        assert code == (status != "verified")


@pytest.mark.usefixtures("gate")
@pytest.mark.parametrize("text", ["", "[1]", '{"a": 1}', '{"properties": [1]}', "[" * 100_000])
@pytest.mark.parametrize("option", ["--checked", "--certificate"])
def test_broken_evidence_is_a_finding(
    text: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("broken.json").write_text(text)
    assert execute([*RUN, option, "broken.json"]) == 1
    rule = {"--checked": "broken-report", "--certificate": "broken-certificate"}[option]
    error = capsys.readouterr().err
    assert f"{rule}: `broken.json` is not" in error
    assert "--> broken.json:1:1" in error


def certificate(**more: object) -> dict[str, object]:
    return {
        "chart": "Gate", "target": "cortex-m0", "compiler": "gcc 13 -Os", "result": "complete",
        "steps": 12, "differences": [], **more,
    }  # fmt: skip


@pytest.mark.usefixtures("gate")
def test_a_certificate_belongs_to_the_rows_of_its_chart(
    capsys: pytest.CaptureFixture[str],
) -> None:
    from fsmkit.chart.loading import load
    from fsmkit.plan.fingerprint import fingerprint

    own = certificate(fingerprint=fingerprint(load("gate.yaml")))
    other = certificate(fingerprint="0" * 64)
    for name, document in (("own.json", own), ("other.json", other)):
        Path(name).write_text(json.dumps(document))
    words = ("--certificate", "own.json", "--certificate", "other.json")
    _, found = traced(capsys, *words)
    shown = {row["id"]: [c["file"] for c in row["certificates"]] for row in found["requirements"]}
    assert shown == {
        "SYS-1": ["own.json"], "SYS-2": ["own.json"], "SAFE-1": [], "FUN-1": ["own.json"],
        "FUN-2": [],
    }  # fmt: skip


def test_the_matrix_of_the_cell_is_equal_from_all_formats(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "report.json"
    names = ("P2", "P2_press", "P3", "H3", "D", "produces")
    verdicts = [{"name": name, "verdict": "holds"} for name in names]
    report.write_text(json.dumps({"properties": verdicts}))
    tables = []
    for name in ("cell.csv", "cell.reqif", "needs.json"):
        out = tmp_path / "matrix.csv"
        words = ["trace-requirements", str(CELL / "cell.yaml"), "--checked", str(report)]
        words += ["-r", str(CELL / "requirements" / name), "--csv", str(out), "--strict"]
        assert execute([*words, "--tests", str(CELL / "tests")]) == 0
        tables.append(out.read_text())
    assert tables[0] == tables[1] == tables[2]
    rows = [*csv.DictReader(tables[0].splitlines())]
    assert [row["status"] for row in rows] == ["verified"] * 9
    assert capsys.readouterr().err.count("CELL-") == 0


HOSTILE = (
    "<script>alert(1)</script>", "'\"><img src=x onerror=alert(1)>", "--><b>", "=cmd|' /C calc'!A0",
    "@SUM(A1)", "</style><svg onload=x>", "\u202eevil", "a&amp;b", "{{x}}", "+1", "javascript:x",
)  # fmt: skip


class Page(HTMLParser):
    """The elements, attributes and texts of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_hostile_texts_stay_texts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    cases = {
        f"case {text}": {"req": [text, f"lost {text}"], "steps": [{"expect": {"in": "a"}}]}
        for text in HOSTILE
    }
    chart = {
        "chart": "Hostile", "req": [*HOSTILE], "initial": "a", "events": {"in": ["e"]},
        "properties": {t: {"reachable": "In(a)", "req": [t]} for t in HOSTILE},
        "states": {"a": {"rest": "true", "req": [*HOSTILE]}},
    }  # fmt: skip
    suite = {"tests": "T", "chart": "h.yaml", "cases": cases}
    Path("h.yaml").write_text(json.dumps(chart))
    Path("h.test.yaml").write_text(json.dumps(suite))
    with Path("r.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("id", "text"), *((text, f"says {text}") for text in HOSTILE)])
    words = ["trace-requirements", "h.yaml", "-r", "r.csv", "--tests", ".", "--engine", "python"]
    code = execute([*words, "--html", "m.html", "--csv", "m.csv", "--needs", "needs.json"])
    assert code == 1
    assert "has a bug" not in capsys.readouterr().err
    page = Page()
    page.feed(Path("m.html").read_text())
    assert page.tags <= {
        "html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "div", "span", "b", "ul",
        "li", "table", "thead", "tbody", "tr", "th", "td", "code",
    }  # fmt: skip
    assert not {name for name in page.attributes if name.startswith("on") or name == "src"}
    texts = " ".join(page.text)
    for text in HOSTILE:
        assert "".join(c if c.isprintable() else " " for c in f"says {text}") in texts
    with Path("m.csv").open(newline="") as file:
        cells = [cell for row in csv.reader(file) for cell in row]
    assert not [cell for cell in cells if cell[:1] in ("=", "+", "-", "@")]
    again = read_file(Path("needs.json"))
    assert (str(again[0].id), str(again[0].text)) == (HOSTILE[0], f"says {HOSTILE[0]}")
    assert len(again) == len(HOSTILE)
