"""The tutorial `Draw your first machine`: each of its steps, done in a browser."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fsmkit.cli import execute
from tests.editor.page.editor import PICTURES, Editor, editing

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
PAGE = Path(__file__).parents[3] / "docs" / "tutorial" / "draw-your-first-machine.md"
BLESS = bool(os.environ.get("FSMKIT_BLESS"))
PART = re.compile(
    r"^\d\. (?P<step>.*)$|^!\[.*\]\(\.\./pictures/(?P<picture>.*)\.png\)$"
    r"|^```yaml\n(?P<text>(?s:.*?))```$|^```console\n(?P<console>(?s:.*?))```$",
    re.MULTILINE,
)
"""The parts of the page: steps, pictures, the text of the file, commands with their output."""


def add_state(editor: Editor, name: str) -> None:
    editor.page.keyboard.press("n")
    editor.type_in_place(name)


def connect(editor: Editor, source: str, target: str, label: str) -> None:
    editor.settled()
    editor.page.mouse.click(*editor.middle(source))
    editor.page.wait_for_function("id => selected && selected.id === id", arg=source)
    handle = editor.page.locator("#edit-handle").bounding_box()
    assert handle is not None
    start = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    editor.drag(start, editor.middle(target))
    editor.type_in_place(label)


def declare(editor: Editor, section: str, text: str, button: str) -> None:
    editor.page.select_option("#edit-item", "")
    editor.page.click(f"#edit-section-{section} > summary")
    form = editor.page.locator(f"#edit-declare-{section}")
    form.locator("input").first.fill(text)
    form.get_by_role("button", name=button, exact=True).click()
    editor.page.wait_for_selector(
        f"#edit-section-{section} li:has-text('{text.split('(', maxsplit=1)[0]}')"
    )


def select(editor: Editor, state: str) -> None:
    editor.settled()
    editor.page.mouse.click(*editor.middle(state))
    editor.page.wait_for_function("id => selected && selected.id === id", arg=state)


def fill(editor: Editor, state: str, text: str, key: str) -> None:
    select(editor, state)
    field = editor.page.locator(f"#edit-panel label:has(span:text-is('{key}')) >> css=textarea")
    field.fill(text)
    field.blur()
    editor.edited()


def tick(editor: Editor, state: str, key: str) -> None:
    select(editor, state)
    editor.page.locator(f"#edit-panel label:has(span:text-is('{key}')) >> css=input").check()
    editor.page.wait_for_function(
        "([id, key]) => stateOf(id).keys[key] && stateOf(id).keys[key][0] === 'true'",
        arg=[state, key],
    )


def press(editor: Editor, name: str) -> None:
    editor.settled()
    editor.page.get_by_role("button", name=name, exact=True).first.click()
    editor.edited()


def press_event(editor: Editor, name: str, state: str) -> None:
    press(editor, name)
    editor.page.wait_for_selector(f"#drawing .state.active:has-text('{state}')")


def press_mode(editor: Editor, name: str) -> None:
    editor.page.click(f"#mode-{name.lower()}")


STEPS: dict[str, Callable[..., None]] = {
    r"Press \*\*n\*\*, type `(.*)`, and press \*\*Enter\*\*\.": add_state,
    r"Drag the handle of `(.*)` to `(.*)`, type `(.*)`, and press \*\*Enter\*\*\.": connect,
    r"Select nothing, open \*\*(.*)\*\* in the panel, "
    r"type `(.*)`, and press \*\*(.*)\*\*\.": declare,
    r"Click `(.*)`, and type `(.*)` into \*\*(.*)\*\*\.": fill,
    r"Click `(.*)`, and tick \*\*(.*)\*\*: .*": tick,
    r"Press the button \*\*(Tidy)\*\*: .*": press,
    r"Press the button \*\*(Run)\*\*\.": press_mode,
    r"Press the button \*\*(.*)\*\*: `(.*)` is active, .*": press_event,
}  # fmt: skip
"""The sentences of the page, and what they do."""


def test_the_tutorial_is_followed_to_the_letter(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    path = tmp_path / "lamp.yaml"
    found = text
    done: list[str] = []
    with editing(browser, path) as editor:
        editor.page.wait_for_selector("#edit-hint:visible")
        assert not path.exists()
        for part in PART.finditer(text):
            if part["step"]:
                matches = [(re.fullmatch(p, part["step"]), act) for p, act in STEPS.items()]
                (match, act) = next((m, a) for m, a in matches if m)
                act(editor, *match.groups())
                done.append(part["step"])
            elif part["picture"]:
                editor.page.wait_for_function("() => !loading && waiting.size === 0")
                editor.picture(part["picture"])
                if not PICTURES:
                    assert (PAGE.parents[1] / "pictures" / f"{part['picture']}.png").is_file()
            elif part["text"] is not None:
                found = found.replace(part[0], f"```yaml\n{path.read_text()}```")
            else:
                command = part["console"].splitlines()[0].removeprefix("$ ")
                assert execute(shlex.split(command)[1:]) == 0
                printed = re.sub(r"\d+\.\d s", "0.1 s", capsys.readouterr().out)
                found = found.replace(part[0], f"```console\n$ {command.strip()}\n{printed}```")
    if BLESS:
        PAGE.write_text(found, encoding="utf-8")
    else:
        assert found == text
    assert len(done) == 12
