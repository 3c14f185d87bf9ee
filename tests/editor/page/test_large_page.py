"""The page of `fsmkit edit` with a chart of hundreds of states, which opens folded."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.editor.page.editor import editing, require_accessible

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
GROUPS = int(os.environ.get("FSMKIT_GROUPS", "26"))
"""Composite states of the chart, of twelve states each; 420 make a chart of 5,000 states."""


def text() -> str:
    lines = ["chart: Rings", "events: {in: [go, ring]}", "states:"]
    for group in range(GROUPS):
        lines += [f"  g{group}:", f"    on: {{ring: g{(group + 1) % GROUPS}}}", "    states:"]
        lines += (f"      g{group}s{n}: {{on: {{go: g{group}s{(n + 1) % 12}}}}}" for n in range(12))
    return "\n".join(lines) + "\n"


def test_a_large_chart_opens_folded_and_unfolds(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "rings.yaml"
    path.write_text(text())
    with editing(browser, path) as editor:
        page = editor.page
        editor.settled()
        editor.picture("large-1-folded")
        assert page.locator("#drawing .state").count() == GROUPS
        editor.choose("g2")
        page.click("#edit-panel button:text-is('Unfold')")
        page.wait_for_function(f"() => views[0].shown.folded.length === {GROUPS - 1}")
        editor.settled()
        editor.picture("large-2-unfolded")
        assert page.locator("#drawing .state").count() == GROUPS + 12
        before = editor.box("g1")
        editor.choose("g2s3")
        page.keyboard.press("n")
        editor.type_in_place("fresh")
        assert editor.box("fresh")
        editor.settled()
        assert page.locator("#drawing .state").count() == GROUPS + 13
        after = editor.box("g1")
        assert (before["width"], before["height"]) == (after["width"], after["height"])
        editor.choose("g2")
        page.keyboard.press("Escape")
        page.locator("#drawing").focus()
        page.keyboard.press("c")
        page.wait_for_function(f"() => views[0].shown.folded.length === {GROUPS}")


COUNTED = """() => {
    const inner = document.createElement.bind(document);
    window.created = 0;
    document.createElement = (tag) => { window.created += 1; return inner(tag); };
}"""
"""Count the elements that the page creates beside the drawing."""


def test_elements_do_not_grow_with_the_states(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "rings.yaml"
    path.write_text(text())
    with editing(browser, path) as editor:
        page = editor.page
        editor.settled()
        assert page.locator("#outline li").count() == 0
        assert page.locator("option").count() < GROUPS + 100
        page.evaluate(COUNTED)
        for operation in (
            "{op: 'AddTransition', source: 'g1', targets: ['g3s2'], trigger: 'after', label: '1s'}",
            "{op: 'AddState', parent: 'g2', name: 'fresh'}",
        ):
            page.evaluate(f"edit([{operation}], () => select({{kind: 'state', id: 'g1'}}))")
            editor.edited()
            editor.settled()
        assert 0 < page.evaluate("created") < 600
        require_accessible(editor)


def test_a_long_list_gets_its_options_when_it_is_opened(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "rings.yaml"
    path.write_text(text())
    with editing(browser, path) as editor:
        page = editor.page
        editor.settled()
        items = page.locator("#edit-item option")
        assert items.all_inner_texts() == ["chart Rings"]
        page.focus("#edit-item")
        page.keyboard.press("ArrowDown")
        assert items.count() == 1 + 26 * GROUPS
        page.wait_for_function("() => selected && selected.id === 'g0'")
        editor.choose("g1s3: go → g1s4")
        target = page.locator(".edit-row:has(span:text-is('to')) select")
        assert target.locator("option").all_inner_texts() == ["g1s4"]
        target.dispatch_event("pointerdown")
        target.select_option("g3s2")
        editor.edited()
        assert "g1s3: {on: {go: g3s2}}" in path.read_text()
        page.click(".which")
        rows = page.locator("#outline li")
        assert rows.count() == GROUPS
        page.locator("#outline .row").first.dblclick()
        page.wait_for_function(
            f"() => document.querySelectorAll('#outline li').length === {GROUPS + 12}"
        )
