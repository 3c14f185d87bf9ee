"""One command of fsmkit in a process of its own, which starts with everything imported.

A process that hangs is ended with all its children. Starting Python anew for each of thousands of
commands would take most of the time; a fork server starts one in some milliseconds.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fsmkit import cli
from fsmkit.cli.common.summaries import verbs

MEMORY = 6 << 30
"""Bytes of address space that a command may take."""
PATIENCE = 6
"""Seconds to wait for a second of processor time."""
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(
    [f"fsmkit.cli.{folder}.{verb}" for verb, folder in verbs().items()]
    + ["fsmkit.codegen.c.plugin", "fsmkit.codegen.python.plugin", "fsmkit.system.system_file"]
)


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended; ``code`` is None if it had to be ended."""

    argv: tuple[str, ...]
    code: int | None
    out: str
    err: str
    seconds: float

    def problems(self, *allowed: int) -> list[str]:
        """Return the faults that no command may have, whatever its input."""
        said = f"`fsmkit {' '.join(self.argv)}`"
        if self.code is None:
            return [f"hang: {said} was ended after {self.seconds:.0f} s"]
        if "Traceback (most recent call last)" in self.err + self.out or "a bug" in self.err:
            return [f"traceback: {said}: {self.err.strip().splitlines()[-1:]}"]
        if self.code not in allowed:
            return [f"exit {self.code}: {said}: {_headline(self.err)}"]
        return []


def _headline(err: str) -> str:
    """Return the first error of what was printed."""
    lines = err.strip().splitlines()
    errors = [line for line in lines if line.startswith("error")]
    return (errors or lines or [""])[0][:300]


def fsmkit(argv: Sequence[str], folder: Path, seconds: float) -> Ended:
    """Run one command in a folder; it is ended after that many seconds of processor time.

    On a busy machine these may last long: it is also ended after `PATIENCE` times as many seconds.
    """
    with TemporaryDirectory(prefix="fsmkit-foreign-") as place:
        out, err = Path(place, "out"), Path(place, "err")
        process = _SERVER.Process(
            target=_command, args=(tuple(argv), str(folder), str(out), str(err), int(seconds))
        )
        began = time.monotonic()
        process.start()
        process.join(seconds * PATIENCE)
        took = time.monotonic() - began
        code = process.exitcode
        if code is None:
            with suppress(ProcessLookupError):
                os.killpg(process.pid or 0, signal.SIGKILL)
            process.join()
        process.close()
        if code == -signal.SIGXCPU or code == -signal.SIGKILL:
            code = None
        said, warned = (p.read_text(errors="replace") if p.exists() else "" for p in (out, err))
    return Ended(tuple(argv), code, said, warned, took)


def _command(argv: tuple[str, ...], folder: str, out: str, err: str, seconds: int) -> None:
    """Be the command: a process group of its own, so that its children end with it."""
    os.setsid()
    os.chdir(folder)
    for path, number in ((out, 1), (err, 2)):
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(handle, number)
        os.close(handle)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    sys.argv = ["fsmkit", *argv]
    cli.main()
