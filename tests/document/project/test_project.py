"""The project file: which one counts, what it says, and what is wrong in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsmkit.chart.loading import load
from fsmkit.cli import execute
from fsmkit.diagnostics import Findings, FsmkitError
from fsmkit.document.project import project_of
from fsmkit.document.project.project import read_project

BASE = "chart: Base\nevents: {in: [go]}\ninitial: a\nstates: {a: {on: {go: a}}}\n"
DERIVED = "chart: D\nextends: base.yaml\n"
UNREAD = BASE.replace("events", "data: {n: 0..9 = 0}\nevents")


def test_the_nearest_file_counts(tmp_path: Path) -> None:
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    (tmp_path / "fsmkit.toml").write_text('exclude = ["x"]\n')
    (tmp_path / "pyproject.toml").write_text('[tool.fsmkit]\nexclude = ["y"]\n')
    found = project_of(inner / "chart.yaml")
    assert found is not None
    assert found.exclude == ("x",)
    (tmp_path / "a" / "pyproject.toml").write_text("[project]\nname = 'a'\n")
    assert project_of(inner / "chart.yaml") == found
    (tmp_path / "a" / "pyproject.toml").write_text('[tool.fsmkit]\nexclude = ["zz"]\n')
    nearer = project_of(inner / "chart.yaml")
    assert nearer is not None
    assert nearer.exclude == ("zz",)


def test_charts_are_found_where_the_project_searches(tmp_path: Path) -> None:
    for folder in ("charts", "own"):
        (tmp_path / folder).mkdir()
    (tmp_path / "charts" / "base.yaml").write_text(BASE)
    (tmp_path / "own" / "d.yaml").write_text(DERIVED)
    with pytest.raises(FsmkitError):
        load(tmp_path / "own" / "d.yaml")
    (tmp_path / "fsmkit.toml").write_text('search = ["nowhere", "charts"]\n')
    assert [state.id for state in load(tmp_path / "own" / "d.yaml").states[1:]] == ["a"]
    (tmp_path / "own" / "base.yaml").write_text(
        BASE.replace("a: {on", "b: {on").replace(": a", ": b")
    )
    assert [state.id for state in load(tmp_path / "own" / "d.yaml").states[1:]] == ["b"]


def test_systems_and_invoked_charts_are_found_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "charts").mkdir()
    (tmp_path / "charts" / "base.yaml").write_text(BASE)
    (tmp_path / "fsmkit.toml").write_text('search = ["charts"]\n')
    (tmp_path / "s.yaml").write_text("system: S\nmachines: {a: base.yaml, b: {chart: base.yaml}}\n")
    (tmp_path / "i.yaml").write_text(
        "chart: I\ninitial: a\nstates: {a: {invoke: {src: base.yaml}}}\n"
    )
    assert execute(["show", str(tmp_path / "s.yaml")]) == 0
    assert execute(["show", str(tmp_path / "i.yaml")]) == 0
    capsys.readouterr()


def test_levels_of_rules_count_unless_options_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(UNREAD)
    verb = ["compile", str(file), "--out", str(tmp_path / "out")]
    for level, code, told in (
        ("off", 0, ""),
        ("note", 0, "note[FK0354]"),
        ("warning", 0, "warning[FK0354]"),
        ("error", 1, "error[FK0354]"),
    ):
        (tmp_path / "fsmkit.toml").write_text(f'[rules]\nunread-data = "{level}"\n')
        assert execute(verb) == code
        printed = capsys.readouterr().err
        assert told in printed
        assert ("FK0354" in printed) == bool(told)
    assert execute([*verb, "--allow", "unread-data"]) == 0
    (tmp_path / "fsmkit.toml").write_text('[rules]\nFK0354 = "off"\n')
    assert execute([*verb, "--error", "unread-data"]) == 1


@pytest.mark.cc
def test_defaults_of_verbs_count_unless_options_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.yaml").write_text(BASE)
    (tmp_path / "fsmkit.toml").write_text(
        '[compile]\ntarget = "python"\nout = "made"\n[check]\nmemory = "64K"\n'
    )
    assert execute(["compile", str(tmp_path / "a.yaml")]) == 0
    assert [file.suffix for file in (tmp_path / "made").iterdir()] == [".py"]
    assert execute(["compile", str(tmp_path / "a.yaml"), "-t", "c", "-o", str(tmp_path / "c")]) == 0
    assert (tmp_path / "c" / "base.c").is_file()
    capsys.readouterr()
    assert execute(["check", str(tmp_path / "a.yaml")]) == 1
    assert execute(["check", str(tmp_path / "a.yaml"), "--memory", "1G"]) == 0
    (tmp_path / "fsmkit.toml").write_text('[compile]\ntarget = "pyhton"\n')
    assert execute(["compile", str(tmp_path / "a.yaml")]) == 2
    assert "did you mean `python`?" in capsys.readouterr().err


def test_excluded_files_are_not_searched(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "old" / "x").mkdir(parents=True)
    for name in ("a.yaml", "b.yaml", "old/c.yaml", "old/x/d.yaml"):
        (tmp_path / name).write_text(BASE.replace("chart: ", "chart:  "))
    (tmp_path / "fsmkit.toml").write_text('exclude = ["old/", "b*.yaml"]\n')
    assert execute(["fmt", "--check", str(tmp_path)]) == 1
    assert capsys.readouterr().out.split("\n")[0] == f"would change {tmp_path / 'a.yaml'}"
    assert execute(["fmt", "--check", str(tmp_path / "b.yaml")]) == 1


# text: (rule, what is told, line)
WRONG = {
    'serach = ["a"]': ("unknown-key", "did you mean `search`?", 1),
    '[check]\n\ntimeuot = "3s"': ("unknown-key", "did you mean `timeout`?", 3),
    '[check]\ntimeout = "soon"': ("broken-project", "`timeout` cannot be `soon`", 2),
    "[check]\ntimeout = 5": ("broken-project", "`timeout` must be a text", 2),
    'memory = "2G"\n[check]\nmemory = "x"': ("unknown-key", "has no key `memory`", 1),
    '[rules]\nunread-dta = "off"': ("unknown-key", "did you mean `unread-data`?", 2),
    '[rules]\nunread-data = "no"': ("broken-project", "off, note, warning or error", 2),
    '[rules]\nunknown-name = "off"': ("broken-project", "is an error, which stays one", 2),
    "search = 3": ("broken-project", "`search` must be a list of paths", 1),
    "rules = 3": ("broken-project", "`rules` must be a table", 1),
    "[tool.fsmkit]\nsearch = []": ("unknown-key", "without `tool.fsmkit`", 1),
    "search = [": ("broken-project", "this is not TOML", 1),
    "a = 1\nb = = 2": ("broken-project", "this is not TOML", 2),
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_a_finding(text: str) -> None:
    rule, message, line = WRONG[text]
    findings = Findings()
    read_project(Path("fsmkit.toml"), text, findings)
    found = next(iter(findings))
    assert found.rule.name == rule
    assert message in f"{found.message} {found.help}"
    assert found.primary is not None
    assert found.primary.span.source.position(found.primary.span.start)[0] == line


def test_a_broken_project_stops_a_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.yaml").write_text(BASE)
    (tmp_path / "fsmkit.toml").write_bytes(b"\xff")
    for verb in ("check", "draw", "fmt"):
        assert execute([verb, str(tmp_path / "a.yaml")]) in (0, 1)
    assert "is not in UTF-8" in capsys.readouterr().err
