"""The page of a webview in a browser, with the language server and an editor that applies edits."""

from __future__ import annotations

import json
import queue
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lsprotocol import types

from fsmkit.editor.context import uri_of
from tests.editor.page.editor import Editor
from tests.editor.page.test_embedded import Window, editor_window, window

if TYPE_CHECKING:
    from playwright.sync_api import Browser

__all__ = ["editor_window", "window"]
SECONDS = 60
pytestmark = [pytest.mark.external, pytest.mark.slow]
ORIGIN = "http://webview.test/"
HOST = """<style>@layer vscode-default { body { padding: 0 20px; font-size: 13px } }</style>
<script>
const outbox = [];
const acquireVsCodeApi = () => ({ postMessage(message) { outbox.push(structuredClone(message)) } });
</script>"""
"""Put before the page and its policy, as VS Code does; messages of the page are in `outbox`."""
TEXT = """\
chart: G
events: {in: [go]}
states:
  a: {on: {go: b}}  # one
  b: {rest: true}
properties:
  never_b: {never: In(b)}
"""
DERIVED = "chart: D\nextends: g.yaml\nrefine:\n  b: {doc: derived}\n"


class Webview(Editor):
    """A page in a webview, whose messages this thread passes on as the extension does."""

    def __init__(self, browser: Browser, window: Window, path: Path) -> None:
        self.window = window
        window.editor.open(path)
        opened = window.open(path)
        self.number = opened["page"]
        self.html = opened["html"].replace("<head>", f"<head>{HOST}", 1)
        super().__init__(browser, path, ORIGIN)

    def load(self, address: str) -> None:
        self.context.route(
            f"{ORIGIN}**", lambda route: route.fulfill(body=self.html, content_type="text/html")
        )
        self.page.goto(address)

    def wait(self, condition: str, arg: object = None) -> None:
        end = time.monotonic() + SECONDS
        while not self.page.evaluate(f"arg => Boolean(({condition})(arg))", arg):
            assert time.monotonic() < end, condition
            self.pass_on()

    @property
    def text(self) -> str:
        """The text of the document in the editor."""
        return self.window.editor.texts[self.path]

    def undo(self) -> None:
        """Restore the text before the last edit, as the command of the editor does."""
        self.window.editor.change(self.path, self.window.before.pop())

    def save(self) -> None:
        """Save the document."""
        self.path.write_text(self.text)
        editor, saved = self.window.editor, types.TextDocumentIdentifier(uri_of(self.path))
        params = types.DidSaveTextDocumentParams(saved)
        editor.tell(editor.client.text_document_did_save, params)

    def pass_on(self) -> None:
        """Pass on the messages of both sides that have arrived."""
        for message in self.page.evaluate("outbox.splice(0)"):
            self._sent(message)
        messages = []
        try:
            messages.append(self.window.messages.get(timeout=0.02))
            while True:
                messages.append(self.window.messages.get_nowait())
        except queue.Empty:
            pass
        if messages:
            self._post(messages)

    def _post(self, messages: list[Any]) -> None:
        data = {"kind": "messages", "text": json.dumps(messages)}
        self.page.evaluate("data => window.postMessage(data, '*')", data)

    def _sent(self, message: dict[str, Any]) -> None:
        """Do what the extension does with a message of the page."""
        if message["kind"] == "ready":
            self.window.send("join", page=self.number)
            return
        command = message["command"]
        if command["do"] == "undo":
            self.undo()
            self._post([{"k": "done", "re": command["id"], "result": None}])
            return
        self.window.send("receive", page=self.number, text=json.dumps(command))


def test_the_page_of_a_webview_edits_the_document(
    browser: Browser, window: Window, tmp_path: Path
) -> None:
    path = tmp_path / "g.yaml"
    path.write_text(TEXT)
    derived = tmp_path / "derived.yaml"
    derived.write_text(DERIVED)
    editor = Webview(browser, window, path)
    page, press = editor.page, editor.page.keyboard.press

    def written(text: str) -> None:
        """Wait until page and document have a text, and the page draws it."""
        editor.wait("text => documentOf.text === text", text)
        editor.edited()
        editor.settled()
        assert editor.text == text

    def rename(name: str, new: str) -> None:
        page.select_option("#edit-item", label=name)
        page.fill("#edit-name", new)
        page.press("#edit-name", "Enter")

    editor.settled()
    assert page.evaluate("getComputedStyle(document.body).padding") == "0px"
    page.click("#edit-palette button:text-is('State')")
    editor.wait("() => $('edit-inline')")
    editor.type_in_place("c")
    written(TEXT.replace("rest: true}", "rest: true}\n  c: {}"))
    box = editor.box("b")
    editor.drag((box["x"] + 2, box["y"] + box["height"] / 2), editor.middle("c"))
    editor.wait("() => $('edit-inline')")
    editor.type_in_place("go")
    written(TEXT.replace("rest: true}", "rest: true, on: {go: c}}\n  c: {}"))
    rename("c", "idle")
    written(TEXT.replace("rest: true}", "rest: true, on: {go: idle}}\n  idle: {}"))
    editor.box("idle")
    editor.picture("webview")

    # undo is the editor's: by its command, and by the key in the page
    while window.before:
        before = window.before[-1]
        if len(window.before) % 2:
            editor.undo()
        else:
            press("Control+z")
        written(before)
    assert editor.text == TEXT
    assert page.evaluate("!stateOf('c') && !stateOf('idle')")

    # a name that other files use is changed by the editor, which may have them open
    rename("b", "wide")
    editor.wait("() => !$('notice').hidden")
    assert "other files refer to `b`: derived.yaml" in page.inner_text("#notice")
    editor.edited()
    assert page.locator("#edit-confirm").count() == 0
    assert (editor.text, derived.read_text()) == (TEXT, DERIVED)

    # the check of the saved document shows its verdicts, and the trace in the drawing
    editor.save()
    editor.wait("() => document.querySelector('button.edit-chip.violated')")
    page.click("button.edit-chip.violated:has-text('never_b')")
    editor.wait("() => session.mode.head === 3 && session.mode.n === 0")
    page.click("#mode-edit")
    rename("a", "start")
    written(TEXT.replace("a: {", "start: {"))
    assert page.evaluate("documentOf.verdicts") == []
    assert path.read_text() == TEXT

    # the server has ended: edits are kept, and nothing waits for an answer
    page.evaluate("window.postMessage({kind: 'lost'}, '*')")
    editor.wait("() => !isConnected()")
    rename("start", "first")
    editor.wait("() => !$('edit-unsent').hidden && waiting.size === 0")
    assert page.evaluate("outbox") == []
    assert editor.complaints == []
    assert set(editor.requests) == {ORIGIN}
