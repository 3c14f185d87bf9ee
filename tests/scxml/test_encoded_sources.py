"""A ``src`` is a URI: characters that it encodes are those of the file's name (RFC 3986)."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

import pytest

from fsmkit.chart.loading import load_with_findings
from fsmkit.diagnostics import Findings
from fsmkit.testing.harness.harness import INTERPRETER

NAMES = (
    "child one",
    "a+b",
    "50%",
    "[1]",
    "t\N{LATIN SMALL LETTER U WITH DIAERESIS}r",
    "a%20b",
    "x#y",
)
HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="{}" name="Chart">'


def final(folder: Path, src: str) -> str:
    """Return where a chart ends that uses all kinds of ``src``, and the rules that it breaks."""
    path = folder / "chart.scxml"
    path.write_text(
        f"""{HEAD.format("a")}<datamodel><data id="n" src="{src}.json"/></datamodel>
 <script src="{src}.js"/>
 <state id="a"><invoke id="k" src="file:{src}.scxml"/>
  <transition event="done.invoke.k" cond="n == 8" target="good"/>
  <transition event="*" target="bad"/></state>
 <state id="good"/><state id="bad"/></scxml>""",
        encoding="utf-8",
    )
    chart = load_with_findings(path, Findings())
    return INTERPRETER.run(chart, ("start 0", "run 1"))[-1]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("is_encoded", [True, False])
def test_a_name_is_found_as_written_or_encoded(name: str, is_encoded: bool, tmp_path: Path) -> None:
    for suffix, text in (
        ("json", "7"),
        ("js", "n = n + 1"),
        ("scxml", f'{HEAD.format("f")}<final id="f"/></scxml>'),
    ):
        (tmp_path / f"{name}.{suffix}").write_text(text, encoding="utf-8")
    assert final(tmp_path, quote(name) if is_encoded else name) == "= good"


def test_the_name_as_written_comes_first(tmp_path: Path) -> None:
    for name, number in (("a%20b", 7), ("a b", 1)):
        (tmp_path / f"{name}.json").write_text(str(number))
        (tmp_path / f"{name}.js").write_text("n = n + 1")
        (tmp_path / f"{name}.scxml").write_text(f'{HEAD.format("f")}<final id="f"/></scxml>')
    assert final(tmp_path, "a%20b") == "= good"


@pytest.mark.parametrize(
    "src", ["%2e%2e/child", "..%2Fchild", "%2Fetc%2Fpasswd", "a%00b", "%zz", "%"]
)
def test_what_is_encoded_cannot_leave_the_folder(src: str, tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "child.scxml").write_text(f'{HEAD.format("f")}<final id="f"/></scxml>')
    path = inner / "chart.scxml"
    path.write_text(
        f"""{HEAD.format("a")}<state id="a"><invoke id="k" src="{src}.scxml"/>
  <transition event="done.invoke.k" target="good"/><transition event="error" target="bad"/></state>
 <state id="good"/><state id="bad"/></scxml>"""
    )
    findings = Findings()
    chart = load_with_findings(path, findings)
    assert "unsupported-invoke" in {d.rule.name for d in findings}
    assert INTERPRETER.run(chart, ("start 0", "run 1"))[-1] == "= bad"
