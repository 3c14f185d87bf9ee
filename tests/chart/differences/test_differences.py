"""Charts compared by meaning: each operation is reported as what it is."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from random import Random

import pytest

import fsmkit
from fsmkit.chart.chart import Chart
from fsmkit.chart.differences.compare import differences
from fsmkit.cli import execute
from fsmkit.diagnostics import Source
from fsmkit.diagnostics.fixes import apply_edits
from fsmkit.document.document import Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import apply, read
from fsmkit.scxml.writer import write_document as write_scxml
from tests.inspector.conftest import elaborated

MIXER = """\
chart: Mixer
events: {in: [fill, full, stir, stop, fault, reset, tick], out: [lamp]}
constants: {MOST: 5}
data: {count: 0..10 = 0, turns: 0..9 = 0}
operations: ["valve(open bool)"]
initial: working
states:
  working:
    on: {fault: broken}
    regions:
      tank:
        initial: empty
        states:
          empty: {on: {fill: {target: filling, if: count < MOST}}}
          filling: {on: {full: empty, stop: empty}, entry: count = count + 1}
      motor:
        initial: resting
        states:
          resting: {on: {stir: turning}}
          turning: {on: {stop: resting}, exit: turns = 1}
          worn: {on: {tick: resting}}
  broken: {on: {reset: working}, after: {5s: idle}}
  idle: {on: {reset: {target: working, do: valve(true)}, tick: {do: send lamp}}}
"""
Names = set[tuple[str, str, str]]


def said(kind: str, what: str, name: str) -> Names:
    return {(kind, what, name)}


OPERATIONS: list[tuple[op.Operation, Names]] = [
    (op.AddState("motor", "hot"), said("added", "state", "hot")),
    (op.AddState(op.CHART, "late"), said("added", "state", "late")),
    (op.SetInitial("motor", ("turning",)), said("changed", "state", "motor")),
    (
        op.AddTransition("resting", ("worn",), Trigger.EVENT, "tick"),
        said("added", "transition", "resting --tick--> worn"),
    ),
    (
        op.SetGuard("broken", 0, "count > 3"),
        said("changed", "transition", "broken --reset--> working"),
    ),
    (
        op.SetTarget("filling", 0, ("filling",)),
        said("changed", "transition", "filling --full--> filling"),
    ),
    (
        op.SetContent("idle", 1, "send lamp\ncount = 0"),
        said("changed", "transition", "idle --tick--> (no target)"),
    ),
    (
        op.SetDelay("broken", 1, "7s"),
        said("changed", "transition", "broken --after 7s--> idle"),
    ),
    (op.SetHandler("turning", "entry", ("turns = 2",)), said("changed", "state", "turning")),
    (op.SetKey("empty", "doc", ("Nothing in it.",)), said("changed", "state", "empty")),
    (op.Declare("data", "level", "0..3 = 0"), said("added", "data", "level")),
    (op.Declare("in", "knock", ""), said("added", "event", "knock")),
    (
        op.RemoveTransition("turning", 0),
        said("removed", "transition", "turning --stop--> resting"),
    ),
    (op.RenameSymbol("constant", "MOST", "LIMIT"), said("renamed", "constant", "LIMIT")),
    (op.RenameSymbol("state", "idle", "waiting"), said("renamed", "state", "waiting")),
]
"""Operations that do not meet, each with what is reported."""


def found(old: Chart, new: Chart) -> Names:
    return {(c.kind, c.what, c.name) for c in differences(old, new)}


def applied(text: str, operations: list[op.Operation]) -> str:
    for each in operations:
        source = Source("chart.yaml", text)
        text = apply_edits(text, apply(source, each))
    return text


def renamed(names: Names, operations: list[op.Operation]) -> Names:
    """Return what is reported, with the new names of states in the names of transitions."""
    for each in operations:
        if isinstance(each, op.RenameSymbol) and each.kind == "state":
            names = {
                (kind, what, " ".join(each.new if w == each.name else w for w in name.split(" ")))
                for kind, what, name in names
            }
    return names


@pytest.mark.parametrize(("operation", "names"), OPERATIONS, ids=lambda v: type(v).__name__)
def test_an_operation_is_reported_as_what_it_is(operation: op.Operation, names: Names) -> None:
    old, new = elaborated(MIXER), elaborated(applied(MIXER, [operation]))
    assert found(old, new) == names
    opposite = {"added": "removed", "removed": "added"}
    back = {(opposite.get(kind, kind), what) for kind, what, _ in names}
    assert {(kind, what) for kind, what, _ in found(new, old)} == back


@pytest.mark.slow
def test_several_operations_are_reported_and_nothing_else() -> None:
    random = Random(7)
    old = elaborated(MIXER)
    for _ in range(40):
        chosen = random.sample(OPERATIONS, random.randrange(1, 8))
        operations = [operation for operation, _ in chosen]
        operations.sort(key=lambda each: isinstance(each, op.RenameSymbol))
        names = set().union(*(names for _, names in chosen))
        new = elaborated(applied(MIXER, operations))
        assert found(old, new) == renamed(names, operations), operations


MOVED = [
    ("  idle: {on", "  empty2: {}\n  idle: {on", said("added", "state", "empty2")),
    (
        "          worn: {on: {tick: resting}}\n  broken:",
        "  worn: {on: {tick: resting}}\n  broken:",
        said("moved", "state", "worn"),
    ),
    (
        "{on: {full: empty, stop: empty}",
        "{on: {stop: empty, full: empty}",
        said("moved", "transition", "filling --stop--> empty"),
    ),
    (
        "worn: {on: {tick: resting}}",
        "worn: {}",
        said("removed", "transition", "worn --tick--> resting"),
    ),
    (
        "worn: {on: {tick: resting}}",
        "worn: {on: {tick: resting}, rest: true}",
        said("changed", "state", "worn"),
    ),
    ("count: 0..10 = 0", "count: 0..11 = 0", said("changed", "data", "count")),
    ("chart: Mixer", "chart: Blender", said("changed", "chart", "Blender")),
    ("chart: Mixer", "chart: Mixer\ncapacity: {queue: 3}", said("changed", "chart", "Mixer")),
]


@pytest.mark.parametrize(("before", "after", "names"), MOVED)
def test_changes_of_the_text(before: str, after: str, names: Names) -> None:
    assert before in MIXER
    assert found(elaborated(MIXER), elaborated(MIXER.replace(before, after))) == names


def test_a_transition_that_leaves_another_state_has_moved() -> None:
    text = MIXER.replace("{on: {stop: resting}, exit", "{exit").replace(
        "worn: {on: {tick: resting}}", "worn: {on: {tick: resting, stop: resting}}"
    )
    assert found(elaborated(MIXER), elaborated(text)) == {
        ("moved", "transition", "worn --stop--> resting")
    }


def test_notation_comments_and_layout_do_not_count(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(MIXER.replace("\nstates:", "\n\n# some\nstates:"), "utf-8")
    (tmp_path / "a.scxml").write_text(write_scxml(read(Source("a.yaml", MIXER))), "utf-8")
    old, new = (fsmkit.read_chart(tmp_path / name) for name in ("a.yaml", "a.scxml"))
    assert differences(old, new) == ()


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    new = MIXER.replace("filling", "pouring").replace("count < MOST", "count < 4")
    for name, text in (("old.yaml", MIXER), ("new.yaml", new)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return str(tmp_path / "old.yaml"), str(tmp_path / "new.yaml")


def test_the_verb_prints_sentences(
    files: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["diff", *files]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "= renamed state `pouring` (was `filling`)",
        "~ changed transition `empty --fill--> pouring`: guard `count < MOST` to `count < 4`",
        "2 differences",
    ]  # fmt: skip
    assert execute(["diff", files[0], files[0]]) == 0
    assert capsys.readouterr().out == "no differences\n"


def test_json(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["diff", *files, "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [d["change"] for d in document["differences"]] == ["renamed", "changed"]
    assert document["differences"][1]["new_at"]["line"] == 14


@pytest.mark.external
@pytest.mark.usefixtures("dot")
def test_the_drawing_has_both_charts_in_colours(files: tuple[str, str], tmp_path: Path) -> None:
    out = tmp_path / "d.svg"
    assert execute(["diff", *files, "--draw", str(out)]) == 1
    text = out.read_text("utf-8")
    assert text.count("<svg") == 3
    assert text.count("state own changed") == 2
    ids = re.findall(r' id="((?:old|new)_\w+)"', text)
    assert len(ids) == len(set(ids)) > 10


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["a.yaml"], 2, "compares two files"),
        (["a.yaml", "b.yaml", "c.yaml"], 2, "3 were given"),
        (["--git", "HEAD", "a.yaml", "b.yaml"], 2, "one file with --git"),
        (["a.yaml", "missing.yaml"], 1, "missing.yaml"),
        (["a.yaml", "a.yaml", "--draw", "a.png"], 2, "drawn as `.svg`"),
        (["a.yaml", "b.system.yaml"], 1, "is a system"),
    ],
)
def test_what_goes_wrong(
    arguments: list[str], code: int, text: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text(MIXER, encoding="utf-8")
    (tmp_path / "b.system.yaml").write_text(
        "system: Two\nmachines: {one: a.yaml}\n", encoding="utf-8"
    )
    assert execute(["diff", *arguments]) == code
    assert text in capsys.readouterr().err


def git(folder: Path, *arguments: str) -> str:
    who = ("-c", "user.email=a@example.org", "-c", "user.name=A")
    done = subprocess.run(
        ["git", *who, *arguments], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Return a folder of a repository with a derived chart, both changed since the commit."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    git(tmp_path, "init", "-q")
    folder = tmp_path / "charts"
    folder.mkdir()
    (tmp_path / "base.yaml").write_text(MIXER, encoding="utf-8")
    (folder / "own.yaml").write_text("chart: Own\nextends: ../base.yaml\n", encoding="utf-8")
    (folder / "other.yaml").write_text("a: 1\n", encoding="utf-8")
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "one")
    text = MIXER.replace("count < MOST", "count < 4")
    (tmp_path / "base.yaml").write_text(text, encoding="utf-8")
    own = "chart: Own\nextends: ../base.yaml\ndata: {more: bool = false}\n"
    (folder / "own.yaml").write_text(own, encoding="utf-8")
    (folder / "other.yaml").write_text("a: 2\n", encoding="utf-8")
    return folder


@pytest.mark.cc
def test_a_revision_is_read_with_its_bases(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["diff", "--git", "HEAD", str(repository / "own.yaml")]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "+ added data `more`",
        "~ changed transition `empty --fill--> filling`: guard `count < MOST` to `count < 4`",
        "2 differences",
    ]
    assert execute(["diff", "--git", "HEAD~3", str(repository / "own.yaml")]) == 1
    assert "no-revision" in capsys.readouterr().err
    (repository / "new.yaml").write_text(MIXER, encoding="utf-8")
    assert execute(["diff", "--git", "HEAD", str(repository / "new.yaml")]) == 1
    assert "has no file `charts/new.yaml`" in capsys.readouterr().err
    assert execute(["diff", "--git", "--output=x", str(repository / "own.yaml")]) in (1, 2)
    assert not (repository / "x").exists()


@pytest.mark.cc
def test_git_calls_it_as_a_driver(
    repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(repository.parent)
    old = repository.parent / "blob"
    modes = ("1" * 40, "100644")
    for name in ("own.yaml", "other.yaml"):
        old.write_text(git(repository, "show", f"HEAD:charts/{name}"), encoding="utf-8")
        path = f"charts/{name}"
        assert execute(["diff", path, str(old), *modes, path, *modes]) == 0
    text = capsys.readouterr().out
    assert "+ added data `more`" in text
    assert "not compared by meaning" in text
    assert "-a: 1\n+a: 2" in text
    assert execute(["diff", path, "/dev/null", ".", ".", path, *modes]) == 0
    assert "the file is new" in capsys.readouterr().out
