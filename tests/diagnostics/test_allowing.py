"""Comments that allow a rule: suppressed findings, and findings on comments without effect."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.loading import load_with_findings
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, Source
from fsmkit.diagnostics.allow_comments import allow_comments

CHART = """\
chart: A
data:
  one: 0..9 = 0
  two: 0..9 = 0
events: {in: [go]}
initial: a
states:
  a: {on: {go: {target: a, do: one += 1; two += 1}}}
"""
SCXML = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" xmlns:fk="urn:fsmkit:scxml" version="1.0"
       name="A" datamodel="fsmkit" initial="a">
  <datamodel>
    <data id="one" expr="0" fk:type="0..9"/>
    <data id="two" expr="0" fk:type="0..9"/>
  </datamodel>
  <fk:event direction="in" signature="go"/>
  <state id="a">
    <transition event="go" target="a">
      <assign location="one" expr="one + 1"/>
      <assign location="two" expr="two + 1"/>
    </transition>
  </state>
</scxml>
"""
# what is shown: (file, text, replacement, variables that are still reported)
PLACES = {
    "nothing": ("a.yaml", "chart", "chart", ["one", "two"]),
    "a line": ("a.yaml", "one: 0..9 = 0", "one: 0..9 = 0  # fsmkit: allow unread-data", ["two"]),
    "a code": ("a.yaml", "one: 0..9 = 0", "one: 0..9 = 0  # fsmkit: allow FK0354", ["two"]),
    "a reason": ("a.yaml", "= 0\n", "= 0  # fsmkit: allow unread-data: the host reads it\n", []),
    "an entry": ("a.yaml", "data:", "# fsmkit: allow unread-data\ndata:", []),
    "an inner entry": ("a.yaml", "  two:", "  # fsmkit: allow unread-data\n  two:", ["one"]),
    "a file": ("a.yaml", "chart:", "# fsmkit: allow-file unread-data\n\nchart:", []),
    "a file, too late": (
        "a.yaml", "events:", "# fsmkit: allow-file unread-data\nevents:", ["one", "two"],
    ),
    "another rule": ("a.yaml", "data:", "# fsmkit: allow never-taken\ndata:", ["one", "two"]),
    "two rules": ("a.yaml", "data:", "# fsmkit: allow never-taken, unread-data\ndata:", []),
    "a text": ("a.yaml", "data:", "doc: 'fsmkit: allow unread-data'\ndata:", ["one", "two"]),
    "nothing in XML": ("a.scxml", "<state", "<state", ["one", "two"]),
    "a line of XML": (
        "a.scxml", '"0..9"/>\n    <', '"0..9"/> <!-- fsmkit: allow unread-data -->\n    <', ["two"],
    ),
    "an element": (
        "a.scxml", "<datamodel>", "<!-- fsmkit: allow unread-data -->\n<datamodel>", [],
    ),
    "an empty element": (
        "a.scxml", '<data id="two"', '<!-- fsmkit: allow unread-data -->\n<data id="two"', ["one"],
    ),
    "a file of XML": (
        "a.scxml", "<scxml", "<!-- fsmkit: allow-file unread-data -->\n<scxml", [],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", PLACES)
def test_a_comment_hides_the_findings_of_its_lines(name: str, tmp_path: Path) -> None:
    file, old, new, left = PLACES[name]
    text = SCXML if file.endswith(".scxml") else CHART
    assert old in text
    path = tmp_path / file
    path.write_text(text.replace(old, new))
    findings = Findings()
    load_with_findings(path, findings)
    told = [one.message for one in findings if one.rule.name == "unread-data"]
    assert len(told) == len(left)
    assert all(f"`{variable}`" in message for variable, message in zip(left, told, strict=True))


def test_an_entry_goes_on_to_the_next_one_of_its_column() -> None:
    lines = "# fsmkit: allow a\nx:\n- one\n\n- two: [\n  three\n]\ny: 1\n"
    (found,) = allow_comments(Source("a.yaml", lines))
    assert found.lines == (2, 7)
    items = "x:\n  # fsmkit: allow a\n  - one: 1\n    two: 2\n  - three\n"
    (found,) = allow_comments(Source("a.yaml", items))
    assert found.lines == (3, 4)
    (found,) = allow_comments(Source("a.yaml", "x: 1\n# fsmkit: allow a\n"))
    assert found.lines == (0, -1)
    (found,) = allow_comments(Source("a.scxml", "<a>\n<!-- fsmkit: allow a -->\n</a>"))
    assert found.lines == (0, -1)


# comment above `data:`: the finding on it
UNUSED = {
    "# fsmkit: allow unread-data": None,
    "# fsmkit: allow never-taken": "this comment suppresses no finding of `never-taken`",
    "# fsmkit: allow unread-dat": "did you mean `unread-data`?",
    "# fsmkit: allow unknown-name": "`unknown-name` is an error, and comments allow only",
    "# fsmkit: allow-file unused-event": "this comment covers nothing",
}


@pytest.mark.cc
def test_what_hides_nothing_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.yaml"
    for comment, message in UNUSED.items():
        text = CHART.replace("one += 1; two += 1", "one = 1; two = 1")
        path.write_text(text.replace("data:", f"{comment}\ndata:"))
        assert execute(["check", str(path)]) == 0
        told = capsys.readouterr().err
        assert ("unused-allow" in told) == (message is not None)
        assert (message or "") in told


def test_a_reading_does_not_judge_rules_of_an_exploration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(CHART.replace("data:", "# fsmkit: allow never-taken, unused-event\ndata:"))
    assert execute(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().err
    assert "this comment suppresses no finding of `unused-event`" in told
    assert "no finding of `never-taken`" not in told


def test_an_error_cannot_be_allowed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.yaml"
    text = CHART.replace("initial: a", "initial: b  # fsmkit: allow unknown-name")
    path.write_text(text)
    assert execute(["compile", str(path), "--out", str(tmp_path / "out")]) == 1
    assert "unknown-name" in capsys.readouterr().err
