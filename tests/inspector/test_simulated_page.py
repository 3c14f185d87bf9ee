"""The page of ``fsmkit simulate`` in a browser: from a file, with the net cut, by keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fsmkit.cli import execute
from fsmkit.diagnostics import Findings
from fsmkit.inspector.bundle import Scenario, simulating_page
from fsmkit.runtime.script import run_script
from fsmkit.system.any_file import load_any
from fsmkit.system.of_one_chart import system_of
from tests.injection.payloads import PAYLOADS
from tests.inspector.browsing import Watched
from tests.inspector.conftest import GATE, elaborated

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.external, pytest.mark.slow]
CELL = Path(__file__).parents[2] / "machines/production_cell"
FAST = 5_000
"""Milliseconds until what is waited for must be there."""
SCRIPT = """\
start 0
run 0
post open
run 0
run 4000
post close
run 4000
"""


class Opened(Watched):
    """A page from a file, with the net cut; what it complained of, and what it asked others for."""

    def __init__(self, browser: Browser, path: Path) -> None:
        super().__init__(browser, FAST, offline=True)
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("#title:not(:empty)")

    def waits(self, *states: str) -> None:
        """Wait until exactly these states are lit."""
        self.page.wait_for_function(
            "states => JSON.stringify([...document.querySelectorAll('#outline .active > .row')]"
            ".map(row => row.firstChild.data)) === JSON.stringify(states)",
            arg=list(states),
        )

    def closes(self) -> None:
        """Close it; it asked nobody for anything but itself, and said nothing."""
        assert self.complaints == []
        assert len(self.requests) == 1
        self.context.close()


@pytest.fixture
def opened(browser: Browser, gate: Path, tmp_path: Path) -> Iterator[Opened]:
    """Show a gate, with a scenario."""
    (tmp_path / "once.txt").write_text(SCRIPT, encoding="utf-8")
    page = tmp_path / "gate.html"
    scenario = str(tmp_path / "once.txt")
    assert execute(["simulate", str(gate), "--out", str(page), "--script", scenario]) == 0
    seen = Opened(browser, page)
    yield seen
    seen.closes()


def test_a_scenario_is_stepped_through_by_keys(opened: Opened) -> None:
    page = opened.page
    page.get_by_role("button", name="once", exact=True).focus()
    page.keyboard.press("Enter")
    opened.waits()
    for states in (["closed"], ["closed"], ["opening"], ["wide"], ["wide"], ["closed"]):
        page.keyboard.press("ArrowRight")
        opened.waits(*states)
    page.keyboard.press("ArrowLeft")
    opened.waits("wide")
    page.keyboard.press("Home")
    opened.waits()
    page.keyboard.press("End")
    opened.waits("closed")


def test_what_a_reviewer_did_is_a_script(opened: Opened, tmp_path: Path) -> None:
    page = opened.page
    page.get_by_role("button", name="open", exact=True).click()
    opened.waits("opening")
    page.keyboard.press("t")
    opened.waits("wide")
    with page.expect_download() as download:
        page.click("#save-script")
    saved = tmp_path / "saved.txt"
    download.value.save_as(saved)
    lines = saved.read_text(encoding="utf-8").splitlines()
    assert run_script(elaborated(GATE), lines)[-1] == "= wide"


def test_time_runs_and_stops_at_a_breakpoint(opened: Opened) -> None:
    page = opened.page
    page.fill("#condition", "count == 1")
    page.keyboard.press("Enter")
    page.wait_for_selector("#points button")
    page.get_by_role("button", name="open", exact=True).click()
    opened.waits("opening")
    page.get_by_role("button", name="why fault").click()
    page.wait_for_selector("#why:has-text('event.code != Fault.none')")
    page.select_option("#speed", "100")
    page.click("#run")
    opened.waits("wide")
    page.wait_for_selector("#mode:has-text('breakpoint 1')")
    page.fill("#condition", "count << 1 == 1")
    page.keyboard.press("Enter")
    page.wait_for_selector("#notice:has-text('a page does not evaluate')")


def test_microsteps_and_search_are_there_without_a_server(opened: Opened) -> None:
    page = opened.page
    page.get_by_role("button", name="open", exact=True).click()
    opened.waits("opening")
    page.keyboard.press("t")
    opened.waits("wide")
    page.keyboard.press("Shift+ArrowRight")
    page.wait_for_selector("#mode:has-text('microstep 1 of')")
    page.fill("#sought", "entered opening")
    page.click("#find-back")
    opened.waits("opening")
    page.wait_for_selector("#found:has-text('entry')")


@pytest.mark.parametrize(("name", "most"), [("feeder", 320_000), ("ring", 1_500_000)])
def test_the_cell_fits_into_an_attachment(
    browser: Browser, name: str, most: int, tmp_path: Path
) -> None:
    page = tmp_path / f"{name}.html"
    system = load_any(CELL / f"{name}.yaml", Findings())
    page.write_bytes(simulating_page(system).text)
    assert page.stat().st_size <= most
    seen = Opened(browser, page)
    seen.page.select_option("#speed", "0")
    seen.page.click("#run")
    seen.page.wait_for_selector("#mode:not(:has-text('paused'))")
    seen.closes()


def test_no_text_is_executed(browser: Browser, tmp_path: Path) -> None:
    texts = [text for text in PAYLOADS.values() if "\x00" not in text]
    hostile = "<img src=x onerror=alert(1)></script><script>alert(1)</script>"
    chart = GATE.replace("chart: Gate", f'chart: "{hostile}"').replace(
        "motor = true", f'motor = true; log "{hostile}"'
    )
    scenarios = [Scenario(text, {"actions": [{"do": "start"}]}) for text in texts]
    page = tmp_path / "hostile.html"
    model = system_of(elaborated(chart))
    page.write_bytes(simulating_page(model, file=hostile, scenarios=scenarios).text)
    seen = Opened(browser, page)
    assert seen.page.locator("#scenarios button").count() == len(texts)
    assert seen.page.inner_text("#name") == hostile
    seen.page.get_by_role("button", name="open", exact=True).click()
    seen.waits("opening")
    with seen.page.expect_download():
        seen.page.click("#save-pytest")
    assert seen.page.locator("main img, main script, #drawing a, header img").count() == 0
    seen.closes()
