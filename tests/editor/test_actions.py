"""Code actions: names declared, rules allowed, refactorings; each leaves a file that is right."""

from __future__ import annotations

from pathlib import Path
from shutil import copy

import pytest
from lsprotocol import types

from fsmkit.diagnostics import Severity
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.features.actions import code_actions
from fsmkit.editor.features.formatting import formatting
from fsmkit.editor.index.workspace import Workspace

FILES = Path(__file__).parents[1] / "cli" / "mistakes"
GATES = ("gate.yaml", "gate.scxml")


@pytest.fixture
def context(tmp_path: Path) -> Context:
    """Return an editor of a folder with a few charts."""
    folder = tmp_path.resolve()
    for path in FILES.glob("g*.*ml"):
        copy(path, folder)
    workspace = Workspace((folder,))
    return Context(workspace, Analyses(workspace))


def opened(context: Context, file: str, *edits: tuple[str, str]) -> Path:
    """Open a file with other pieces of text."""
    path = context.workspace.folders[0] / file
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    context.workspace.set_text(path, text.encode())
    return path


def offered(context: Context, path: Path, piece: str) -> dict[str, types.CodeAction]:
    """Return the actions at a piece of a text, by title."""
    lines = context.lines(path)
    assert lines is not None
    at = lines.position(lines.text.index(piece) + len(piece) // 2)
    found = code_actions(context, path, types.Range(at, at), None, (), is_requested=True)
    return {action.title: action for action in found}


def performed(context: Context, path: Path, action: types.CodeAction) -> str:
    """Do what an action says, and return the text."""
    lines = context.lines(path)
    assert lines is not None
    assert action.edit is not None
    assert action.edit.changes is not None
    text = lines.text
    edits = action.edit.changes[uri_of(path)]
    for edit in sorted(edits, key=lambda e: -lines.offset(e.range.start)):
        start, end = lines.offset(edit.range.start), lines.offset(edit.range.end)
        text = text[:start] + edit.new_text + text[end:]
    context.workspace.set_text(path, text.encode())
    return text


def errors(context: Context, path: Path) -> list[str]:
    found = context.analyses.analysis(path).findings
    return [f.message for f in found if f.severity is Severity.ERROR]


NAMES = {
    "event": ("event.v > 2", "event.v > 2", "stop", "Declare `stop` as incoming event"),
    "data": ("event.v > 2", "total > 300", "total", "Declare `total` as data, `0..65535`"),
    "input": ("event.v > 2", "total == n", "total", "Declare `total` as input, `0..9`"),
    "constant": ("event.v > 2", "n < MOST", "MOST", "Declare `MOST` as constant"),
    "Boolean": ("event.v > 2", "ready_now", "ready_now", "Declare `ready_now` as data, `bool`"),
    "member": ("event.v > 2", "why == fault", "why", "Declare `why` as data, `Fault`"),
    "question": ("event.v > 2", "is_free(n, true)", "is_free", "Declare `is_free` as operation"),
}


@pytest.mark.parametrize("file", GATES)
@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_declared(name: str, file: str, context: Context) -> None:
    old, new, piece, title = NAMES[name]
    if name == "event":
        old, new = ("again: b", "stop: b") if file.endswith("yaml") else ('"again" t', '"stop" t')
    elif file.endswith("yaml"):
        new = f'"{new}"'
    path = opened(context, file, (old, new.replace("<", "&lt;") if "scxml" in file else new))
    assert errors(context, path)
    actions = offered(context, path, f"{piece}")
    text = performed(context, path, actions[title])
    assert errors(context, path) == []
    assert piece in text


@pytest.mark.parametrize("file", GATES)
def test_an_operation_is_declared_by_its_call(file: str, context: Context) -> None:
    path = opened(context, file, ("motor(0)", "brake(n, 7, true, Fault.jam)"))
    actions = offered(context, path, "brake(n")
    text = performed(context, path, actions["Declare `brake` as operation"])
    assert "brake(n 0..9, value_2 0..255, on_3 bool, fault Fault)" in text
    assert errors(context, path) == []


@pytest.mark.parametrize("file", GATES)
def test_a_rule_is_allowed_where_it_is_found(file: str, context: Context) -> None:
    path = opened(context, file, ("slots[1] if job.size > 1 else 0", "0"))
    before = [f.rule.name for f in context.analyses.analysis(path).findings]
    assert "unread-data" in before
    piece = "slots: " if file.endswith("yaml") else '"slots"'
    text = performed(context, path, offered(context, path, piece)["Allow `unread-data` here"])
    assert "fsmkit: allow unread-data" in text
    after = [f.rule.name for f in context.analyses.analysis(path).findings]
    assert sorted(after) == sorted(name for name in before if name != "unread-data")


@pytest.mark.parametrize("file", GATES)
@pytest.mark.parametrize(("piece", "name"), [("event.v > 2", "CONSTANT"), ("2s", "DELAY")])
def test_a_constant_is_extracted(file: str, piece: str, name: str, context: Context) -> None:
    path = opened(context, file)
    before = context.analyses.analysis(path).findings
    lines = context.lines(path)
    assert lines is not None
    at = lines.position(lines.text.index(piece) + len(piece) - 1)
    actions = code_actions(context, path, types.Range(at, at), None, (), is_requested=True)
    (action,) = (a for a in actions if a.title == f"Extract the constant `{name}`")
    assert name in performed(context, path, action)
    assert [f.message for f in context.analyses.analysis(path).findings] == [
        f.message for f in before
    ]


@pytest.mark.parametrize("file", GATES)
def test_a_guard_becomes_a_function(file: str, context: Context) -> None:
    path = opened(context, file)
    action = offered(context, path, "fault == Fault.none and")["Make the guard a function"]
    text = performed(context, path, action)
    assert text.count("is_allowed()") == 2
    assert errors(context, path) == []
    refused = offered(context, path, "event.v > 2")["Make the guard a function"]
    assert refused.edit is None
    assert refused.disabled is not None
    assert "it reads the event" in refused.disabled.reason


@pytest.mark.parametrize("file", GATES)
def test_a_function_is_put_in_place_of_its_call(file: str, context: Context) -> None:
    title = "Put the body of `next` in place of the call"
    path = opened(context, file)
    refused = offered(context, path, "next(n % 8)")[title]
    assert refused.disabled is not None
    assert "`n % 8` is an expression" in refused.disabled.reason
    path = opened(context, file, ("next(n % 8)", "next(n)"))
    refused = offered(context, path, "next(n)")[title]
    assert refused.disabled is not None
    assert "`n` is not declared as `0..7`" in refused.disabled.reason
    path = opened(context, file, ("next(n % 8)", "next(7)"))
    text = performed(context, path, offered(context, path, "next(7)")[title])
    assert "(0 if 7 == 7 else 7 + 1)" in text
    assert errors(context, path) == []


@pytest.mark.parametrize("file", GATES)
def test_only_the_entries_that_are_selected_are_laid_out(file: str, context: Context) -> None:
    if file.endswith("yaml"):
        first, second = ("{temp: 0..1000}", "{temp:   0..1000}"), ("ok = temp > 3", "ok=temp>3")
        piece = "ok=temp>3"
    else:
        first = ('<fk:constant name="LIMIT" expr="5"/>', '<fk:constant expr="5"   name="LIMIT"/>')
        second, piece = ('expr="n"/>', 'expr="n"    />'), 'expr="n"    />'
    path = opened(context, file)
    with_first = opened(context, file, first)
    before = context.lines(with_first)
    assert before is not None
    path = opened(context, file, first, second)
    lines = context.lines(path)
    assert lines is not None
    at = lines.position(lines.text.index(piece))
    edits = formatting(context, path, types.Range(at, at))
    action = types.CodeAction("", edit=types.WorkspaceEdit(changes={uri_of(path): edits}))
    assert performed(context, path, action) == before.text
    whole = types.Range(types.Position(0, 0), types.Position(10_000, 0))
    assert formatting(context, path, whole)


def test_states_are_not_moved_but_the_reason_is_told(context: Context) -> None:
    path = opened(context, "gate.yaml")
    lines = context.lines(path)
    assert lines is not None
    start, end = lines.text.index("      c:\n"), len(lines.text)
    place = types.Range(lines.position(start), lines.position(end))
    actions = {a.title: a for a in code_actions(context, path, place, None, ())}
    for title in ("Move states to a used chart", "Move states to a base"):
        disabled = actions[title].disabled
        assert disabled is not None
        assert "by hand" in disabled.reason
