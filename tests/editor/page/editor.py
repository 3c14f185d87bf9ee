"""A page of `fsmkit edit` in a browser."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsmkit.editor.editing.session import EditSession
from fsmkit.editor.page import edit_page
from fsmkit.editor.page.hub import EditHub, new_text
from tests import needs
from tests.inspector.browsing import Watched
from tests.inspector.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser, FloatRect

AXE = Path(__file__).parents[3] / "build/node/node_modules/axe-core/axe.min.js"
PICTURES = os.environ.get("FSMKIT_PICTURES", "")
"""A folder for pictures of the stages, for people."""
SECONDS = 15_000


class Editor(Watched):
    """A page that edits a file."""

    hub: EditHub

    def __init__(self, browser: Browser, path: Path, address: str) -> None:
        super().__init__(browser, SECONDS, viewport={"width": 1280, "height": 800})
        self.path = path
        self.load(address)
        self.wait("() => documentOf && session.hello")

    def load(self, address: str) -> None:
        """Load the page."""
        self.page.goto(address)

    def wait(self, condition: str, arg: object = None) -> None:
        """Wait until a function of the page returns a true value for an argument."""
        self.page.wait_for_function(condition, arg=arg)

    def edited(self) -> None:
        """Wait until the page has what the file has."""
        self.wait("() => waiting.size === 0 && !$('edit-inline')")

    def picture(self, name: str) -> None:
        if PICTURES:
            self.page.wait_for_timeout(400)
            self.page.screenshot(path=str(Path(PICTURES) / f"{name}.png"))

    def type_in_place(self, text: str) -> None:
        self.page.wait_for_selector("#edit-inline")
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(text)
        self.page.keyboard.press("Enter")
        self.edited()

    def choose(self, words: str) -> None:
        """Select an item in the list, which gets its options when it is opened."""
        self.page.dispatch_event("#edit-item", "pointerdown")
        self.page.select_option("#edit-item", label=words)

    def box(self, state: str) -> FloatRect:
        """Return where a state is drawn."""
        self.wait(
            "id => { const found = drawnItem(views[0], {kind: 'state', id});"
            " return found && views[0].nodes.has(`s${found.index}`); }",
            state,
        )
        index = self.page.evaluate(f"drawnItem(views[0], {{kind: 'state', id: '{state}'}}).index")
        found = self.page.locator(f"#drawing #s{index}").bounding_box()
        assert found is not None
        return found

    def middle(self, state: str) -> tuple[float, float]:
        """Return the middle of a drawn state."""
        box = self.box(state)
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag the mouse from a point to another."""
        self.page.mouse.move(*start)
        self.page.mouse.down()
        for part in (0.3, 0.7, 1.0):
            self.page.mouse.move(
                start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])
            )
        self.page.mouse.up()

    def settled(self) -> None:
        """Wait until the drawing shows the present chart."""
        self.wait(
            "() => !loading && views[0].shown && views[0].shown.chart === views[0].machine.hash"
            " && views[0].look.boxes"
        )


@contextmanager
def editing(browser: Browser, path: Path, **options: Any) -> Iterator[Editor]:
    """Open a file in a page, and fail on what the page complains of."""
    hub = EditHub(EditSession(path, new_text(path)), **options)
    with served(hub, page=edit_page) as server:
        seen = Editor(browser, path, server.address)
        seen.hub = hub
        yield seen
        assert seen.complaints == [], seen.complaints
        assert all(url.startswith(f"http://127.0.0.1:{server.port}/") for url in seen.requests)
        seen.context.close()


def require_accessible(editor: Editor, within: str = "html") -> None:
    """Fail on a violation that axe-core finds in an element."""
    page = editor.page
    needs.need(AXE.is_file(), "axe-core")
    session = editor.context.new_cdp_session(page)
    session.send("Runtime.evaluate", {"expression": AXE.read_text(encoding="utf-8")})
    found = page.evaluate("within => axe.run(within, {resultTypes: ['violations']})", within)
    assert found["passes"]
    problems = [(v["id"], [n["html"] for n in v["nodes"]]) for v in found["violations"]]
    assert problems == [], problems
