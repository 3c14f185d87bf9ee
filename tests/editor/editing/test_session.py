"""A file that is edited: undo, changes by others, and files that cannot be written."""

import errno
import json
import os
from pathlib import Path
from random import Random
from typing import Any

import pytest

from devtools.edits import sources
from devtools.interleaved import Tally, run
from fsmkit.diagnostics import FsmkitError
from fsmkit.document.document import Kind, Trigger
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.session import EditSession, read_operation
from fsmkit.editor.page.hub import EditHub, new_text

TEXT = (
    "chart: G\nevents: {in: [go, back]}\nstates:\n  a: {on: {go: b}}  # one\n  b: {on: {back: a}}\n"
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / "g.yaml"
    found.write_text(TEXT)
    return found


def test_undo_and_redo_restore_the_file_byte_for_byte(path: Path) -> None:
    path.write_bytes(TEXT.replace("\n", "\r\n").encode())
    session = EditSession(path)
    texts = [path.read_bytes()]
    for name in ("c", "d", "e"):
        session.edit([op.AddState("", name)], session.hash)
        texts.append(path.read_bytes())
    assert all(b"\n" not in text.replace(b"\r\n", b"") for text in texts)
    for text in reversed(texts[:-1]):
        session.undo()
        assert path.read_bytes() == text
    for text in texts[1:]:
        session.redo()
        assert path.read_bytes() == text
    with pytest.raises(FsmkitError, match="nothing to do again"):
        session.redo()


def test_several_operations_are_one_step_and_all_or_none(path: Path) -> None:
    session = EditSession(path)
    with pytest.raises(FsmkitError, match="no state `gone`"):
        session.edit([op.AddState("", "c"), op.RemoveState("gone")], session.hash)
    assert path.read_text() == TEXT
    session.edit([op.AddState("", "c"), op.AddTransition("c", ("a",))], session.hash)
    session.undo()
    assert path.read_text() == TEXT


def test_an_edit_is_rebased_on_a_change_by_another_program(path: Path) -> None:
    session = EditSession(path)
    before = session.hash
    path.write_text(TEXT.replace("go: b", "back: a, go: b"))
    session.edit([op.SetGuard("a", 0, "1 < 2")], before)
    assert "go: {if: 1 < 2, target: b}" in path.read_text()
    assert "back: a," in path.read_text()
    session.undo()
    assert path.read_text() == TEXT.replace("go: b", "back: a, go: b")
    with pytest.raises(FsmkitError, match="nothing to undo"):
        session.undo()


def test_an_edit_of_an_item_that_is_gone_is_rejected(path: Path) -> None:
    session = EditSession(path)
    before = session.hash
    other = TEXT.replace("go: b", "go: a")
    path.write_text(other)
    with pytest.raises(FsmkitError, match="changed meanwhile"):
        session.edit([op.SetGuard("a", 0, "1 < 2")], before)
    with pytest.raises(FsmkitError, match="no state"):
        session.edit([op.RemoveState("gone")], before)
    with pytest.raises(FsmkitError, match="unknown text"):
        session.edit([op.RemoveState("a")], "0" * 16)
    assert path.read_text() == other


@pytest.mark.slow
def test_nothing_is_lost_where_two_editors_write_in_turn(path: Path) -> None:
    session, random = EditSession(path), Random(1)
    page: list[str] = []
    text: list[str] = []
    for number in range(30):
        before = session.hash
        if random.random() < 0.5:
            path.write_text(path.read_text() + f"  t{number}: {{}}\n")
            text.append(f"t{number}")
        session.edit([op.AddState("", f"p{number}")], before)
        page.append(f"p{number}")
    found = path.read_text()
    assert [name for name in (*page, *text) if f"  {name}: {{}}\n" not in found] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_random_edits_by_two_editors_lose_nothing(seed: int, tmp_path: Path) -> None:
    tally = Tally()
    for source in sources(seed):
        run(source, f"{seed} {source.name}", 6, tmp_path, tally)
    assert tally.problems == []
    assert tally.counts["by both"] > 4


def test_a_symbolic_link_is_not_followed(path: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    target = outside / "g.yaml"
    target.write_text(TEXT)
    path.unlink()
    path.symlink_to(target)
    session = EditSession(path)
    with pytest.raises(FsmkitError, match="symbolic link"):
        session.edit([op.AddState("", "c")], session.hash)
    assert target.read_text() == TEXT
    assert path.is_symlink()


def test_a_full_disk_and_a_read_only_file_are_named(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = EditSession(path)

    def full(descriptor: int) -> None:
        del descriptor
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(FsmkitError, match="No space left"):
            session.edit([op.AddState("", "c")], session.hash)
    with monkeypatch.context() as patched:
        patched.setattr(os, "access", lambda *_: False)
        with pytest.raises(FsmkitError, match="read-only"):
            session.edit([op.AddState("", "c")], session.hash)
    assert path.read_text() == session.text == TEXT
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    session.edit([op.AddState("", "c")], session.hash)
    assert "c: {}" in path.read_text()


@pytest.mark.parametrize("name", ["new.yaml", "new.scxml"])
def test_a_new_file_is_written_by_the_first_edit(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    hub = EditHub(EditSession(path, new_text(path)))
    assert not path.exists()
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))
    given = {"op": "AddState", "parent": "", "name": "idle", "kind": "atomic"}
    hub.receive(
        client, json.dumps({"id": 7, "do": "edit", "hash": hub.editing.hash, "operations": [given]})
    )
    assert {"k": "done", "re": 7, "result": hub.editing.hash} in answers
    assert "idle" in path.read_text()
    assert hub.is_valid
    assert hub.document()["states"][0]["id"] == "idle"


WRONG = [
    {"op": "Remove"}, {"op": 7}, {}, {"op": "AddState"},
    {"op": "AddState", "parent": 7, "name": "x"}, {"op": "SetKind", "state": "a", "kind": "round"},
    {"op": "SetGuard", "source": "a", "index": "0"},
]  # fmt: skip


@pytest.mark.parametrize("fields", WRONG)
def test_a_wrong_message_is_rejected(fields: dict[str, Any], path: Path) -> None:
    with pytest.raises(FsmkitError, match="edit-rejected"):
        read_operation(fields)
    hub = EditHub(EditSession(path))
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))
    for operations in ([fields], fields, None):
        hub.receive(
            client,
            json.dumps({"id": 1, "do": "edit", "hash": hub.editing.hash, "operations": operations}),
        )
        assert answers[-1]["k"] == "refused"
    assert path.read_text() == TEXT


def test_a_chart_with_errors_is_drawn_and_does_not_run(path: Path) -> None:
    hub = EditHub(EditSession(path))
    hub.editing.edit(
        [op.AddTransition("a", ("b",), Trigger.EVENT, "unknown", "x > 1", "y()")], hub.editing.hash
    )
    hub.editing.edit([op.AddState("", "c", Kind.CHOICE)], hub.editing.hash)
    hub.changed()
    assert not hub.is_valid
    found = hub.document()
    assert [one["drawn"] is not None for one in found["states"][0]["transitions"]] == [True, True]
    assert [one["severity"] for one in found["findings"]][:1] == ["error"]
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))
    hub.receive(client, json.dumps({"id": 1, "do": "run"}))
    assert answers[-1]["k"] == "refused"
    assert "errors" in answers[-1]["message"]


DERIVED = "chart: D\nextends: g.yaml\nrefine:\n  a: {on: {more: b}}  # b\nevents: {in: [more]}\n"
RENAMING = op.RenameSymbol("state", "b", "idle")


def test_a_state_is_renamed_in_all_files_or_in_none(path: Path) -> None:
    derived = path.with_name("d.yaml")
    derived.write_bytes(DERIVED.replace("\n", "\r\n").encode())
    session = EditSession(path)
    assert session.other_files(session.renaming(RENAMING)) == ["d.yaml"]
    with pytest.raises(FsmkitError, match="other files refer to the name now"):
        session.rename(RENAMING, [])
    derived.chmod(0o444)
    if not os.access(derived, os.W_OK):  # not as root
        with pytest.raises(FsmkitError, match="read-only"):
            session.rename(RENAMING, ["d.yaml"])
    derived.chmod(0o644)
    assert path.read_text() == TEXT
    session.rename(RENAMING, ["d.yaml"])
    renamed = derived.read_bytes()
    assert renamed == DERIVED.replace("more: b", "more: idle").replace("\n", "\r\n").encode()
    assert "idle: {on: {back: a}}" in path.read_text()
    session.undo()
    assert (path.read_text(), derived.read_bytes().decode().replace("\r\n", "\n")) == (
        TEXT,
        DERIVED,
    )
    session.redo()
    assert derived.read_bytes() == renamed
    derived.write_bytes(renamed + b"# changed\r\n")
    with pytest.raises(FsmkitError, match="changed by another program"):
        session.undo()
    assert "idle" in path.read_text()


def test_a_renaming_that_fails_halfway_is_taken_back(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("d", "e"):
        path.with_name(f"{name}.yaml").write_text(DERIVED)
    path.with_name("e.yaml").unlink()
    path.with_name("e.yaml").symlink_to(path.with_name("d.yaml"))
    session = EditSession(path)
    names = session.other_files(session.renaming(RENAMING))
    with monkeypatch.context() as patched:
        patched.setattr(EditSession, "_write", _full)
        with pytest.raises(FsmkitError, match="No space left"):
            session.rename(RENAMING, names)
    assert path.with_name("d.yaml").read_text() == DERIVED
    assert path.read_text() == TEXT


def _full(self: EditSession, text: str) -> None:
    del text
    raise self._failed("write", OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))


COMPLETED = [
    ({"what": "event", "text": "g"}, {"go"}),
    ({"what": "event", "text": ""}, {"go", "back"}),
    ({"what": "guard", "text": "n > 0 and n"}, {"n"}),
    ({"what": "guard", "text": "In("}, {"a", "b"}),
    ({"what": "statements", "text": "send "}, {"done"}),
    ({"what": "statements", "text": "n = 0; be"}, {"beep"}),
    ({"what": "state", "text": ""}, {"a", "b"}),
    ({"what": "guard", "text": "event.", "events": ["go"]}, {"speed"}),
]


@pytest.mark.parametrize(("fields", "names"), COMPLETED)
def test_a_text_of_the_drawing_is_completed(
    fields: dict[str, Any], names: set[str], path: Path
) -> None:
    path.write_text(
        TEXT.replace("[go, back]}", "['go(speed 0..9)', back], out: [done]}\n"
                     "data: {n: 0..9 = 0}\noperations: [beep()]")
    )  # fmt: skip
    hub = EditHub(EditSession(path))
    assert hub.is_valid, hub.document()["findings"]
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))
    hub.receive(client, json.dumps({"id": 1, "do": "complete", **fields}))
    assert names <= {one["label"] for one in answers[-1]["result"]}, answers[-1]
    for wrong in ({"what": "poem"}, {"what": "event", "events": 7}, {}):
        hub.receive(client, json.dumps({"id": 2, "do": "complete", **wrong}))
        assert answers[-1]["k"] == "refused"


def test_a_preview_has_the_findings_that_an_edit_would_add(path: Path) -> None:
    hub = EditHub(EditSession(path))
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))

    def preview(*operations: dict[str, Any]) -> list[str]:
        fields = {"id": 1, "do": "preview", "hash": hub.editing.hash, "operations": operations}
        hub.receive(client, json.dumps(fields))
        return [one["message"] for one in answers[-1]["result"]]

    guard = {"op": "SetGuard", "source": "a", "index": 0}
    assert preview({**guard, "guard": "1 < 2"}) == []
    assert "missing" in preview({**guard, "guard": "missing > 1"})[0]
    assert preview({**guard, "guard": "1 <"})
    assert "a" in preview({"op": "RenameSymbol", "kind": "state", "name": "b", "new": "a"})[0]
    assert path.read_text() == TEXT


@pytest.mark.parametrize("name", ["edit", "trace", "copy", "complete", "preview", "dependents"])
def test_every_wrong_field_of_a_command_is_answered(name: str, path: Path) -> None:
    hub = EditHub(EditSession(path))
    answers: list[Any] = []
    client = hub.join(lambda text: answers.append(json.loads(text)))
    renaming = {"op": "RenameSymbol", "kind": "state", "name": "b", "new": "c"}
    values: list[Any] = [None, 7, "x", [], [7], {}, {"state": 7}, [{"state": 7}]]
    values += [[{"state": "a", "index": "x"}], [{"state": "a", "index": 9}], [renaming, renaming]]
    fields = ("operations", "hash", "files", "items", "property", "what", "text", "state", "events")
    for field in fields:
        for value in values:
            given = {"operations": [renaming], "what": "event", "hash": "?", field: value}
            hub.receive(client, json.dumps({"id": 3, "do": name, **given}))
            assert answers[-1]["re"] == 3
            assert answers[-1]["k"] in ("done", "refused")
    assert path.read_text() == TEXT


def test_a_file_that_cannot_be_read_stops_a_renaming(path: Path) -> None:
    derived = path.with_name("d.yaml")
    derived.write_bytes(DERIVED.encode() + b"# \xff\n")
    session = EditSession(path)
    with pytest.raises(FsmkitError, match="edit-rejected"):
        session.rename(RENAMING, session.other_files(session.renaming(RENAMING)))
    assert path.read_text() == TEXT
