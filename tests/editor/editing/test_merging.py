"""Merges of two versions of a chart: results, conflicts, comments, and git's driver."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from devtools.edits import sources
from devtools.merges import Tally, check_triple, checked
from devtools.random_charts.choices import SeededChoices
from fsmkit.cli import execute
from fsmkit.diagnostics import Source
from fsmkit.document.document import Kind, Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.applying import read
from fsmkit.editor.editing.merging import MergedText, merge_texts
from fsmkit.scxml.writer import write_document as write_scxml
from tests.editor.editing.test_edits import GATE, edited

pytestmark = pytest.mark.cc  # lines are merged by git


def merge(ours: str, theirs: str, base: str = GATE, name: str = "gate.yaml") -> MergedText:
    old, here, there = (Source(name, text) for text in (base, ours, theirs))
    return merge_texts(old, here, there, checked)


@pytest.fixture(autouse=True)
def _git() -> None:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")


def test_random_triples_have_both_changes_or_a_conflict() -> None:
    tally = Tally()
    for seed in range(4):
        for source in sources(f"merge {seed}"):
            check_triple(source, SeededChoices(f"merge {seed} {source.name}"), tally)
    assert tally.problems == []
    assert tally.merged > 3


MERGED: list[tuple[list[op.Operation], list[op.Operation]]] = [
    ([op.SetGuard("closed", 0, "1 < 2")], [op.SetTarget("closed", 0, ("open",))]),
    ([op.SetGuard("closed", 0, "1 < 2")], [op.RenameSymbol("state", "opening", "raising")]),
    ([op.Declare("in", "go")], [op.Declare("in", "halt")]),
    ([op.AddState("", "a")], [op.AddState("", "b"), op.AddTransition("b", ("closed",))]),
    ([op.RemoveTransition("open", 0)], [op.SetKey("open", "doc", ("Stays.",))]),
    ([op.WrapInState(("opening", "open"), "busy")], [op.SetHandler("open", "exit", ("motor(0)",))]),
    ([op.MoveState("open", "opening")], [op.SetGuard("open", 0, "1 < 2")]),
    ([op.SetKind("stuck", Kind.ATOMIC)], [op.AddTransition("closed", ("stuck",))]),
    ([op.RenameSymbol("event", "request", "ring")],
     [op.AddTransition("open", ("opening",), Trigger.EVENT, "request")]),
    ([op.SetDelay("open", 0, "5s")], [op.SetDelay("open", 0, "5s")]),
    ([op.SetInitial("", ("open",))], [op.RemoveDeclaration("out", "opened"),
                                      op.SetContent("opening", 0, "")]),
]  # fmt: skip


@pytest.mark.parametrize(("ours", "theirs"), MERGED)
@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_the_result_has_both_changes(
    ours: list[op.Operation], theirs: list[op.Operation], notation: str
) -> None:
    base = GATE if notation == "yaml" else write_scxml(read(Source("gate", GATE)))
    name = f"gate.{notation}"
    for one, other in ((ours, theirs), (theirs, ours)):
        mine, other_text = (edited(base, *each, name=name) for each in (one, other))
        found = merge(mine, other_text, base, name)
        assert found.conflicts == ()
        assert found.is_by_meaning
        after = [each for each in other if each not in one]
        renamed = sorted(after, key=lambda each: isinstance(each, op.RenameSymbol))
        names = [each for each in one if isinstance(each, op.RenameSymbol)]
        if names:  # the other version used the old names
            expected = edited(base, *renamed, name=name)
            expected = edited(expected, *one, name=name)
        else:
            expected = edited(mine, *renamed, name=name)
        assert read(Source(name, found.text)) == read(Source(name, expected))


CONFLICTS: list[tuple[op.Operation, op.Operation, str, str]] = [
    (op.SetDelay("open", 0, "5s"), op.SetDelay("open", 0, "7s"),
     "trigger of the transition `after 3s` of state `open` was changed differently", "both"),
    (op.SetGuard("closed", 0, "1 < 2"), op.RemoveTransition("closed", 0),
     "was changed in ours and removed in theirs", "ours base"),
    (op.RemoveState("open"), op.SetHandler("open", "exit", ("motor(0)",)),
     "state `open` was removed in ours and changed in theirs", "theirs base"),
    (op.RemoveState("stuck"), op.AddTransition("closed", ("stuck",), Trigger.EVENT, "limit"),
     "state `stuck` is a target, and the other version removed it", "theirs base"),
    (op.AddState("open", "inner"), op.RemoveState("open"),
     "is in state `open`, which the other version removed", "ours base"),
    (op.AddState("", "new"), op.AddState("closed", "new"),
     "both versions added state `new` differently", "both"),
    (op.Declare("constants", "N", "1"), op.Declare("constants", "N", "2"),
     "both versions added constant `N` differently", "both"),
    (op.Declare("constants", "N", "1"), op.Declare("inputs", "N", "bool"),
     "`N` is a new constant in ours and a new input in theirs", "both"),
    (op.MoveState("open", "closed"), op.MoveState("open", "opening"),
     "state `open` was moved to different states", "both"),
    (op.MoveState("open", "opening"), op.MoveState("opening", "open"),
     "would be inside itself", "both"),
    (op.AddTransition("open", ("closed",), Trigger.EVENT, "limit"),
     op.AddTransition("open", ("stuck",), Trigger.EVENT, "limit"),
     "both versions added the transition `limit` of state `open` differently", "both"),
    (op.SetKind("stuck", Kind.PARALLEL), op.SetKind("stuck", Kind.SHALLOW_HISTORY),
     "the kind of state `stuck` was changed differently", "both"),
    (op.SetInitial("", ("open",)), op.SetInitial("", ("opening",)),
     "the initial state of the chart was changed differently", "both"),
    (op.RemoveDeclaration("in", "request"), op.SetTarget("opening", 0, ("closed",)),
     "the merged file is wrong", ""),
]  # fmt: skip
"""The operations of ours and theirs, the message, and the versions that it locates."""


@pytest.mark.parametrize(("ours", "theirs", "message", "located"), CONFLICTS)
@pytest.mark.parametrize("notation", ["yaml", "scxml"])
def test_changes_that_exclude_each_other_are_conflicts(
    ours: op.Operation, theirs: op.Operation, message: str, located: str, notation: str
) -> None:
    base = GATE if notation == "yaml" else write_scxml(read(Source("gate", GATE)))
    name = f"gate.{notation}"
    if message == "the merged file is wrong":
        base = edited(base, op.RemoveTransition("closed", 0), name=name)
        theirs = op.AddTransition("closed", ("open",), Trigger.EVENT, "request")
    found = merge(edited(base, ours, name=name), edited(base, theirs, name=name), base, name)
    conflict = next(one for one in found.conflicts if message in one.message)
    labels = [conflict.primary, *conflict.secondary]
    if located:
        wanted = ["ours", "theirs"] if located == "both" else located.split()
        assert [one.text for one in labels if one is not None] == wanted
    assert found.text.count("<<<<<<< ours\n") >= 1
    assert found.text.count(">>>>>>> theirs\n") == found.text.count("<<<<<<< ours\n")


def test_comments_of_both_versions_stay_where_the_lines_conflict() -> None:
    ours = GATE.replace("closed  # no longer", "{target: closed, if: 1 < 2}  # ours")
    theirs = GATE.replace("      3s: closed  # no longer", "      # because\n      4s: closed")
    found = merge(ours, theirs)
    assert found.conflicts == ()
    assert "4s: {target: closed, if: 1 < 2}" in found.text
    assert found.text.count("# ours") == found.text.count("# because") == 1
    assert "# no longer" not in found.text
    xml = [write_scxml(read(Source("gate", text))) for text in (GATE, ours, theirs)]
    xml[2] = xml[2].replace("<transition fk:after", "<!-- because -->\n    <transition fk:after")
    found = merge(xml[1], xml[2], xml[0], "gate.scxml")
    assert found.conflicts == ()
    assert found.text.count("<!-- because -->") == 2


def test_two_identical_changes_and_none() -> None:
    ours = edited(GATE, op.AddState("", "new"))
    assert merge(ours, ours).text == ours
    assert merge(GATE, ours).text == ours
    assert merge(ours, GATE).text == ours


@pytest.mark.parametrize(
    ("base", "ours", "theirs", "is_merged"),
    [
        ("a\nb\nc\nd\n", "a2\nb\nc\nd\n", "a\nb\nc\nd2\n", True),
        ("a\n", "b\n", "c\n", False),
        ("", GATE, GATE.replace("10s", "12s"), False),
        ("chart: [\n", GATE, GATE.replace("10s", "12s"), False),
        (GATE, GATE + "\t", GATE.replace("10s", "12s"), True),
    ],
    ids=["text", "text conflict", "no base", "broken base", "broken version"],
)
def test_what_is_no_chart_is_merged_by_its_lines(
    base: str, ours: str, theirs: str, *, is_merged: bool
) -> None:
    found = merge(ours, theirs, base)
    assert not found.is_by_meaning
    assert (not found.conflicts) == is_merged


# --- the verb, and git ----------------------------------------------------------------------------


def test_the_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [tmp_path / f"{name}.yaml" for name in ("base", "ours", "theirs")]
    ours = edited(GATE, op.SetGuard("closed", 0, "1 < 2")).replace("\n", "\r\n")
    theirs = edited(GATE, op.SetTarget("closed", 0, ("open",)))
    for path, text in zip(paths, (GATE, ours, theirs), strict=True):
        path.write_bytes(text.encode())
    names = [*map(str, paths)]
    assert execute(["merge", *names]) == 0
    line = "on: {request: {if: 1 < 2, target: open}}   # somebody rings"
    assert line in capsys.readouterr().out
    assert execute(["merge", *names, "--out", names[1], "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["merged"], document["by"], document["files"]) == (True, "meaning", names[1:2])
    merged = paths[1].read_bytes()
    assert merged.count(b"\r\n") == merged.count(b"\n")
    paths[2].write_text(edited(GATE, op.RemoveTransition("closed", 0)))
    assert execute(["merge", *names]) == 1
    captured = capsys.readouterr()
    assert "<<<<<<< ours" in captured.out
    assert "changed in ours and removed in theirs" in captured.err
    assert execute(["merge", *names, "--draw", "x.png"]) == 2
    paths[2].write_bytes(b"a\0b")
    assert execute(["merge", *names]) == 1
    assert "merge-conflict" in capsys.readouterr().err


def git(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    who = ("-c", "user.email=a@example.org", "-c", "user.name=A")
    return subprocess.run(
        ["git", *who, *arguments], cwd=folder, check=False, capture_output=True, text=True
    )


def test_git_calls_it_as_a_merge_driver(tmp_path: Path) -> None:
    """A derived chart is merged beside its base; a conflict leaves an unmerged file."""
    git(tmp_path, "init", "-q", "-b", "main")
    command = f"'{sys.executable}' -m fsmkit merge %O %A %B --out %A --path %P --marker-size %L"
    git(tmp_path, "config", "merge.fsmkit.driver", command)
    (tmp_path / ".gitattributes").write_text("*.yaml merge=fsmkit\n")
    (tmp_path / "base.yaml").write_text(GATE)
    own = "chart: Own\nextends: base.yaml\ndata: {n: 0..9 = 0}\nrefine:\n  open: {rest: true}\n"
    path = tmp_path / "own.yaml"

    def commit(text: str, *branch: str) -> None:
        if branch:
            git(tmp_path, "checkout", "-q", *branch)
        path.write_text(text)
        git(tmp_path, "add", "-A")
        assert git(tmp_path, "commit", "-qm", "one").returncode == 0

    commit(own)
    commit(own.replace("data: {", "data: {m: 0..9 = 0, "), "-b", "theirs")
    commit(
        own.replace("= 0}", "= 0, o: 0..9 = 1}").replace("true}", "true, doc: It rests.}"), "main"
    )
    done = git(tmp_path, "merge", "theirs", "-m", "both")
    assert done.returncode == 0, done.stderr + done.stdout
    text = path.read_text()
    assert "data: {m: 0..9 = 0, n: 0..9 = 0, o: 0..9 = 1}" in text
    assert "doc: It rests." in text
    commit(text.replace("o: 0..9 = 1", "o: 0..9 = 2"), "-b", "other")
    commit(text.replace("o: 0..9 = 1", "o: 0..9 = 3"), "main")
    done = git(tmp_path, "merge", "other")
    assert done.returncode == 1
    assert "variable `o` was changed differently" in done.stderr + done.stdout
    assert git(tmp_path, "status", "--short").stdout == "UU own.yaml\n"
    assert "<<<<<<< ours" in path.read_text()
