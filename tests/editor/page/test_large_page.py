"""The page of `fsmkit edit` with a chart of hundreds of states, which opens folded."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.editor.page.editor import editing

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
        page.select_option("#edit-item", label="g2")
        page.click("#edit-panel button:text-is('Unfold')")
        page.wait_for_function(f"() => views[0].shown.folded.length === {GROUPS - 1}")
        editor.settled()
        editor.picture("large-2-unfolded")
        assert page.locator("#drawing .state").count() == GROUPS + 12
        before = editor.box("g1")
        page.select_option("#edit-item", label="g2s3")
        page.keyboard.press("n")
        editor.type_in_place("fresh")
        assert editor.box("fresh")
        editor.settled()
        assert page.locator("#drawing .state").count() == GROUPS + 13
        after = editor.box("g1")
        assert (before["width"], before["height"]) == (after["width"], after["height"])
        page.select_option("#edit-item", label="g2")
        page.keyboard.press("Escape")
        page.locator("#drawing").focus()
        page.keyboard.press("c")
        page.wait_for_function(f"() => views[0].shown.folded.length === {GROUPS}")
