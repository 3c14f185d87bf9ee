"""A served session, in a thread of its own."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fsmkit.inspector.hub import Hub
from fsmkit.inspector.server import LiveServer, serve_hub


@contextmanager
def served(hub: Hub, **options: Any) -> Iterator[LiveServer]:
    """Serve a hub while the block runs."""
    ready = threading.Event()
    found: dict[str, Any] = {}
    server: list[LiveServer] = []

    def run() -> None:
        async def main() -> None:
            found["stop"], found["loop"] = asyncio.Event(), asyncio.get_running_loop()
            server.append(LiveServer(hub, **options))
            await serve_hub(server[0], lambda _: ready.set(), stop=found["stop"])

        try:
            asyncio.run(main())
        except Exception as error:  # noqa: BLE001  (raised again in the test)
            found["error"] = error
        finally:
            ready.set()

    thread = threading.Thread(target=run)
    thread.start()
    ready.wait(20)
    try:
        if "error" in found:
            raise found["error"]
        yield server[0]
    finally:
        if "error" not in found:
            found["loop"].call_soon_threadsafe(found["stop"].set)
        thread.join(20)
        assert not thread.is_alive(), "the server does not end"
