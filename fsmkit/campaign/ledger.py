"""What is known of a campaign: outcomes, as they come, in a file that another run goes on from."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from fsmkit.campaign.jobs import VERDICTS, Outcome
from fsmkit.diagnostics import FsmkitError, fail

FILE = "outcomes.jsonl"


class Ledger:
    """The outcomes in a folder, one a line; None: nothing is kept."""

    def __init__(self, folder: Path | None) -> None:
        """Make the folder if need be; `FsmkitError` where it cannot be used."""
        self._path = None if folder is None else folder / FILE
        if folder is None:
            return
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unusable(folder, error) from error

    def known(self) -> dict[str, Outcome]:
        """Return what is known, by key; a line that was not written whole counts as none."""
        if self._path is None or not self._path.exists():
            return {}
        try:
            lines = self._path.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise _unusable(self._path, error) from error
        return {outcome.key: outcome for outcome in _outcomes(lines)}

    def keep(self, outcome: Outcome) -> None:
        """Add an outcome, which is on the disk when this returns; errors are tried again."""
        if self._path is None or outcome.verdict == "error":
            return
        line = json.dumps(asdict(outcome), ensure_ascii=True)
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"\n{line}" if file.tell() else line)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise _unusable(self._path, error) from error


def _outcomes(lines: Iterable[str]) -> Iterable[Outcome]:
    for line in lines:
        try:
            outcome = Outcome(**json.loads(line))
        except (ValueError, TypeError):
            continue
        if outcome.verdict in VERDICTS and isinstance(outcome.told, dict):
            yield outcome


def _unusable(path: Path, error: OSError) -> FsmkitError:
    reason = (error.strerror or type(error).__name__).lower()
    return fail("unwritable-output", f"`{path}` cannot be used: {reason}")
