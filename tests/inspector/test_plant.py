"""The picture of a plant in a browser: it moves and posts, and nothing of it runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import fsmkit
from fsmkit.diagnostics import Findings
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.picture import picture_of, read_picture
from tests.inspector.browsing import looking
from tests.inspector.following import Elsewhere

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
CELL = Path(__file__).parents[2] / "machines/production_cell/live/cell.svg"
PICTURE = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100">
  <script>window.hacked = true</script>
  <rect class="part" width="9" height="9" data-x="Gate.count 0..2 0..100" onclick="hacked = true"/>
  <circle class="frame" cx="20" cy="20" r="8" data-class="lit: Gate.motor; alarm: Gate = wide"/>
  <text x="10" y="60" data-text="Gate" data-machine="Gate">?</text>
  <g data-show="Gate = opening"><path class="line" d="M0 0L9 9"/></g>
  <g data-text="nothing.at.all" data-label="nothing"/>
  <g data-text="Gate.count" data-digits="1" data-label="opened" data-group="Counts"/>
  <g data-post="Gate.open" data-label="Open the gate"><circle cx="100" cy="50" r="9"/></g>
  <g data-post="Gate.fault" data-with="code=jam" data-label="Jam" data-group="Faults"/>
</svg>
"""


def hub_of(gate: Path) -> Hub:
    """Return a session of a gate with a picture."""
    picture = picture_of(PICTURE.encode(), "gate.svg", Findings())
    return Hub(fsmkit.read_chart(gate), picture=picture)


def test_what_is_bound_follows_the_machine(browser: Browser, gate: Path) -> None:
    with looking(browser, hub_of(gate)) as seen:
        page = seen.page
        page.wait_for_selector("#scene text:has-text('closed')")
        assert page.locator(".live-hidden").count() == 1
        assert page.inner_text("#scene tr:has-text('nothing') td") == "\u2013"
        page.locator("#scene .plant circle").nth(1).click()
        page.wait_for_selector("#scene circle.lit")
        assert page.locator(".live-hidden").count() == 0
        page.keyboard.press("t")
        page.wait_for_selector("#scene circle.alarm:not(.lit)")
        assert page.inner_text("#scene tr:has-text('opened') td") == "1.0"
        moved = page.locator("#scene rect[transform]").get_attribute("transform")
        assert moved == "translate(50 0)"
        assert page.evaluate("window.hacked") is None


def test_buttons_are_had_by_keys(browser: Browser, gate: Path) -> None:
    with looking(browser, hub_of(gate)) as seen:
        page = seen.page
        page.get_by_role("button", name="Open the gate").focus()
        page.keyboard.press("Enter")
        page.wait_for_selector("#scene text:has-text('opening')")
        page.get_by_role("group", name="Faults").get_by_role("button", name="Jam").press("Enter")
        page.wait_for_selector("#scene text:has-text('broken')")
        page.get_by_role("button", name="Chart", exact=True).press("Enter")
        assert page.is_hidden("#scene")
        page.get_by_role("button", name="Both", exact=True).press("Enter")
        assert page.is_visible("#scene")
        assert page.is_visible("#drawing")


@pytest.mark.parametrize("options", [{"color_scheme": "dark"}, {"forced_colors": "active"}, {}])
def test_the_cell_fits_a_narrow_page(browser: Browser, gate: Path, options: dict[str, Any]) -> None:
    hub = Hub(Elsewhere(fsmkit.read_chart(gate)), picture=read_picture(CELL, Findings()))
    with looking(browser, hub, viewport={"width": 360, "height": 700}, **options) as seen:
        page = seen.page
        page.wait_for_selector("#scene svg")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        sizes = page.evaluate(
            "[...document.querySelectorAll('#scene .plant text')].map("
            "text => text.getBoundingClientRect()).filter(box => box.height).map("
            "box => [box.height, box.left, box.right])"
        )
        assert len(sizes) > 20
        assert min(height for height, _, _ in sizes) >= 8
        assert min(left for _, left, _ in sizes) >= 0
        assert max(right for _, _, right in sizes) <= 360
