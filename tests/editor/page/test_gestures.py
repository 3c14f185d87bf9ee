"""Gestures in the page of `fsmkit edit`: by mouse, by keyboard, and what they write."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import fsmkit
from fsmkit.editor.checking.background import Background
from fsmkit.editor.page.following import verdicts_of
from fsmkit.editor.page.hub import Verdict
from tests.editor.page.editor import Editor, editing, require_accessible

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
TRACED = """\
chart: G
events: {in: [go, back, jump]}
states:
  a: {on: {go: b}, rest: true}
  b: {on: {back: a, jump: c}}
  c: {rest: true}
properties:
  never_c: {never: In(c)}
"""


def check(editor: Editor) -> None:
    """Check the file, and show the verdicts."""
    with ThreadPoolExecutor() as other:  # this thread has the loop of Playwright
        checking = other.submit(asyncio.run, Background().check(editor.path, frozenset()))
        found = checking.result()
    assert found is not None
    editor.hub.show_verdicts(verdicts_of(found))


def active(editor: Editor) -> list[str]:
    """Return the active states as they are lit."""
    found: list[str] = editor.page.evaluate(
        "() => [...document.querySelectorAll('#drawing .node.state.active')]"
        ".map((node) => views[0].chart.states[Number(node.id.slice(1))].id)"
    )
    return found


def test_a_counterexample_is_stepped_in_the_drawing(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "g.yaml"
    path.write_text(TRACED)
    with editing(browser, path) as editor:
        page, press = editor.page, editor.page.keyboard.press
        editor.settled()
        check(editor)
        page.click("button.edit-chip.violated:has-text('never_c: violated in 3 steps')")
        page.wait_for_function("() => session.mode.head === 5 && session.mode.n === 0")
        assert page.evaluate("document.activeElement.id") == "step"
        seen = []
        for entry in range(1, 6):
            press("ArrowRight")
            page.wait_for_function("n => session.mode.n === n", arg=entry)
            page.wait_for_function("() => !isPainting")
            seen.append(active(editor))
        assert seen == [["a"], ["a"], ["b"], ["b"], ["c"]]
        assert "end of the trace of never_c" in page.inner_text("#mode")
        editor.picture("trace")
        require_accessible(editor)
        page.click("#back")
        page.wait_for_function("() => session.mode.n === 4")
        page.wait_for_selector("#drawing .state.active:has-text('b')")
        page.click("#mode-edit")
        page.wait_for_selector("[data-property=never_c][aria-pressed=true]")
        page.select_option("#edit-item", label="b: jump → c")
        press("Delete")
        page.wait_for_function("() => !documentOf.traced && documentOf.verdicts.length === 0")
        page.click("#mode-run")
        page.get_by_role("button", name="go", exact=True).click()
        page.wait_for_selector("#drawing .state.active:has-text('b')")
        editor.hub.show_verdicts([Verdict("never_c", "holds", "holds: 2 states")])
        page.wait_for_selector("span.edit-chip.holds:has-text('never_c: holds: 2 states')")


def test_arrows_are_drawn_and_their_ends_are_dragged(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "g.yaml"
    text = "chart: G\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}  # one\n  b: {}\n  c: {}\n"
    path.write_text(text)
    with editing(browser, path) as editor:
        page = editor.page

        def handle(end: str) -> tuple[float, float]:
            """Return where the handle of an end of the selected transition is."""
            page.wait_for_selector(f"#edit-end-{end}")
            box = page.locator(f"#edit-end-{end}").bounding_box()
            assert box is not None
            return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

        def written(line: str) -> None:
            page.wait_for_function("line => documentOf.text.includes(line)", arg=line)
            editor.edited()
            editor.settled()

        editor.settled()
        page.select_option("#edit-item", label="a: go → b")
        page.mouse.move(*handle("target"))
        page.mouse.down()
        page.mouse.move(*editor.middle("c"))
        page.wait_for_selector("#drawing .edit-drop")
        editor.picture("drag-target")
        page.keyboard.press("Escape")
        page.mouse.up()
        assert path.read_text() == text
        editor.drag(handle("target"), editor.middle("c"))
        written("a: {on: {go: c}}  # one")
        assert page.evaluate("selected") == {"kind": "transition", "source": "a", "index": 0}
        editor.drag(handle("source"), editor.middle("b"))
        written("b:\n    on: {go: c}")
        assert page.evaluate("selected") == {"kind": "transition", "source": "b", "index": 0}
        editor.drag(handle("target"), editor.middle("b"))
        written("b:\n    on: {go: b}")
        editor.drag(handle("target"), editor.middle("a"))
        written("b:\n    on: {go: a}")
        box = editor.box("c")
        editor.drag((box["x"] + 2, box["y"] + box["height"] / 2), editor.middle("a"))
        editor.type_in_place("after 5s")
        written("c:\n    after: {5s: a}")
        editor.picture("drawn")
        assert "# one" in path.read_text()


def test_states_and_transitions_are_copied_as_text(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "g.yaml"
    path.write_text(
        "chart: G\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}\n  b:\n    states: {c: {}}\n"
    )
    with editing(browser, path) as editor:
        page, press = editor.page, editor.page.keyboard.press
        editor.context.grant_permissions(["clipboard-read", "clipboard-write"])

        def select(words: str) -> None:
            page.select_option("#edit-item", label=words)
            page.wait_for_function("() => waiting.size === 0 && copiedText.of === selectionKey()")

        def written(line: str) -> None:
            page.wait_for_function("line => documentOf.text.includes(line)", arg=line)
            editor.edited()

        select("a")
        press("Control+c")
        text = page.evaluate("navigator.clipboard.readText()")
        assert text == "states:\n  a: {on: {go: b}}\n"
        select("b")
        press("Control+v")
        written("    states: {c: {}, a2: {on: {go: b}}}\n")
        assert page.evaluate("selected") == {"kind": "state", "id": "a2"}
        select("b")
        press("Control+d")
        written("  b2: {states: {c2: {}, a3: {on: {go: b2}}}}\n")
        select("a: go → b")
        press("Control+x")
        page.wait_for_function("() => !stateOf('a').transitions.length")
        select("c2")
        press("Control+v")
        written("  b2:\n    states: {c2: {on: {go: b}}, a3: {on: {go: b2}}}\n")
        before = path.read_text()
        page.evaluate("navigator.clipboard.writeText('import os')")
        press("Control+v")
        page.wait_for_selector("#notice:has-text('not a part of a chart')")
        assert path.read_text() == before
        page.click("#edit-label")
        page.evaluate("navigator.clipboard.writeText('typed')")
        press("Control+a")
        press("Control+v")  # into the field
        assert page.input_value("#edit-label") == "typed"
        press("Escape")
        assert path.read_text() == before
        for _ in range(4):
            press("Control+z")
            editor.edited()
        assert fsmkit.read_chart(path).states[-1].id == "c"


TYPED = """\
chart: G
events: {in: [go, goal, stop]}
data: {level: 0..9 = 0, lever: bool = false}
operations: [beep(n 0..9), press()]
states:
  a: {on: {go: b}}
  b: {}
"""


def test_labels_are_completed_and_their_findings_shown(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "g.yaml"
    path.write_text(TYPED)
    with editing(browser, path) as editor:
        page, press, type_ = editor.page, editor.page.keyboard.press, editor.page.keyboard.type

        def offered(*names: str) -> None:
            page.wait_for_function(
                "names => names.every((name) => offered.some(({label}) => label === name))"
                " && !$('edit-completions').hidden",
                arg=list(names),
            )

        editor.settled()
        page.select_option("#edit-item", label="a: go → b")
        press("F2")
        page.wait_for_selector("#edit-inline:focus")
        press("Control+A")
        type_("go")
        page.wait_for_function("() => offered.map(({label}) => label).join() === 'goal'")
        press("ArrowDown")
        press("Enter")
        assert page.input_value("#edit-inline") == "goal"
        type_(" [le")
        page.wait_for_function(
            "() => offered.slice(0, 2).map(({label}) => label).join() === 'level,lever'"
        )
        press("ArrowDown")
        press("Tab")
        type_(" > lost")
        page.wait_for_selector("#edit-preview .error:has-text('lost')")
        editor.picture("typed")
        require_accessible(editor)
        for _ in "lost":
            press("Backspace")
        type_("3] / ")
        offered("beep", "press", "level", "send")
        type_("pre")
        page.wait_for_function("() => offered.map(({label}) => label).join() === 'press'")
        editor.picture("offered")
        press("Escape")
        assert page.locator("#edit-completions").is_hidden()
        type_("ss()")
        page.wait_for_selector("#edit-preview .error", state="detached")
        press("Enter")
        page.wait_for_selector("#edit-inline", state="detached")
        editor.edited()
        assert "goal: {if: level > 3, target: b, do: press()}" in path.read_text()
        field = page.locator("#edit-panel label:has(span:text-is('do')) >> css=textarea")
        field.click()
        press("End")
        type_("; be")
        page.wait_for_function("() => offered.map(({label}) => label).join() === 'beep'")
        press("ArrowDown")
        press("Enter")
        type_("(3)")
        press("Control+Enter")
        page.wait_for_function("() => documentOf.text.includes('beep(3)')")


def test_a_new_name_goes_to_the_files_that_refer_to_it(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "base.yaml"
    path.write_text("chart: Base\nevents: {in: [go]}\nstates:\n  a: {on: {go: b}}\n  b: {}\n")
    derived = tmp_path / "parts" / "derived.yaml"
    derived.parent.mkdir()
    derived.write_text(
        "chart: Derived\nextends: ../base.yaml\nrefine:\n  a:\n    on: {stop: b}  # b\n"
        "events: {in: [stop]}\n"
    )
    texts = [path.read_text(), derived.read_text()]
    with editing(browser, path) as editor:
        page = editor.page
        page.select_option("#edit-item", label="b")
        for answer in ("Cancel", "Rename in all files"):
            page.fill("#edit-name", "idle")
            page.press("#edit-name", "Enter")
            page.wait_for_selector("#edit-confirm li:text-is('parts/derived.yaml')")
            editor.picture("confirm")
            if answer == "Cancel":
                require_accessible(editor, "#edit-confirm")
            page.click(f"#edit-confirm button:text-is('{answer}')")
            if answer == "Cancel":
                page.wait_for_function("() => $('edit-name').value === 'b'")
                assert [path.read_text(), derived.read_text()] == texts
        page.wait_for_function("() => stateOf('idle')")
        editor.edited()
        assert "on: {stop: idle}  # b" in derived.read_text()
        assert fsmkit.read_chart(derived).states[-1].id == "idle"
        page.click("#edit-undo")
        page.wait_for_function("() => stateOf('b')")
        editor.edited()
        assert [path.read_text(), derived.read_text()] == texts


def test_several_states_are_moved_wrapped_copied_and_removed(
    browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "g.yaml"
    text = "chart: G\nstates:\n  a: {}\n  b: {}\n  c: {}\n  d:\n    states: {e: {}}\n"
    path.write_text(text)
    with editing(browser, path) as editor:
        page, press = editor.page, editor.page.keyboard.press

        def written(result: str) -> None:
            page.wait_for_function("text => documentOf.text === text", arg=result)
            editor.edited()
            editor.settled()

        editor.settled()
        page.mouse.click(*editor.middle("a"))
        page.wait_for_function("() => selected && selected.id === 'a'")
        page.keyboard.down("Shift")
        page.mouse.click(*editor.middle("b"))
        page.keyboard.up("Shift")
        page.wait_for_selector("#edit-panel:has-text('2 states are selected')")
        editor.picture("several")
        require_accessible(editor, "#edit-panel")
        box = editor.box("e")
        editor.drag(editor.middle("b"), (box["x"] - 3, box["y"] - 3))
        written("chart: G\nstates:\n  c: {}\n  d:\n    states: {e: {}, a: {}, b: {}}\n")
        press("Control+z")
        written(text)
        page.select_option("#edit-item", label="a")
        press("Shift+ArrowDown")
        press("Shift+ArrowDown")
        page.wait_for_function("() => copiedText.of === selectionKey() && also.length === 2")
        press("Control+d")
        written(text + "  a2: {}\n  b2: {}\n  c2: {}\n")
        press("Control+z")
        written(text)
        page.select_option("#edit-item", label="a")
        press("Shift+ArrowDown")
        page.click("#edit-panel button:text-is('Wrap')")
        page.wait_for_function("() => stateOf('group1') && stateOf('b').parent === 'group1'")
        editor.edited()
        press("Control+z")
        written(text)
        page.select_option("#edit-item", label="a")
        press("Shift+ArrowDown")
        press("Delete")
        written("chart: G\nstates:\n  c: {}\n  d:\n    states: {e: {}}\n")
