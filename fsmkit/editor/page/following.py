"""Background tasks of `fsmkit edit`: watch changes by other programs, and check."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from fsmkit.diagnostics import FsmkitError
from fsmkit.editor.checking.background import Background, CheckResult
from fsmkit.editor.page.hub import EditHub, Verdict

EVERY = 0.25
"""Seconds between two looks at the file."""
QUIET = 3
"""Looks without a change after which the chart is checked."""


async def follow_file(hub: EditHub) -> None:
    """Show what other programs write, and check the chart when it rests; runs until cancelled."""
    checks = Background()
    running: asyncio.Task[CheckResult | None] | None = None
    checked, seen, rests = "", hub.editing.hash, 0
    try:
        while True:
            await asyncio.sleep(EVERY)
            with suppress(FsmkitError):  # it cannot be read at the moment
                if hub.editing.refresh():
                    hub.changed()
            now = hub.editing.hash
            rests = rests + 1 if now == seen else 0
            if now != seen and running is not None:
                checks.end()
                running.cancel()
                running = None
            seen = now
            if rests >= QUIET:
                hub.save_hints()
            if running is not None and running.done():
                found = running.result()
                running = None
                if found is not None:
                    hub.show_verdicts(verdicts_of(found))
            is_ready = rests >= QUIET and now != checked and hub.is_valid
            if running is None and is_ready and not hub.editing.is_new:
                checked = now
                path = hub.editing.path.resolve()
                running = asyncio.create_task(checks.check(path, frozenset([path])))
    finally:
        checks.end()
        if running is not None:
            running.cancel()


def verdicts_of(found: CheckResult) -> list[Verdict]:
    """Return the verdicts of a check."""
    return [
        Verdict(one["name"], one["verdict"], found.words(one), one["text"], one.get("trace"))
        for one in found.report.get("properties", ())
    ]
