"""The folder that an assistant works in: files below it, and verbs that run on them.

Verbs run in a process of their own with a limit of time, and print their ``--json`` documents. The
process reads no file outside of the folder (``FSMKIT_ROOT``), whatever a chart names.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.as_json import as_json
from fsmkit.diagnostics.parsing import parse_json

CHARTS = (".yaml", ".yml", ".scxml")
MOST_BYTES = 2_000_000
MOST_LISTED = 1_000
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Workspace:
    """A root folder, and what may be done below it.

    ``seconds`` limits each verb. With ``is_readonly`` nothing is written.
    """

    root: Path
    seconds: float = 60.0
    is_readonly: bool = False

    def path(self, name: str, suffixes: Sequence[str] = CHARTS) -> Path:
        """Return the path of a file below the root; raises `FsmkitError` (``outside-root``)."""
        try:
            path = Path(self.root, name).resolve()
        except (OSError, ValueError) as error:
            raise fail("outside-root", f"{name!r} is not a name of a file") from error
        if not path.is_relative_to(self.root.resolve()):
            raise fail(
                "outside-root",
                f"`{name}` is outside of the root folder",
                help="name a file below the root, such as `gate.yaml`",
            )
        if path.suffix.lower() not in suffixes:
            raise fail(
                "outside-root",
                f"`{name}` has not the suffix of {', '.join(suffixes)}",
                help="tools read and write charts and systems only",
            )
        return path

    def name(self, path: Path) -> str:
        """Return a path relative to the root."""
        return path.relative_to(self.root.resolve()).as_posix()

    def charts(self) -> list[str]:
        """Return the names of all files with the suffix of a chart, sorted."""
        found: list[str] = []
        for folder, folders, files in os.walk(self.root.resolve()):
            folders[:] = sorted(each for each in folders if not each.startswith("."))
            found += (
                self.name(Path(folder, each)) for each in files if each.lower().endswith(CHARTS)
            )
            if len(found) >= MOST_LISTED:
                break
        return sorted(found)[:MOST_LISTED]

    def text(self, path: Path) -> str:
        """Return the text of a file; raises `FsmkitError` (``unreadable-file``)."""
        try:
            if path.stat().st_size > MOST_BYTES:
                raise fail("unreadable-file", f"`{self.name(path)}` is too large")
            return path.read_text(encoding="utf-8")
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise fail("unreadable-file", f"cannot read `{self.name(path)}`: {reason}") from error

    def write(self, path: Path, text: str, expected: str | None) -> None:
        """Replace a file as a whole.

        Args:
            path: The file, from `path`.
            text: The new text.
            expected: The SHA-256 of the present text, or None for a new file.

        Raises:
            FsmkitError: ``stale-edit`` if the file has another content, ``unwritable-output``.

        """
        if self.is_readonly:
            raise fail("unwritable-output", "the server was started with `--readonly`")
        present = digest(self.text(path)) if path.exists() else None
        if present != expected:
            what = "exists already" if expected is None else "has changed since it was read"
            raise fail(
                "stale-edit",
                f"`{self.name(path)}` {what}",
                help="read the file again, and give the `sha256` of that text",
            )
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(
                "w", encoding="utf-8", newline="", dir=path.parent, prefix=".", delete=False
            ) as file:
                file.write(text)
            if path.exists():
                Path(file.name).chmod(path.stat().st_mode)
            Path(file.name).replace(path)
        except OSError as error:
            reason = error.strerror or error
            raise fail("unwritable-output", f"`{self.name(path)}`: {reason}") from error

    def verb(self, name: str, *arguments: str) -> Json:
        """Run a verb with ``--json`` in the root; return its document and its exit code."""
        environment = {**os.environ, "FSMKIT_ROOT": str(self.root.resolve()), "NO_COLOR": "1"}
        command = [sys.executable, "-m", "fsmkit", name, "--json", *arguments]
        try:
            done = subprocess.run(
                command, cwd=self.root, env=environment, capture_output=True, text=True,
                timeout=self.seconds, check=False, stdin=subprocess.DEVNULL,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return {"error": f"stopped after {self.seconds:g} s"}
        try:
            document = parse_json(done.stdout)
        except ValueError:
            return {"exit_code": done.returncode, "error": done.stderr.strip()[-4_000:]}
        return {"exit_code": done.returncode, **document}


def digest(text: str) -> str:
    """Return the SHA-256 of a text, as it is in a file."""
    return hashlib.sha256(text.encode()).hexdigest()


def findings_of(error: FsmkitError) -> Json:
    """Return an error as a result: its findings with their locations."""
    return {"error": str(error), "findings": [as_json(each) for each in error.diagnostics]}
