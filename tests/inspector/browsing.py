"""A page in a browser, and all that it complains of or asks others for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer
from tests.inspector.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

FAST = 20_000
"""Milliseconds until what is waited for must be there."""


class Watched:
    """A page, and all that it complained of or asked others for."""

    def __init__(self, browser: Browser, timeout: int, **options: Any) -> None:
        self.context = browser.new_context(**options)
        self.page: Page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.set_default_timeout(timeout)
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("dialog", lambda dialog: self.complaints.append(dialog.message))


class Seen(Watched):
    """The page of a server."""

    def __init__(self, browser: Browser, server: LiveServer, **options: Any) -> None:
        super().__init__(browser, FAST, **options)
        self.page.goto(server.address)
        self.page.wait_for_function(  # a picture of a plant may hide the drawing
            "() => session.hello && ($('title').textContent || !isSeen($('view')))"
        )

    def lit(self) -> list[str]:
        """Return the titles of the states that are lit in the drawing, or in the outline."""
        found = self.page.eval_on_selector_all(
            "#outline .active > .row", "rows => rows.map(row => row.firstChild.data)"
        )
        return list(found)

    def waits(self, *states: str) -> None:
        """Wait until exactly these states are lit."""
        self.page.wait_for_function(
            "states => JSON.stringify([...document.querySelectorAll('#outline .active > .row')]"
            ".map(row => row.firstChild.data)) === JSON.stringify(states)",
            arg=list(states),
        )


@contextmanager
def looking(browser: Browser, hub: Hub, **options: Any) -> Iterator[Seen]:
    """Look at a hub; nothing is complained of, and no request leaves the page."""
    with served(hub) as server:
        seen = Seen(browser, server, **options)
        yield seen
        assert seen.complaints == []
        assert all(url.startswith(f"http://127.0.0.1:{server.port}/") for url in seen.requests)
        seen.context.close()
