"""Run checks in child processes, one at a time, and store their results."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fsmkit.diagnostics.parsing import parse_json

SECONDS = 20.0
BYTES = 1 << 30
LONGEST_LINE = 64 << 20
"""Maximum size of a report, in bytes."""
NICENESS = 10
Json = dict[str, Any]
Tell = Callable[[Mapping[str, Any]], None]


@dataclass
class CheckResult:
    """The result of a file's check; ``files`` are the files it depends on."""

    path: Path
    files: frozenset[Path]
    report: Json = field(default_factory=dict)
    error: list[Json] = field(default_factory=list)

    def property(self, name: str) -> Json | None:
        """Return the result for a property."""
        found = (p for p in self.report.get("properties", ()) if p["name"] == name)
        return next(found, None)

    def words(self, one: Json) -> str:
        """Return the verdict on a property in a few words."""
        steps = one.get("steps")
        match one["verdict"]:
            case "violated" if steps:
                return f"violated in {len(steps)} steps"
            case "holds" if steps:
                return f"holds: reached in {len(steps)} steps"
            case "holds":
                return f"holds: {self.report.get('states', 0):,} states"
            case verdict:
                return f"{verdict}: {one['reason']}" if one["reason"] else str(verdict)


@dataclass
class Background:
    """The child process, if one runs, and the file that it checks."""

    process: asyncio.subprocess.Process | None = None
    path: Path | None = None
    token: str = ""
    """Token of the progress that an editor shows."""

    async def check(
        self, path: Path, files: frozenset[Path], progress: Tell | None = None
    ) -> CheckResult | None:
        """Check a file; return None if another check, or `end`, replaced this one."""
        self.end()
        environment = {**os.environ, "PYTHONSAFEPATH": "1"}
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "fsmkit.editor.checking.child"),
            *(str(path), str(SECONDS), str(BYTES)),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
            cwd=path.parent,
            env=environment,
            limit=LONGEST_LINE,
            start_new_session=True,
        )
        if hasattr(os, "setpriority"):
            with contextlib.suppress(OSError):  # it is over already
                os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        self.process, self.path = process, path
        found = CheckResult(path, files)
        is_whole = await self._read(process, found, progress)
        await process.wait()
        if self.process is not process:
            return None
        self.process = self.path = None
        return found if is_whole else None

    @staticmethod
    async def _read(
        process: asyncio.subprocess.Process, found: CheckResult, progress: Tell | None
    ) -> bool:
        """Read the output of a child; return whether it is complete."""
        out = process.stdout
        while out is not None:
            try:
                line = await out.readline()
                message = parse_json(line) if line.strip() else {}
            except (ValueError, OSError):
                return False
            if not line:
                return False
            if "progress" in message and progress is not None:
                progress(message["progress"])
            if "error" in message:
                found.error = message["error"]
                return True
            if "report" in message:
                found.report = message["report"]
                return True
        return False

    def end(self) -> None:
        """Stop the running child and its descendants."""
        process, self.process, self.path = self.process, None, None
        if process is None or process.returncode is not None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if hasattr(os, "killpg"):
                os.killpg(process.pid, signal.SIGKILL)  # it leads a session of its own
            else:
                process.kill()
