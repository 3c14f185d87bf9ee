"""A program that runs the machine of another tool, by a line protocol of five words.

fsmkit writes ``set OPERATION true`` or ``false`` for the guards, ``advance MILLISECONDS``, ``post
EVENT`` and ``answer``. After ``answer`` the program prints what happened since the last answer: the
names of operations that it performed, in their order; ``sent EVENT`` for each event that leaves the
machine, in their order; ``state NAME`` for each active leaf state; ``end``. Names of operations are
those of the report. A line ``end`` from fsmkit ends
the program. The first ``answer`` is about the start of the machine.
"""

from __future__ import annotations

import shlex
import subprocess
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from fsmkit.diagnostics import FsmkitError, fail

LONGEST_WAIT = 20.0
"""Seconds for an answer of the program."""
MOST_LINES = 100_000
"""Lines of one answer."""


@dataclass(frozen=True, slots=True)
class Observation:
    """The effects of a step: performed operations and sent events, and the active leaf states."""

    operations: tuple[str, ...]
    sent: tuple[str, ...]
    states: frozenset[str]


class Program:
    """A running program. Errors are `FsmkitError`: it cannot start, ends, or does not answer."""

    def __init__(self, command: str) -> None:
        """Start the program; ``command`` is split as a shell does, but no shell runs it."""
        self.command = command
        try:
            self._process = subprocess.Popen(
                shlex.split(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                encoding="utf-8", errors="replace",
            )  # fmt: skip
        except (OSError, ValueError, IndexError) as error:
            raise self._failed(f"cannot start: {error}") from error

    def close(self) -> None:
        """End the program."""
        self._process.kill()
        self._process.communicate()

    def observe(self, lines: Sequence[str]) -> Observation:
        """Send lines and then ``answer``; return the answer."""
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None:
            raise self._failed("has no streams")
        watchdog = threading.Timer(LONGEST_WAIT, self._process.kill)
        watchdog.start()
        try:
            stdin.write("".join(f"{line}\n" for line in (*lines, "answer")))
            stdin.flush()
            return _read(iter(stdout.readline, ""), self._failed)
        except OSError as error:
            raise self._failed("ended before its answer") from error
        finally:
            watchdog.cancel()

    def _failed(self, what: str) -> FsmkitError:
        return fail(
            "broken-proof",
            f"the program `{self.command}` {what}",
            help="it reads `set`, `advance`, `post` and `answer`, and answers until `end`",
        )


def _read(lines: Iterable[str], failed: Callable[[str], FsmkitError]) -> Observation:
    operations: list[str] = []
    sent: list[str] = []
    states: set[str] = set()
    for number, line in enumerate(lines):
        word = line.strip()
        if word == "end":
            return Observation(tuple(operations), tuple(sent), frozenset(states))
        if number >= MOST_LINES:
            break
        if word.startswith("state "):
            states.add(word.removeprefix("state ").strip())
        elif word.startswith("sent "):
            sent.append(word.removeprefix("sent ").strip())
        elif word:
            operations.append(word)
    raise failed("ended, or did not answer in time")
