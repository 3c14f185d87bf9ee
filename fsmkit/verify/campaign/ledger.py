"""Store the outcomes of a campaign in a file as they arrive; a later run continues from it."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import weakref
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import msgspec

from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.parsing import parse_json
from fsmkit.verify.campaign.jobs import VERDICTS, Outcome

FILE = "outcomes.jsonl"
NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS}
"""Errors of a file system that has no locks."""


class Ledger:
    """The outcomes in a folder, one per line; without a folder, nothing is stored.

    A folder belongs to one campaign at a time, because two would do each job twice.
    """

    def __init__(self, folder: Path | None) -> None:
        """Create the folder and lock it.

        Raises:
            FsmkitError: ``unwritable-output`` where it cannot be used, or another run uses it.

        """
        self._path = None if folder is None else folder / FILE
        if folder is None:
            return
        try:
            folder.mkdir(parents=True, exist_ok=True)
            opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            weakref.finalize(self, os.close, opened)
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise fail(
                "unwritable-output",
                f"`{folder}` is in use: another run keeps its outcomes there",
                help="wait until it has ended, or name another folder",
            ) from error
        except OSError as error:
            if error.errno not in NO_LOCKS:
                raise _unusable(folder, error) from error

    def known(self) -> dict[str, Outcome]:
        """Return the known outcomes by key; a line that is damaged counts as missing."""
        if self._path is None or not self._path.exists():
            return {}
        if not self._path.is_file():
            raise fail("unwritable-output", f"`{self._path}` cannot be used: it is not a file")
        try:
            lines = self._path.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise _unusable(self._path, error) from error
        return {outcome.key: outcome for outcome in _outcomes(lines)}

    def keep(self, outcome: Outcome) -> None:
        """Append an outcome, which is on the disk when this returns; errors are tried again."""
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
            outcome = msgspec.convert(parse_json(line), Outcome)
        except ValueError:
            continue
        if outcome.verdict in VERDICTS:
            yield outcome


def _unusable(path: Path, error: OSError) -> FsmkitError:
    reason = (error.strerror or type(error).__name__).lower()
    return fail("unwritable-output", f"`{path}` cannot be used: {reason}")
