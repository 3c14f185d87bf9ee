"""Watch the files of a session, and reload a saved one."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.inspector.hub import Hub, system_within
from fsmkit.system.system import System

EVERY = 0.25
"""Seconds between two checks."""
Stamp = tuple[int, int] | None
"""Time and size of a file; None if it is missing."""


class Watcher:
    """Watches the files of a chart or system.

    Args:
        hub: The hub to reload.
        file: The main file.
        read: Reads the file again; raises its findings.

    """

    def __init__(self, hub: Hub, file: Path, read: Callable[[], Chart | System]) -> None:
        self._hub = hub
        self._file = file
        self._read = read
        self._files = self._files_of(hub.system)
        self._seen = self._loaded = self._stamps()

    def _files_of(self, system: System) -> frozenset[Path]:
        names = {source.name for machine in system.machines for source in machine.chart.sources}
        return frozenset([self._file, *map(Path, names)])

    def _stamps(self) -> dict[Path, Stamp]:
        return {path: _stamp(path) for path in self._files}

    def has_changed(self) -> bool:
        """Whether a file is not as it was loaded, and rests: it was so at the last look, too."""
        now = self._stamps()
        rests, self._seen = now == self._seen, now
        return rests and now != self._loaded

    def load(self) -> None:
        """Reload the files, or show their findings."""
        self._loaded = self._seen
        try:
            model = self._read()
        except FsmkitError as error:
            self._hub.show_findings(error.diagnostics)
            return
        self._hub.reload(model)
        self._files = self._files_of(system_within(model))
        added = {path: _stamp(path) for path in self._files}
        self._seen = self._loaded = {
            **added,
            **{k: v for k, v in self._loaded.items() if k in added},
        }

    async def run(self) -> None:
        """Look again and again, until it is cancelled."""
        while True:
            await asyncio.sleep(EVERY)
            if self.has_changed():
                self.load()


def _stamp(path: Path) -> Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
