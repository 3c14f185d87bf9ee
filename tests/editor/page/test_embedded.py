"""The page inside an editor: edits reach the open document, with what is not saved."""

from __future__ import annotations

import json
import queue
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types

from fsmkit.editor.context import uri_of
from fsmkit.editor.page.embedded import webview_page
from tests.editor.client import WAIT, Editor
from tests.editor.editing.test_edits import GATE

pytestmark = pytest.mark.cc


class Window:
    """An editor that shows pages, and applies the edits of the server to its documents."""

    def __init__(self, folder: Path) -> None:
        self.editor = Editor(folder)
        self.messages: queue.Queue[Any] = queue.Queue()
        self.edits: list[types.ApplyWorkspaceEditParams] = []
        self.texts: queue.Queue[str] = queue.Queue()
        """The texts of documents after edits of the server."""
        self.before: list[str] = []
        """The texts of documents before these edits."""
        self.accepts = True
        client = self.editor.client

        @client.feature("fsmkit/page/messages")  # type: ignore[untyped-decorator]
        def take(params: Any) -> None:
            found = json.loads(params.text)
            for message in found if isinstance(found, list) else [found]:
                self.messages.put(message)

        @client.feature(types.WORKSPACE_APPLY_EDIT)  # type: ignore[untyped-decorator]
        def apply(params: types.ApplyWorkspaceEditParams) -> types.ApplyWorkspaceEditResult:
            self.edits.append(params)
            if self.accepts:
                for path, text in self.editor.applied(params.edit).items():
                    self.before.append(self.editor.texts[path])
                    self._changed(path, text)
                    self.texts.put(text)
            return types.ApplyWorkspaceEditResult(applied=self.accepts)

    def _changed(self, path: Path, text: str) -> None:
        self.editor.texts[path] = text
        self.editor.versions[path] += 1
        identifier = types.VersionedTextDocumentIdentifier(self.editor.versions[path], uri_of(path))
        change = types.TextDocumentContentChangeWholeDocument(text)
        self.editor.client.text_document_did_change(
            types.DidChangeTextDocumentParams(identifier, [change])
        )

    def open(self, path: Path, *, is_readonly: bool = False) -> dict[str, Any]:
        """Return the answer to a request for a page."""
        params = {"uri": uri_of(path), "readonly": is_readonly}
        request = self.editor.client.protocol.send_request_async
        found = self.editor.ask(lambda given: request("fsmkit/page/open", given), params)
        return found if isinstance(found, dict) else found._asdict()

    def send(self, what: str, **fields: Any) -> None:
        notify = self.editor.client.protocol.notify
        self.editor.tell(lambda given: notify(f"fsmkit/page/{what}", given), fields)

    def until(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Return the next message of a kind with these fields."""
        while True:
            message: dict[str, Any] = self.messages.get(timeout=WAIT)
            if message["k"] == kind and fields.items() <= message.items():
                return message

    def command(self, page: int, name: str, **fields: Any) -> dict[str, Any]:
        """Give a command, and return the answer."""
        self.send("receive", page=page, text=json.dumps({"id": 7, "do": name, **fields}))
        while True:
            message: dict[str, Any] = self.messages.get(timeout=WAIT)
            if message["k"] in ("done", "refused") and message["re"] == 7:
                return message


@pytest.fixture(scope="module")
def editor_window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    found = Window(tmp_path_factory.mktemp("window"))
    yield found
    found.editor.close()


@pytest.fixture
def window(editor_window: Window) -> Window:
    editor_window.edits.clear()
    editor_window.before.clear()
    editor_window.texts = queue.Queue()
    return editor_window


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "gate.yaml").write_text(GATE, encoding="utf-8")
    return tmp_path / "gate.yaml"


def added(name: str) -> list[dict[str, str]]:
    return [{"op": "AddState", "parent": "", "name": name}]


def test_edits_reach_the_document_and_never_the_file(window: Window, path: Path) -> None:
    unsaved = GATE.replace("# somebody rings", "# not saved").replace("10s", "11s")
    window.editor.open(path)
    window.editor.open(path, unsaved)
    opened = window.open(path)
    page = opened["page"]
    assert opened["html"] == webview_page()
    window.send("join", page=page)
    document = window.until("document")
    assert document["text"] == unsaved
    assert (document["undo"], document["redo"]) == (True, True)
    assert window.command(page, "edit", operations=added("a"), hash=document["hash"])["k"] == "done"
    document = window.until("document")
    assert "\n  a: {}\n" in document["text"]
    assert "# not saved" in document["text"]
    done = window.command(page, "edit", operations=added("b"), hash=document["hash"])
    document = window.until("document")
    assert "b: {}" not in window.texts.get(timeout=WAIT)
    text = window.texts.get(timeout=WAIT)
    assert (done["result"], document["text"]) == (document["hash"], text)
    assert text == unsaved + "  a: {}\n  b: {}\n"
    assert path.read_text(encoding="utf-8") == GATE
    assert [*path.parent.iterdir()] == [path]
    for edit in window.edits:
        (change,) = edit.edit.document_changes or ()
        assert isinstance(change, types.TextDocumentEdit)
        found = [each for each in change.edits if isinstance(each, types.TextEdit)]
        assert [each.new_text.count("\n") for each in found] == [1]

    # the editor undoes, or somebody types: the page follows
    window.editor.change(path, unsaved)
    assert window.until("document")["text"] == unsaved
    assert window.command(page, "undo")["k"] == "refused"

    # an edit that was made for an older text is rebased
    done = window.command(page, "edit", operations=added("c"), hash=document["hash"])
    assert done["k"] == "done"
    assert window.until("document")["text"] == unsaved + "  c: {}\n"
    window.send("close", page=page)


def test_a_document_that_rejects_an_edit_stays_as_it_is(window: Window, path: Path) -> None:
    window.editor.open(path)
    page = window.open(path)["page"]
    window.send("join", page=page)
    document = window.until("document")
    window.accepts = False
    window.command(page, "edit", operations=added("a"), hash=document["hash"])
    assert "  a: {}" in window.until("document")["text"]
    assert window.until("document")["text"] == GATE
    window.accepts = True
    window.command(page, "edit", operations=added("a"), hash=document["hash"])
    assert "  a: {}" in window.until("document")["text"]
    window.send("close", page=page)


def test_a_page_that_is_read_only_draws_and_runs_nothing(window: Window, path: Path) -> None:
    window.editor.open(path)
    page = window.open(path, is_readonly=True)["page"]
    window.send("join", page=page)
    document = window.until("document")
    answer = window.command(page, "edit", operations=added("a"), hash=document["hash"])
    assert (answer["k"], "read-only" in answer["message"]) == ("refused", True)
    assert window.edits == []
    window.send("close", page=page)
    pages = [window.open(path).get("page") for _ in range(9)]
    assert pages == [*range(page + 1, page + 9), None]
    for each in pages[:-1]:
        window.send("close", page=each)


def test_a_name_that_other_files_use_is_not_renamed_by_the_page(window: Window, path: Path) -> None:
    derived = path.with_name("derived.yaml")
    text = "chart: D\nextends: gate.yaml\nrefine:\n  NAME: {doc: derived}\n"
    window.editor.open(path)
    page = window.open(path)["page"]
    window.send("join", page=page)
    document = window.until("document")
    name, other = [state["id"] for state in document["states"] if state["id"]][:2]
    derived.write_text(text.replace("NAME", name))
    renaming = [{"op": "RenameSymbol", "kind": "state", "name": name, "new": "new_name"}]
    for what in (
        {"name": "dependents"},
        {"name": "edit", "hash": document["hash"], "files": ["derived.yaml"]},
    ):
        answer = window.command(page, **what, operations=renaming)
        assert answer["k"] == "refused"
        assert "derived.yaml" in answer["message"]
    assert (window.edits, window.editor.texts[path]) == ([], GATE)
    assert derived.read_text() == text.replace("NAME", name)
    assert path.read_text(encoding="utf-8") == GATE

    # a name that only this file uses is renamed in the document
    renaming[0]["name"] = other
    assert window.command(page, "dependents", operations=renaming)["result"] == []
    answer = window.command(page, "edit", operations=renaming, hash=document["hash"], files=[])
    assert answer["k"] == "done"
    assert "new_name" in window.texts.get(timeout=WAIT)
    window.send("close", page=page)


def test_the_page_of_a_webview_loads_nothing() -> None:
    page = webview_page()
    assert "content=\"default-src 'none'; script-src 'sha256-" in page
    assert "connect-src 'none'" in page
    assert page.count("acquireVsCodeApi()") == 1
    assert "new WebSocket" not in page
