"""The page of `fsmkit edit` where something goes wrong: nothing is lost, and no script runs."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import fsmkit
from fsmkit.chart.drawing.positions.placement import hints_path, hints_text, read_hints
from fsmkit.editor.editing.session import EditSession
from fsmkit.editor.page import edit_page
from fsmkit.editor.page.hub import EditHub
from tests.editor.page.editor import Editor, editing
from tests.inspector.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
TEXT = "chart: G\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}  # one\n  b: {}\n  c: {}\n"
HOSTILE = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    found = tmp_path / "g.yaml"
    found.write_text(TEXT)
    return found


def written_elsewhere(editor: Editor, text: str) -> None:
    """Let another program write the file, and wait until the page has it."""
    editor.path.write_text(text)
    assert editor.hub.editing.refresh()
    editor.hub.changed()
    editor.page.wait_for_function("text => documentOf.text === text", arg=text)


def pressed_at_the_end(editor: Editor) -> None:
    """Press the mouse on the target of the transition of `a`, and move it to `c`."""
    editor.settled()
    editor.page.select_option("#edit-item", label="a: go → b")
    editor.page.wait_for_selector("#edit-end-target")
    box = editor.page.locator("#edit-end-target").bounding_box()
    assert box is not None
    editor.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    editor.page.mouse.down()
    editor.page.mouse.move(*editor.middle("c"))


def test_a_file_changes_in_the_middle_of_a_drag(browser: Browser, path: Path) -> None:
    with editing(browser, path) as editor:
        page = editor.page
        pressed_at_the_end(editor)
        other = TEXT.replace("{on: {go: b}}", "{rest: true, on: {go: b}}") + "  d: {}\n"
        written_elsewhere(editor, other)
        editor.settled()
        page.mouse.move(*editor.middle("c"))
        page.mouse.up()
        page.wait_for_function("() => stateOf('a').transitions[0].targets[0] === 'c'")
        editor.edited()
        assert path.read_text() == other.replace("go: b", "go: c")
        written_elsewhere(editor, TEXT)
        pressed_at_the_end(editor)
        gone = TEXT.replace("{on: {go: b}}", "{}")
        written_elsewhere(editor, gone)
        editor.settled()
        page.mouse.move(*editor.middle("c"))
        page.mouse.up()
        page.wait_for_selector("#notice:has-text('was changed meanwhile')")
        assert path.read_text() == gone


def test_edits_without_a_connection_are_kept_and_offered(browser: Browser, path: Path) -> None:
    with editing(browser, path) as editor:
        page = editor.page
        page.select_option("#edit-item", label="b")
        page.evaluate("transport.socket.close()")
        page.wait_for_function("() => transport.socket.readyState === WebSocket.CLOSED")
        page.evaluate("document.activeElement.blur()")
        page.evaluate("edit([{ op: 'AddState', parent: '', name: 'kept', kind: 'atomic' }])")
        page.evaluate("rename('b', 'named')")
        page.wait_for_selector("#edit-unsent:has-text('2 edits could not be sent')")
        assert path.read_text() == TEXT
        page.wait_for_function("() => isConnected()")
        page.click("#edit-unsent button:text-is('Make them now')")
        page.wait_for_function("() => stateOf('kept') && stateOf('named')")
        editor.edited()
        assert page.locator("#edit-unsent").is_hidden()
        assert [state.id for state in fsmkit.read_chart(path).states[1:]] == [
            "a", "named", "c", "kept"
        ]  # fmt: skip


def test_two_pages_edit_one_file_and_undo_ends_at_a_foreign_change(
    browser: Browser, path: Path
) -> None:
    hub = EditHub(EditSession(path))
    with served(hub, page=edit_page) as server:
        one, other = (Editor(browser, path, server.address) for _ in range(2))
        one.hub = other.hub = hub
        other.page.select_option("#edit-item", label="a: go → b")
        one.page.keyboard.press("n")
        one.type_in_place("mine")
        other.page.wait_for_function("() => stateOf('mine')")
        kept = {"kind": "transition", "source": "a", "index": 0}
        assert other.page.evaluate("selected") == kept
        for editor, name in ((one, "x1"), (other, "x2")):
            operation = f"{{ op: 'AddState', parent: 'b', name: '{name}', kind: 'atomic' }}"
            editor.page.evaluate(f"edit([{operation}]); null")
        for editor in (one, other):
            editor.page.wait_for_function("() => stateOf('x1') && stateOf('x2')")
            editor.edited()
        assert {"mine", "x1", "x2"} <= {state.id for state in fsmkit.read_chart(path).states}
        written_elsewhere(one, path.read_text() + "  far: {}\n")
        other.page.wait_for_function("() => stateOf('far') && $('edit-undo').disabled")
        text = path.read_text()
        other.page.evaluate("document.activeElement.blur()")
        other.page.keyboard.press("Control+z")
        other.page.wait_for_selector("#notice:has-text('nothing to undo')")
        assert path.read_text() == text
        # a page of another origin, even with the token
        page = one.context.new_page()
        page.route("http://evil.example/", lambda route: route.fulfill(body="<p>hello</p>"))
        page.goto("http://evil.example/")
        token = server.address.partition("#")[2]
        assert token
        address = f"ws://127.0.0.1:{server.port}/live?token={token}"
        joined = page.evaluate(
            "address => new Promise((resolve) => { const socket = new WebSocket(address,"
            " 'fsmkit.live.1'); socket.onopen = () => resolve(true);"
            " socket.onclose = () => resolve(false); })",
            address,
        )
        assert not joined
        assert one.complaints + other.complaints == []
        for editor in (one, other):
            editor.context.close()


def test_hostile_texts_are_only_text(browser: Browser, path: Path) -> None:
    with editing(browser, path) as editor:
        page = editor.page
        page.select_option("#edit-item", label="a: go → b")
        page.keyboard.press("F2")
        editor.type_in_place(f'go / log("{HOSTILE}")')
        page.wait_for_function("text => documentOf.text.includes(text)", arg=HOSTILE)
        page.select_option("#edit-item", label="a")
        field = page.locator("#edit-panel label:has(span:text-is('doc')) >> css=input")
        field.fill(HOSTILE)
        field.blur()
        page.wait_for_function("() => (stateOf('a').keys.doc || []).length")
        written_elsewhere(
            editor, path.read_text().replace("c: {}", f'"{HOSTILE}": {{on: {{go: "{HOSTILE}!"}}}}')
        )
        page.wait_for_selector("#edit-findings button:has-text('onerror')")
        assert page.evaluate(
            "[document.querySelectorAll('img').length, document.scripts.length]"
        ) == [0, 1]


def test_a_read_only_file_stays_as_it_is(
    browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with editing(browser, path) as editor:
        page = editor.page
        monkeypatch.setattr(os, "access", lambda *_: False)
        page.keyboard.press("n")
        page.wait_for_selector("#notice:has-text('is read-only; the edit was not made')")
        assert path.read_text() == TEXT
        assert page.evaluate("documentOf.states.length") == 3
        monkeypatch.undo()
        page.keyboard.press("n")
        editor.type_in_place("d")
        assert path.read_text() == f"{TEXT}  d: {{}}\n"


def test_an_inherited_state_is_overridden_and_the_drawing_is_tidied(
    browser: Browser, path: Path
) -> None:
    derived = path.with_name("d.yaml")
    derived.write_text("chart: D\nextends: g.yaml\n")
    opened: list[tuple[str, int]] = []
    opener = {"editor": lambda file, line: opened.append((file.name, line))}
    with editing(browser, derived, **opener) as editor:
        page = editor.page
        editor.settled()
        index = page.evaluate("views[0].chart.states.findIndex(({id}) => id === 'a')")
        page.click(f"#drawing #s{index}", position={"x": 30, "y": 20})
        page.wait_for_selector("#edit-panel:has-text('line 4, and locked here')")
        editor.picture("inherited")
        page.click("#edit-panel button:text-is('Open its file')")
        page.wait_for_function("() => waiting.size === 0")
        page.click("#edit-panel button:text-is('Override here')")
        page.wait_for_function("() => stateOf('a') && stateOf('a').refines")
        page.click("#edit-panel button:text-is('Show in the text')")
        page.wait_for_function("() => waiting.size === 0")
        assert opened == [("g.yaml", 4), ("d.yaml", 5)]
        field = page.locator("#edit-panel label:has(span:text-is('entry')) >> css=textarea")
        field.fill("log(1)")
        field.blur()
        page.wait_for_function("() => (stateOf('a').keys.entry || []).length")
        assert "refine:\n  a:\n    entry: log (1)\n" in derived.read_text()
        assert path.read_text() == TEXT
        editor.edited()
        editor.settled()
        editor.hub.save_hints()
        kept = editor.hub.placement
        assert kept is not None
        assert hints_path(derived).read_text() == hints_text(kept)
    box = kept.boxes["c"]
    moved = {**kept.boxes, "c": replace(box, x=box.x + 900)}
    hints_path(derived).write_text(hints_text(replace(kept, boxes=moved)))
    with editing(browser, derived) as editor:
        editor.settled()
        far = editor.box("c")["x"] - editor.box("a")["x"]
        editor.page.click("#edit-tidy")
        editor.page.wait_for_function("() => waiting.size === 0 && !loading")
        editor.settled()
        assert editor.box("c")["x"] - editor.box("a")["x"] < far / 2
        editor.hub.save_hints()
        tidied = read_hints(derived)
        assert tidied is not None
        assert max(one.right for one in tidied.boxes.values()) < box.x + 900
        hints_path(derived).write_text("no hints")
        assert EditHub(EditSession(derived)).placement is None
