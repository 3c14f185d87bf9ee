"""The page of `fsmkit edit`: a gate is drawn from an empty page, and its text is the README's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import fsmkit
from fsmkit.editor.editing.session import EditSession
from fsmkit.editor.page import edit_page
from fsmkit.editor.page.hub import EditHub
from fsmkit.plan.lower import lower
from fsmkit.plan.tree import plan_document
from fsmkit.verify.report.verdict import Verdict
from tests.editor.page.editor import Editor, editing, require_accessible
from tests.inspector.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
README = Path(__file__).parents[3] / "README.md"
STATES = ("closed", "opening", "open", "closing", "stuck")
TRANSITIONS = (
    ("closed", "opening", "request"),
    ("opening", "open", "limit / send opened"),
    ("opening", "stuck", "after 10s"),
    ("open", "closing", "after 3s"),
    ("closing", "opening", "request"),
    ("closing", "closed", "limit"),
    ("closing", "opening", "[blocked]"),
    ("closing", "stuck", "after 10s"),
)
DECLARED = (("inputs", "blocked", "bool"), ("operations", "motor(direction -1..1)", ""),
            ("in", "request", ""), ("in", "limit", ""), ("out", "opened", ""))  # fmt: skip
HANDLERS = (("opening", "entry", "motor(1)"), ("opening", "exit", "motor(0)"),
            ("closing", "entry", "motor(-1)"), ("closing", "exit", "motor(0)"))  # fmt: skip


def readme_gate() -> str:
    """Return the chart of the README, in which waiting for help is no trap."""
    text = README.read_text(encoding="utf-8")
    start = text.index("chart: Gate")
    return text[start : text.index("```", start)].replace("stuck: {}", "stuck: {rest: true}")


def plan(chart: fsmkit.Chart) -> str:
    return json.dumps(plan_document(lower(chart)), default=str)


def require_gate(path: Path) -> None:
    """Fail unless a file has the meaning of the README's gate."""
    reference = path.with_name("reference.yaml")
    reference.write_text(readme_gate())
    assert plan(fsmkit.read_chart(path)) == plan(fsmkit.read_chart(reference))
    assert fsmkit.check(fsmkit.read_chart(path)).verdict is Verdict.HOLDS


def test_a_gate_is_drawn_by_mouse_and_keyboard(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "gate.yaml"
    with editing(browser, path) as editor:
        page = editor.page
        page.wait_for_selector("#edit-hint:visible")
        editor.picture("1-empty")
        assert not path.exists()
        for number, name in enumerate(STATES):
            if number % 2:
                page.keyboard.press("n")
            else:
                page.click("#edit-palette button:text-is('State')")
            editor.type_in_place(name)
        editor.picture("2-states")
        page.select_option("#edit-item", "")
        for section, name, value in DECLARED:
            form = page.locator(f"#edit-declare-{section}")
            if not form.is_visible():
                page.click(f"#edit-section-{section} > summary")
            form.locator("input").first.fill(name)
            if value:
                form.locator("input").nth(1).fill(value)
            form.locator("button").click()
            page.wait_for_selector(f"#edit-section-{section} li:has-text('{name}')")
        for source, target, label in TRANSITIONS:
            editor.settled()
            start = editor.box(source)
            page.mouse.click(start["x"] + start["width"] / 2, start["y"] + start["height"] / 2)
            page.wait_for_function("id => selected && selected.id === id", arg=source)
            page.wait_for_selector("#edit-handle")
            handle = page.locator("#edit-handle").bounding_box()
            assert handle is not None
            end = editor.box(target)
            page.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2)
            page.mouse.down()
            for part in (0.3, 0.6, 1.0):
                page.mouse.move(
                    handle["x"] + part * (end["x"] + end["width"] / 2 - handle["x"]),
                    handle["y"] + part * (end["y"] + end["height"] / 2 - handle["y"]),
                )
            page.mouse.up()
            editor.type_in_place(label)
        editor.settled()
        editor.picture("3-transitions")
        for state, key, text in HANDLERS:
            page.select_option("#edit-item", label=state)
            field = page.locator(f"#edit-panel label:has(span:text-is('{key}')) >> css=textarea")
            field.fill(text)
            field.blur()
            editor.edited()
        for state in ("closed", "stuck"):
            page.select_option("#edit-item", label=state)
            page.locator("#edit-panel label:has(span:text-is('rest')) >> css=input").check()
            editor.edited()
            page.wait_for_function(
                "id => stateOf(id).keys.rest && stateOf(id).keys.rest[0] === 'true'", arg=state
            )
        editor.settled()
        editor.picture("4-gate")
        require_accessible(editor)
        page.click("#mode-run")
        page.get_by_role("button", name="request", exact=True).click()
        page.wait_for_selector("#drawing .state.active:has-text('opening')")
        editor.picture("5-run")
    require_gate(path)


def test_a_gate_is_drawn_by_keyboard_alone(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "gate.yaml"
    with editing(browser, path) as editor:
        page, press = editor.page, editor.page.keyboard.press

        def select(words: str) -> None:
            """Select an item of the list by arrow keys."""
            page.wait_for_function("() => waiting.size === 0")
            for _ in range(60):
                if page.evaluate("document.activeElement.id") == "edit-item":
                    break
                press("Shift+Tab")
            press("Home")
            for _ in range(40):
                shown = page.evaluate("$('edit-item').selectedOptions[0].textContent")
                if shown == words:
                    return
                press("ArrowDown")
            raise AssertionError(f"{words} is not in the list")

        def tab_to(test: str) -> None:
            for _ in range(120):
                if page.evaluate(
                    f"(() => {{ const at = document.activeElement; return {test}; }})()"
                ):
                    return
                press("Tab")
            raise AssertionError(test)

        page.wait_for_selector("#edit-hint:visible")
        for name in STATES:
            press("n")
            editor.type_in_place(name)
        for section, name, value in DECLARED:
            select("chart Gate")
            tab_to(f"at.closest('#edit-section-{section}')")
            if page.evaluate(f"!$('edit-section-{section}').open"):
                press("Enter")
            tab_to(f"at.matches('#edit-declare-{section} input')")
            page.keyboard.type(name)
            if value:
                press("Tab")
                page.keyboard.type(value)
            press("Enter")
            page.wait_for_selector(
                f"#edit-section-{section} li:has-text('{name}')", state="attached"
            )
        for source, target, label in TRANSITIONS:
            select(source)
            press("t")
            page.wait_for_selector("#edit-target:focus")
            for _ in range(10):
                if page.evaluate("$('edit-target').value") == target:
                    break
                press("ArrowDown")
            press("Enter")
            editor.type_in_place(label)
        for state, key, text in HANDLERS:
            select(state)
            tab_to(f"at.matches('textarea') && at.closest('label').innerText.trim() === '{key}'")
            page.keyboard.type(text)
            press("Tab")
            page.wait_for_function(
                "([id, key, text]) => (stateOf(id).keys[key] || [])[0] === text",
                arg=[state, key, text],
            )
        for state in ("closed", "stuck"):
            select(state)
            tab_to(
                "at.matches('[type=checkbox]') && at.closest('label').innerText.trim() === 'rest'"
            )
            press(" ")
            page.wait_for_function("id => stateOf(id).keys.rest", arg=state)
        before = path.read_text()
        press("Control+Z")
        page.wait_for_function("() => !stateOf('stuck').keys.rest")
        press("Control+Y")
        page.wait_for_function("() => stateOf('stuck').keys.rest")
        assert path.read_text() == before
    require_gate(path)


def test_a_state_is_dragged_into_another_and_removed(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("chart: A\nstates:\n  a: {}  # first\n  b:\n    states:\n      c: {}\n")
    with editing(browser, path) as editor:
        page = editor.page
        editor.settled()
        one, other = editor.box("a"), editor.box("c")
        page.mouse.move(one["x"] + one["width"] / 2, one["y"] + one["height"] / 2)
        page.mouse.down()
        page.mouse.move(other["x"] - 2, other["y"] - 2)
        page.mouse.move(other["x"] - 4, other["y"] - 4)
        page.mouse.up()
        page.wait_for_function("() => stateOf('a').parent === 'b'")
        assert path.read_text() == (
            "chart: A\nstates:\n  b:\n    states:\n      c: {}\n      a: {}  # first\n"
        )
        page.keyboard.press("Delete")
        page.wait_for_function("() => !stateOf('a')")
        page.keyboard.press("Control+z")
        page.wait_for_function("() => stateOf('a')")


def test_a_file_that_breaks_is_shown_as_text_and_recovers(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("chart: A\nstates: {a: {}}\n")
    hub = EditHub(EditSession(path))
    with served(hub, page=edit_page) as server:
        seen = Editor(browser, path, server.address)
        path.write_text("chart: A\nstates: {a: <script>\n")
        assert hub.editing.refresh()
        hub.changed()
        seen.page.wait_for_selector("#edit-text:has-text('<script>')")
        seen.page.wait_for_selector("#edit-findings .error")
        assert seen.page.locator("#edit-palette").is_hidden()
        path.write_text("chart: A\nstates: {a: {}, b: {}}\n")
        assert hub.editing.refresh()
        hub.changed()
        seen.page.wait_for_function("() => stateOf('b')")
        assert seen.complaints == []
        seen.context.close()
