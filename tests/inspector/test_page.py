"""The page in a browser: what is clicked is done, what is active is lit, no text is markup."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import fsmkit
from fsmkit.inspector import charts
from fsmkit.inspector.hub import Hub
from tests.inspector.browsing import Seen, looking
from tests.inspector.conftest import GATE, elaborated
from tests.inspector.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
CELL = Path(__file__).parents[2] / "machines/production_cell/cell.yaml"


@pytest.fixture
def gate_page(browser: Browser, gate: Path) -> Iterator[Seen]:
    """Show a gate."""
    with looking(browser, Hub(fsmkit.read_chart(gate), file=gate)) as seen:
        yield seen


def test_a_click_on_an_event_lights_the_next_state(gate_page: Seen) -> None:
    gate_page.waits("closed")
    page = gate_page.page
    page.get_by_role("button", name="open", exact=True).click()
    gate_page.waits("opening")
    page.wait_for_selector("#drawing #s2.active")
    page.wait_for_selector("#drawing .just-taken#t1")
    assert page.locator("#data .changed").inner_text().split() == ["motor", "true", "output"]
    page.keyboard.press("t")
    gate_page.waits("wide")
    page.keyboard.press("ArrowLeft")
    gate_page.waits("opening")
    page.keyboard.press("Home")
    gate_page.waits()
    page.keyboard.press("End")
    gate_page.waits("wide")
    assert "#" not in page.url  # the token is not seen any more
    page.reload()
    gate_page.waits("wide")


def test_a_breakpoint_stops_and_a_saved_test_passes(gate_page: Seen, tmp_path: Path) -> None:
    page = gate_page.page
    page.fill("#condition", "count == 1")
    page.keyboard.press("Enter")
    page.wait_for_selector("#points :text('condition count == 1')")
    page.get_by_role("button", name="open", exact=True).click()
    gate_page.waits("opening")
    page.select_option("#speed", "100")
    page.click("#run")
    page.wait_for_selector("#mode:has-text('stopped at breakpoint 1')")
    gate_page.waits("wide")
    with page.expect_download() as download:
        page.click("#save-pytest")
    text = Path(download.value.path()).read_text(encoding="utf-8")
    found: dict[str, Any] = {}
    exec(compile(text, str(tmp_path / "gate_test.py"), "exec"), found)
    found["test_it_does_so_again"]()


def test_why_is_answered_and_inputs_are_set(gate_page: Seen) -> None:
    page = gate_page.page
    page.get_by_label("input blocked").check()
    page.wait_for_selector(".event.no:has-text('open')")
    page.get_by_role("button", name="why open").click()
    page.wait_for_selector("#why:has-text('open would do nothing')")
    assert "closed [not blocked]: does not hold; blocked = true" in page.inner_text("#why")


def test_a_refusal_is_shown(gate_page: Seen) -> None:
    gate_page.page.fill("#condition", "cuont == 1")
    gate_page.page.keyboard.press("Enter")
    gate_page.page.wait_for_selector("#notice:has-text('count')")


def test_history_is_scrubbed(gate_page: Seen) -> None:
    page = gate_page.page
    for event in ("open", "t", "close", "open"):
        if event == "t":
            page.keyboard.press("t")
        else:
            page.get_by_role("button", name=event, exact=True).click()
        page.wait_for_timeout(300)
    page.locator("#scrub").fill("3")
    gate_page.waits("opening")
    page.locator("#entries li").first.click()
    gate_page.waits("closed")


def test_a_branch_that_was_left_is_gone_back_to(gate_page: Seen) -> None:
    page = gate_page.page
    page.get_by_role("button", name="open", exact=True).click()
    gate_page.waits("opening")
    page.keyboard.press("t")
    gate_page.waits("wide")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    gate_page.waits("closed")
    page.get_by_label("input blocked").check()
    page.wait_for_selector("#branch:not([hidden])")
    page.select_option("#branches", "0")
    gate_page.waits("wide")
    page.wait_for_selector("#entries .shown:has-text('wide')")


def test_without_graphviz_the_outline_takes_its_place(
    browser: Browser, gate: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(charts, "_drawn", lambda *_: ("", "no Graphviz"))
    with served(Hub(fsmkit.read_chart(gate))) as server:
        seen = Seen(browser, server)
        seen.page.wait_for_selector("#outline:not([hidden])")
        assert seen.page.is_hidden("#drawing")
        assert seen.page.inner_text(".undrawn") == "no Graphviz"
        tree = seen.page.get_by_role("treeitem", selected=True)
        assert tree.inner_text() == "closed"
        seen.page.get_by_role("treeitem").first.focus()
        seen.page.keyboard.press("ArrowDown")
        seen.page.wait_for_selector("#chosen:has-text('opening')")
        assert seen.complaints == []


def test_states_are_folded_in_drawing_and_outline(browser: Browser) -> None:
    chart = fsmkit.read_chart(CELL.parent / "feeder.yaml")
    outer, inner = (chart.state_index[name] for name in ("operational", "homing"))
    with served(Hub(chart)) as server:
        seen = Seen(browser, server)
        page = seen.page
        page.wait_for_selector(f"#drawing #s{inner}")
        page.locator(f"#drawing #s{outer} text").first.dblclick()
        page.wait_for_selector(f"#drawing #s{outer}:has-text('states inside')")
        assert page.locator(f"#drawing #s{inner}").count() == 0
        page.locator("#chosen .fold:text('Unfold')").click()
        page.wait_for_selector(f"#drawing #s{inner}")
        page.keyboard.press("c")
        page.wait_for_selector(f"#drawing #s{outer}:has-text('states inside')")
        page.keyboard.press("o")
        folded = page.locator("#outline [aria-expanded=false]")
        assert folded.count() == 1
        assert page.locator("#outline :text-is('homing')").is_hidden()
        folded.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_selector("#outline :text-is('homing')")
        assert seen.complaints == []


@pytest.mark.parametrize("options", [{"color_scheme": "dark"}, {"forced_colors": "active"}, {}])
def test_a_narrow_page_needs_no_scrolling_sideways(
    browser: Browser, gate: Path, options: dict[str, Any]
) -> None:
    with served(Hub(fsmkit.read_chart(gate))) as server:
        seen = Seen(browser, server, viewport={"width": 360, "height": 700}, **options)
        wide = seen.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= 360
        ground = seen.page.evaluate("getComputedStyle(document.body).backgroundColor")
        if options.get("color_scheme") == "dark":
            assert max(map(int, re.findall(r"\d+", ground)[:3])) < 64


def test_two_pages_see_the_same(browser: Browser, gate: Path) -> None:
    with served(Hub(fsmkit.read_chart(gate))) as server:
        one, other = Seen(browser, server), Seen(browser, server)
        one.page.get_by_role("button", name="open", exact=True).click()
        one.waits("opening")
        other.waits("opening")
        one.page.wait_for_selector("#entries :text('post open (you)')")
        other.page.wait_for_selector("#entries :text('post open (client 1)')")


def test_machines_of_a_system_are_cards(browser: Browser) -> None:
    with served(Hub(fsmkit.read_system(CELL))) as server:
        seen = Seen(browser, server)
        assert seen.page.locator("#machines button .name").all_inner_texts() == [
            "feeder", "molder", "plant",
        ]  # fmt: skip
        seen.page.keyboard.press("2")
        seen.page.wait_for_selector("#title:has-text('molder')")
        seen.page.select_option("#speed", "100")
        seen.page.keyboard.press("Escape")
        seen.page.click("#run")
        seen.page.wait_for_selector("#machines .moved")
        assert seen.complaints == []


HOSTILE = (
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "]]><a xlink:href='javascript:alert(1)'>",
    "\\u202edlrow",
    "&lt;b&gt;",
    "'; alert(1); '",
)


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_of_a_chart_is_markup(browser: Browser, text: str) -> None:
    chart = GATE.replace("chart: Gate", f'chart: "{text}"')
    chart = chart.replace("motor = true", f'motor = true; log "{text}"').replace(
        "initial: closed", f'doc: "{text}"\ninitial: closed'
    )
    with served(Hub(elaborated(chart))) as server:
        seen = Seen(browser, server)
        seen.page.wait_for_selector("#drawing svg")
        seen.page.get_by_role("button", name="open", exact=True).click()
        seen.waits("opening")
        assert seen.complaints == []
        assert seen.page.locator("main img, main script, #drawing a, header img").count() == 0
        assert seen.page.inner_text("#name") == text.replace("\\u202e", "\u202e")
