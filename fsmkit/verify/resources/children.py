"""Run child processes that never outlive this process.

Each child leads a process group of its own. Its own children (a compiler has several) end with it,
and an interrupt key at the terminal reaches only this process.
"""

from __future__ import annotations

import math
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from fsmkit.diagnostics.interrupts import hold_interrupts
from fsmkit.verify.resources.deadline import TimeUp

PATIENCE = 0.3
"""Seconds from SIGTERM to SIGKILL."""
GRACE = 1.2
"""Seconds that an interrupted child has to report its results."""
CHUNK = 1 << 16


@dataclass(frozen=True, slots=True)
class ChildResult:
    """The result of a child: its exit code (negative: the signal that ended it), and its output.

    ``interrupted``: it was interrupted in between.
    """

    code: int
    out: str
    err: str
    interrupted: bool = False


def run(
    command: Sequence[str],
    *,
    seconds: float = math.inf,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    line: Callable[[str], None] | None = None,
    stops: bool = False,
) -> ChildResult:
    """Run a child to its end. Raises `TimeUp` if it takes longer, `OSError` if it cannot start.

    ``line`` is called with each line of its standard error, as it arrives. ``stops``: an interrupt
    is passed on to the child, which then reports its results. If it has not ended after `GRACE`
    seconds, or at a second interrupt, it is killed.
    """
    end = time.monotonic() + seconds
    with _start(command, folder, environment) as process:
        out, err = _Words(None), _Words(line)
        interrupted = False
        while True:
            try:
                return replace(_read_output(process, out, err, end), interrupted=interrupted)
            except KeyboardInterrupt:
                if interrupted or not stops:
                    raise
                interrupted = True
                end = min(end, time.monotonic() + GRACE)
                _signal(process, signal.SIGINT)
            except TimeUp:
                if not interrupted:
                    raise
                return ChildResult(-signal.SIGKILL, out.text, err.text, interrupted=True)


def _read_output(
    process: subprocess.Popen[bytes], out: _Words, err: _Words, end: float
) -> ChildResult:
    with selectors.DefaultSelector() as ready:
        for pipe, words in ((process.stdout, out), (process.stderr, err)):
            if pipe is not None and not words.ended:
                ready.register(pipe, selectors.EVENT_READ, words)
        while ready.get_map():
            left = end - time.monotonic()
            if left <= 0:
                raise TimeUp
            for key, _ in ready.select(None if left == math.inf else left):
                words = key.data
                if not words.read(key.fd):
                    ready.unregister(key.fileobj)
    try:
        code = process.wait(None if end == math.inf else max(0.0, end - time.monotonic()))
    except subprocess.TimeoutExpired:
        raise TimeUp from None
    return ChildResult(code, out.text, err.text)


class _Words:
    """The output from one pipe."""

    def __init__(self, line: Callable[[str], None] | None) -> None:
        self._line = line
        self._parts: list[bytes] = []
        self._rest = b""
        self.ended = False

    @property
    def text(self) -> str:
        return b"".join(self._parts).decode("utf-8", "replace")

    def read(self, pipe: int) -> bool:
        """Read the available output; False at the end."""
        found = os.read(pipe, CHUNK)
        self._parts.append(found)
        self.ended = not found
        if self._line is not None:
            *lines, self._rest = (self._rest + found).split(b"\n")
            for line in lines:
                self._line(line.decode("utf-8", "replace"))
        return bool(found)


@contextmanager
def _start(
    command: Sequence[str], folder: Path | None, environment: Mapping[str, str] | None
) -> Iterator[subprocess.Popen[bytes]]:
    process: subprocess.Popen[bytes] | None = None
    try:
        with hold_interrupts():
            process = subprocess.Popen(
                command,
                cwd=folder,
                env=None if environment is None else {**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                process_group=0,
            )
        yield process
    finally:
        if process is not None:
            with hold_interrupts():
                _end(process)
            for pipe in (process.stdout, process.stderr):
                if pipe is not None:
                    pipe.close()


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a child and all processes that it started, unless it was waited for.

    Until then, its process id and that of its group belong to it.
    """
    if process.returncode is not None:
        return
    _signal(process, signal.SIGTERM)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and not _is_over(process):
        time.sleep(0.005)
    _signal(process, signal.SIGKILL)
    process.wait()


def _is_over(process: subprocess.Popen[bytes]) -> bool:
    options = os.WEXITED | os.WNOHANG | os.WNOWAIT
    return os.waitid(os.P_PID, process.pid, options) is not None


def _signal(process: subprocess.Popen[bytes], signal_number: int) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal_number)
