"""What the page shows beside the drawing of one chart, and how it may be looked at."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import fsmkit
from fsmkit.diagnostics import Findings
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.page import HERE, page
from fsmkit.inspector.picture import read_picture
from tests import needs
from tests.inspector.browsing import Seen, looking
from tests.inspector.conftest import REGIONS, Client, elaborated
from tests.inspector.test_driven import Stepped

if TYPE_CHECKING:
    from playwright.sync_api import Browser

MACHINES = Path(__file__).parents[2] / "machines/production_cell"
AXE = Path(__file__).parents[2] / "build/node/node_modules/axe-core/axe.min.js"
POSTING = "([m, event]) => say('post', {m, event, with: {}})"
RICH = """\
chart: Rich
types:
  Colour: [red, green]
  Point: {x: -5..5, "y": -5..5}
events:
  in:
    - paint(colour Colour, at Point, twice bool, share float64, steps int8[3])
    - go
data: {n: 0..100 = 0}
initial: a
states:
  a:
    on:
      go: {target: b, do: n = n + 7}
      paint: {if: event.twice, target: b}
  b: {always: c}
  c: {on: {go: a}}
"""


def test_the_page_is_small_and_still() -> None:
    assert len(page().text) <= 150_000
    style = (HERE / "page.css").read_text(encoding="utf-8")
    assert not re.search(r"transition:|animation|@keyframes|https?:|@import", style)
    for script in HERE.glob("*.js"):
        text = script.read_text(encoding="utf-8")
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|eval\(|document\.write", text)


@pytest.fixture(scope="module")
def feeder() -> fsmkit.Chart:
    return fsmkit.read_chart(MACHINES / "feeder.yaml")


@pytest.fixture
def feeder_page(browser: Browser, feeder: fsmkit.Chart) -> Iterator[Seen]:
    with looking(browser, Hub(feeder), viewport={"width": 1200, "height": 800}) as seen:
        seen.page.wait_for_selector("#drawing svg")
        yield seen


@pytest.fixture
def gate_page(browser: Browser, gate: Path) -> Iterator[Seen]:
    with looking(browser, Hub(fsmkit.read_chart(gate), file=gate)) as seen:
        yield seen


def _box(seen: Seen) -> list[float]:
    text = seen.page.get_attribute("#drawing svg", "viewBox")
    assert text is not None
    return [float(number) for number in text.split()]


def _letters(seen: Seen) -> float:
    """Return the height of the small letters of the drawing in pixels."""
    return float(seen.page.evaluate("LETTER / views[0].look.unit()"))


@pytest.mark.external
@pytest.mark.slow
class TestDrawing:
    def test_what_is_active_is_followed_and_readable(self, feeder_page: Seen) -> None:
        page = feeder_page.page
        page.evaluate(
            "window.moves = 0; new MutationObserver(() => { window.moves += 1; })"
            ".observe(document.querySelector('#drawing svg'), {attributeFilter: ['viewBox']})"
        )
        for event in ("power_ok", "home_permit", "limit", "arrived", "arrived"):
            page.evaluate(POSTING, ["Feeder", event])
            page.wait_for_timeout(100)
        page.wait_for_timeout(700)
        inside = page.evaluate(
            """() => {
              const frame = document.querySelector('#drawing').getBoundingClientRect();
              const leaf = [...document.querySelectorAll('#drawing .node.active')].at(-1);
              const box = leaf.getBoundingClientRect();
              return box.left >= frame.left && box.right <= frame.right
                && box.top >= frame.top && box.bottom <= frame.bottom;
            }"""
        )
        assert inside
        assert _letters(feeder_page) >= 10.9
        assert page.evaluate("window.moves") <= 4  # in 1.2 seconds: twice a second at most

    def test_it_is_zoomed_moved_and_seen_whole(self, feeder_page: Seen) -> None:
        page = feeder_page.page
        page.wait_for_selector(".map")  # by the first paint
        begin = _box(feeder_page)
        page.keyboard.press("+")
        assert _box(feeder_page)[2] < begin[2]
        assert page.get_attribute("#follow", "aria-pressed") == "false"
        page.keyboard.press("l")
        page.keyboard.press("j")
        moved = _box(feeder_page)
        assert moved[0] > begin[0]
        page.keyboard.press("0")
        whole = _box(feeder_page)
        assert whole[2] > 900
        page.wait_for_selector(".map", state="hidden")
        page.mouse.move(400, 400)
        page.mouse.wheel(0, -300)
        page.wait_for_function("w => views[0].look.box[2] < w", arg=whole[2])
        before = _box(feeder_page)
        page.mouse.down()
        page.mouse.move(300, 350, steps=3)
        page.mouse.up()
        assert _box(feeder_page)[0] > before[0]
        page.keyboard.press("f")
        page.wait_for_timeout(600)
        assert _letters(feeder_page) == pytest.approx(11, abs=0.1)
        page.locator(".map").click(position={"x": 20, "y": 60})
        assert page.get_attribute("#follow", "aria-pressed") == "false"

    def test_what_is_inherited_is_left_out(self, feeder_page: Seen) -> None:
        page = feeder_page.page
        count = "document.querySelectorAll('#drawing .transition.inherited').length"
        before = page.evaluate(count)
        page.keyboard.press("i")
        page.wait_for_function(f"() => {count} < {before} / 2")
        page.keyboard.press("x")
        page.wait_for_function("() => !document.querySelector('#drawing .watchdog')")
        page.keyboard.press("x")
        page.keyboard.press("i")
        page.wait_for_function(f"() => {count} === {before}")

    def test_no_text_is_wider_than_its_box_whatever_the_letters(
        self, browser: Browser, feeder: fsmkit.Chart
    ) -> None:
        for chart in (feeder, fsmkit.read_chart(MACHINES / "molder.yaml")):
            with looking(browser, Hub(chart)) as seen:
                seen.page.wait_for_selector("#drawing svg")
                seen.page.evaluate(
                    "document.styleSheets[0].insertRule('svg text { font: 14px monospace; }')"
                )
                wide = seen.page.evaluate(TOO_WIDE)
                assert wide  # these letters are wider than those of the layout
                seen.page.evaluate("views[0].look.boxes = null; repaint()")
                seen.page.wait_for_function(f"() => ({TOO_WIDE})().length === 0")

    def test_what_is_not_known_is_hatched(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.evaluate("take({k: 'lost', n: 1, at: 0, count: 3, where: 'ring'}); repaint()")
        page.wait_for_selector("#drawing #s1.unknown")
        assert "hatch" in page.evaluate(
            "getComputedStyle(document.querySelector('#drawing #s1 path')).fill"
        )
        assert "3 messages lost" in page.inner_text("#mode")
        page.get_by_role("button", name="open", exact=True).click()
        page.keyboard.press("Home")
        page.wait_for_selector("#drawing #s1:not(.unknown)")

    @pytest.mark.parametrize("width", [700, 900, 1400, 2000])
    def test_a_drawing_is_whole_at_first_where_it_can_be_read(
        self, browser: Browser, width: int
    ) -> None:
        size = {"width": width, "height": width * 3 // 4}
        with looking(browser, Hub(elaborated(REGIONS)), viewport=size) as seen:
            seen.page.wait_for_function("() => views[0].look.sized || views[0].look.moved > 0")
            whole = seen.page.evaluate("LETTER / views[0].look.unit(views[0].look.whole)")
            box, drawing = _box(seen), seen.page.evaluate("views[0].look.whole")
            is_whole = box[2] >= drawing[2] and box[3] >= drawing[3]
            assert is_whole == (whole >= 8)
            assert _letters(seen) >= 8

    @pytest.mark.parametrize("name", ["feeder", "molder", "supervisor"])
    def test_the_small_map_covers_no_text(self, browser: Browser, name: str) -> None:
        hub = Hub(fsmkit.read_chart(MACHINES / f"{name}.yaml"))
        with looking(browser, hub, viewport={"width": 1000, "height": 700}) as seen:
            seen.page.wait_for_function("() => views[0].look.boxes")
            found = seen.page.evaluate(MAPS)
        assert found["covered"] == []
        assert found["shown"] > found["hidden"]

    def test_each_region_has_its_own_path(self, browser: Browser) -> None:
        with looking(browser, Hub(elaborated(REGIONS))) as seen:
            seen.page.evaluate(POSTING, ["Press", "start"])
            seen.waits("working", "motion", "idle", "light", "off")
            paths = seen.page.locator("#path > span").all_inner_texts()
            assert paths == ["working", "motion / idle", "light / off"]

    @pytest.mark.parametrize("width", [800, 1000, 1600])
    def test_the_end_of_a_path_is_seen(self, browser: Browser, width: int) -> None:
        chart = fsmkit.read_chart(MACHINES / "feeder.yaml")
        with looking(browser, Hub(chart), viewport={"width": width, "height": 700}) as seen:
            for event in ("power_ok", "home_permit"):
                seen.page.evaluate(POSTING, ["Feeder", event])
            seen.waits("operational", "homing", "seeking")
            ends = seen.page.evaluate(
                """() => [...document.querySelectorAll('#path > span')].map((span) => {
                  const [outer, inner] = [span, span.firstChild];
                  return outer.getBoundingClientRect().right - inner.getBoundingClientRect().right;
                })"""
            )
            assert len(ends) == 1
            assert all(0 <= end < 2 for end in ends)

    def test_a_click_shows_the_source(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.locator("#drawing #s2 text").first.click()
        assert page.inner_text("#chosen .here").strip().endswith("opening:")
        page.keyboard.press("b")
        page.wait_for_selector("#points :text('entered Gate: opening')")
        page.wait_for_selector("#drawing #s2.breakpoint")
        page.get_by_label("remove breakpoint 1").click()
        page.wait_for_selector("#points :text('none')")


MAPS = """() => {
  const { look } = views[0];
  const [x, y, w, h] = look.whole;
  const found = { covered: [], shown: 0, hidden: 0 };
  for (let i = 0; i <= 12; i += 1) {
    for (let k = 0; k <= 12; k += 1) {
      look.centre(x + (w * i) / 12, y + (h * k) / 12, LETTER / LEAST);
      look.drawMap([]);
      found[look.map.hidden ? "hidden" : "shown"] += 1;
      if (look.map.hidden) continue;
      const map = look.map.getBoundingClientRect();
      for (const text of document.querySelectorAll("#drawing text")) {
        const box = text.getBoundingClientRect();
        const isBeside = box.right <= map.left || box.left >= map.right;
        if (isBeside || box.bottom <= map.top || box.top >= map.bottom) continue;
        found.covered.push([text.textContent, i, k]);
      }
    }
  }
  return found;
}"""
TOO_WIDE = """() => [...document.querySelectorAll('#drawing .state')].flatMap((group) => {
  const border = group.querySelector('path, polygon, ellipse');
  const right = border.getBBox().x + border.getBBox().width;
  return [...group.querySelectorAll('text')].filter((text) =>
    text.getBBox().x + text.getBBox().width > right + 0.5);
}).map((text) => text.textContent)"""


@pytest.mark.external
@pytest.mark.slow
class TestPanels:
    def test_payloads_are_typed(self, browser: Browser) -> None:
        with looking(browser, Hub(elaborated(RICH))) as seen:
            page = seen.page
            page.get_by_label("colour of paint").select_option("green")
            page.get_by_label("at of paint x").fill("-3")
            page.get_by_label("twice of paint").check()
            page.get_by_label("share of paint").fill("0.25")
            page.get_by_label("steps of paint 2").fill("7")
            page.get_by_role("button", name="paint", exact=True).click()
            seen.waits("c")
            said = page.locator("#entries li:has-text('post paint')").inner_text()
            assert "green {x: -3, y: 0} true 0.25 [0 0 7]" in said
            assert page.get_by_label("colour of paint").input_value() == "green"  # is kept
            page.get_by_label("at of paint x").fill("9")
            page.get_by_role("button", name="paint", exact=True).click()
            page.wait_for_selector("#notice:has-text('-5..5')")

    def test_microsteps_are_gone_through(self, browser: Browser) -> None:
        with looking(browser, Hub(elaborated(RICH))) as seen:
            page = seen.page
            page.get_by_role("button", name="go", exact=True).click()
            seen.waits("c")
            page.keyboard.press("Shift+ArrowRight")
            seen.waits("b")
            page.keyboard.press("Shift+ArrowRight")
            seen.waits("c")
            page.wait_for_selector("#mode:has-text('microstep 2 of 2')")
            page.keyboard.press("Shift+ArrowRight")
            page.wait_for_selector("#mode:has-text('paused')")
            page.keyboard.press("Shift+ArrowLeft")
            page.keyboard.press("Shift+ArrowLeft")
            seen.waits("b")

    def test_a_timer_is_fired(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.get_by_role("button", name="open", exact=True).click()
        page.get_by_role("button", name="fire now: opening: after T_OPEN (4s)").click()
        gate_page.waits("wide")
        assert page.inner_text("#clock") == "4.000 s"

    def test_history_is_searched(self, gate_page: Seen) -> None:
        page = gate_page.page
        for event in ("open", "close", "open", "close"):
            page.get_by_role("button", name=event, exact=True).click()
            page.keyboard.press("t")
            page.wait_for_timeout(150)
        page.keyboard.press("s")
        page.keyboard.type("count == 1")
        page.locator("#find-back").click()
        page.wait_for_selector("#found:has-text('entry 4')")
        gate_page.waits("wide")
        page.locator("#sought").fill("entered wide")
        page.locator("#sought").press("Enter")
        page.wait_for_selector("#found:has-text('entry 9')")
        page.locator("#sought").press("Enter")
        page.wait_for_selector("#found:has-text('not after')")
        page.locator("#sought").fill("entered wid")
        page.locator("#sought").press("Enter")
        page.wait_for_selector("#notice:has-text('`wide`')")

    def test_watches_and_marks(self, gate_page: Seen) -> None:
        page = gate_page.page
        for panel in ("Watches", "Marks"):
            page.get_by_text(panel, exact=True).click()
        page.fill("#watched", "count + 1")
        page.locator("#watched").press("Enter")
        page.wait_for_selector("#watches :text('count + 1 = 1')")
        page.fill("#marked", "shut")
        page.locator("#marked").press("Enter")
        page.get_by_role("button", name="open", exact=True).click()
        page.locator("#events").press("t")
        gate_page.waits("wide")
        page.wait_for_selector("#watches :text('count + 1 = 2')")
        page.get_by_role("button", name="shut: entry 1").click()
        gate_page.waits("closed")
        page.fill("#watched", "cuont")
        page.locator("#watched").press("Enter")
        page.wait_for_selector("#notice:has-text('count')")

    def test_lanes_are_scrubbed_by_mouse(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.get_by_role("button", name="open", exact=True).click()
        page.keyboard.press("t")
        gate_page.waits("wide")
        page.locator("#lanes").click(position={"x": 190, "y": 6})  # 60 pixels an entry
        gate_page.waits("opening")
        page.locator("#scrub").focus()
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("ArrowLeft")
        gate_page.waits("closed")

    def test_what_was_long_ago_is_seen_again(self, browser: Browser, gate: Path) -> None:
        hub = Hub(fsmkit.read_chart(gate))
        client = Client(hub)
        for _ in range(1_500):
            client.result("post", m="Gate", event="close")
        client.result("post", m="Gate", event="open")
        client.result("seek", n=700)
        lane = "lanes.stays(lanes.all(), lanes.window.from, lanes.window.last)[0]"
        with looking(browser, hub) as seen:
            seen.waits("closed")  # although the entries that come go on to the last
            seen.page.wait_for_function(
                "() => session.entries.has(640) && session.entries.has(730)"
            )
            assert [stay["on"] for stay in seen.page.evaluate(lane)] == ["closed"]
            assert seen.page.evaluate("session.mode.n") == 700
            seen.page.evaluate("say('seek', {n: 1400})")
            seen.page.wait_for_function("() => session.entries.has(1430)")
            assert [stay["on"] for stay in seen.page.evaluate(lane)] == ["closed"]
            seen.waits("closed")

    @pytest.mark.parametrize("speed", [0.2, 1.0, 5.0, 250.0, 0.0])
    def test_the_speed_of_what_is_driven_is_kept(
        self, browser: Browser, gate: Path, speed: float
    ) -> None:
        source = Stepped(fsmkit.read_chart(gate), frozenset({"post", "run", "pause", "step"}))
        source.speed = speed
        hub = Hub(source)
        hub.advance(1_000)
        with looking(browser, hub) as seen:
            page = seen.page
            page.wait_for_function("speed => Number($('speed').value) === speed", arg=speed)
            page.click("#run")
            page.wait_for_selector("#run:text('Run')")
            page.click("#run")
            page.wait_for_selector("#run:text('Pause')")
            assert source.speed == speed
            page.select_option("#speed", "10")
            page.wait_for_function("() => session.mode.speed === 10")
            assert source.speed == 10

    def test_the_test_is_shown_before_it_is_saved(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.get_by_role("button", name="open", exact=True).click()
        page.click("#save-show")
        page.wait_for_selector("#save-text:has-text('Gate_test.py')")
        assert "post open" in page.inner_text("#save-text")

    def test_a_panel_that_is_folded_is_not_painted(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.get_by_text("Data", exact=True).click()
        page.get_by_role("button", name="open", exact=True).click()
        gate_page.waits("opening")
        page.wait_for_timeout(200)
        cells = "[...document.querySelectorAll('#data td.value')].map(cell => cell.textContent)"
        assert "true" not in page.evaluate(cells)
        page.get_by_text("Data", exact=True).click()
        page.evaluate("repaint()")
        page.wait_for_function(f"() => {cells}.includes('true')")

    def test_slow_paints_are_thirty_a_second(self, gate_page: Seen) -> None:
        page = gate_page.page
        count = page.evaluate(
            """() => new Promise((resolve) => {
              const busy = (end) => { while (performance.now() < end); };
              paint = () => busy(performance.now() + 16);
              repaint();
              setTimeout(() => {
                const before = pictures;
                const timer = setInterval(repaint, 1);
                setTimeout(() => { clearInterval(timer); resolve(pictures - before); }, 1000);
              }, 300);
            })"""
        )
        assert 5 <= count <= 32


@pytest.mark.external
@pytest.mark.slow
class TestSystem:
    @pytest.fixture
    def ring_page(self, browser: Browser) -> Iterator[Seen]:
        hub = Hub(fsmkit.read_system(MACHINES / "ring.yaml"))
        with looking(browser, hub, viewport={"width": 1300, "height": 850}) as seen:
            seen.page.evaluate("say('step', {how: 'time', at: 1500})")
            seen.page.wait_for_selector("#clock:has-text('1.500 s')")
            yield seen

    def test_cards_drawings_beside_and_messages(self, ring_page: Seen) -> None:
        page = ring_page.page
        assert "lost" not in page.inner_text("#mode")
        assert page.locator(".card").count() >= 9
        page.wait_for_selector(".card:has-text('supervisor') .timer")
        page.keyboard.press("3")
        page.wait_for_selector("#title:has-text('feeder')")
        page.keyboard.press("Shift+5")
        page.wait_for_selector(".view >> nth=1 >> .drawing svg >> .active")
        assert page.locator(".view").count() == 2
        page.get_by_role("button", name="Remove this drawing").click()
        assert page.locator(".view").count() == 1
        page.keyboard.press("q")
        page.wait_for_selector("#sequence svg text:has-text('goto 100 20')")
        with page.expect_download() as download:
            page.click("#sequence-mermaid")
        text = Path(download.value.path()).read_text(encoding="utf-8")
        assert re.search(r"p\d+->>p\d+: goto 100 20", text)
        with page.expect_download() as download:
            page.click("#sequence-svg")
        saved = fsmkit_svg(Path(download.value.path()).read_bytes())
        assert "supervisor" in saved

    def test_a_lost_message_is_crossed_out(self, gate_page: Seen) -> None:
        page = gate_page.page
        page.keyboard.press("q")
        for _ in range(12):
            page.evaluate("say('post', {m: 'Gate', event: 'fault', with: {code: 'jam'}})")
        page.evaluate(
            "take({k: 'post', m: 'Gate', n: session.mode.n + 1, at: 0, event: ['open'],"
            " how: 'refused'}); repaint()"
        )
        page.wait_for_selector("#sequence text:has-text('open: refused')")


def fsmkit_svg(data: bytes) -> str:
    """Return all text of an SVG file, which must be one."""
    from lxml import etree

    root = etree.fromstring(data)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    return " ".join(map(str, root.itertext()))


LOOKS: tuple[tuple[str, dict[str, Any], tuple[str, ...]], ...] = (
    ("gate", {}, ("click #events .post", "click #drawing #s2 text")),
    ("gate", {"color_scheme": "dark"}, ("click #events .post", "press o")),
    ("gate", {"forced_colors": "active"}, ("click #events .post", "click .ask")),
    ("gate", {"viewport": {"width": 360, "height": 700}}, ("press ?",)),
    ("feeder", {"color_scheme": "dark"}, ("press b", "click #p-watches summary")),
    ("cell", {}, ("press t", "press ArrowRight")),
    ("cell", {"color_scheme": "dark", "viewport": {"width": 360, "height": 700}}, ("press t",)),
    ("ring", {}, ("press t", "press t", "press q", "press Shift+2")),
    ("ring", {"viewport": {"width": 360, "height": 700}, "color_scheme": "dark"}, ("press t",)),
)


@pytest.mark.external
@pytest.mark.slow
@pytest.mark.parametrize(("name", "options", "does"), LOOKS)
def test_axe_finds_nothing(
    browser: Browser,
    gate: Path,
    feeder: fsmkit.Chart,
    name: str,
    options: dict[str, Any],
    does: tuple[str, ...],
) -> None:
    needs.need(AXE.is_file(), "axe-core")
    models = {"gate": lambda: fsmkit.read_chart(gate), "feeder": lambda: feeder}
    model = models.get(name, lambda: fsmkit.read_system(MACHINES / f"{name}.yaml"))()
    view = MACHINES / "live/cell.svg" if name == "cell" else None
    picture = None if view is None else read_picture(view, Findings())
    with looking(browser, Hub(model, picture=picture), **options) as seen:
        for doing in does:
            verb, _, what = doing.partition(" ")
            if verb == "press":
                seen.page.keyboard.press(what)
            else:
                seen.page.locator(what).first.click()
        seen.page.wait_for_timeout(500)
        session = seen.context.new_cdp_session(seen.page)
        session.send("Runtime.evaluate", {"expression": AXE.read_text(encoding="utf-8")})
        found = seen.page.evaluate("axe.run(document, {resultTypes: ['violations']})")
        assert found["passes"]
        told = [(v["id"], [node["html"] for node in v["nodes"]]) for v in found["violations"]]
        assert told == []


@pytest.mark.external
@pytest.mark.slow
def test_all_that_can_be_clicked_can_be_reached_by_keys(gate_page: Seen) -> None:
    page = gate_page.page
    page.evaluate("document.body.focus()")
    reached = set()
    for _ in range(90):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.outerHTML"))
    wanted = page.evaluate(
        "[...document.querySelectorAll('button, input, select, summary')]"
        ".filter(node => node.checkVisibility({contentVisibilityAuto: true}) && !node.disabled)"
        ".map(node => node.id || node.outerHTML)"
    )
    assert set(wanted) <= reached
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    page.wait_for_selector("#keys[open]")
    listed = page.inner_text("#keys dl")
    assert all(word in listed for word in ("space", "shift →", "microsteps"))


@pytest.mark.external
@pytest.mark.slow
def test_breakpoints_of_others_are_listed_and_come_in_all_kinds(
    browser: Browser, gate: Path
) -> None:
    hub = Hub(fsmkit.read_chart(gate))
    client = Client(hub)
    client.result("break", on="taken", m="Gate", what=0)
    with looking(browser, hub) as seen:
        page = seen.page
        page.wait_for_selector("#points :text('1: taken Gate: 0')")
        page.wait_for_selector("#drawing #t0.breakpoint")
        page.fill("#condition", "entered wide if count == 1")
        page.locator("#condition").press("Enter")
        page.wait_for_selector("#points :text('2: entered Gate: wide if count == 1')")
        page.wait_for_selector("#drawing #s3.breakpoint")
        page.get_by_role("button", name="open", exact=True).click()
        page.keyboard.press("t")
        page.wait_for_selector("#mode:has-text('stopped at breakpoint 2')")
