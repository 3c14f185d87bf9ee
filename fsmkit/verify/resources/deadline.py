"""One deadline for a whole check, and the time that each stage took.

Work in Python (reading, elaborating, generating) can be interrupted anywhere. A thread that sleeps
until the deadline raises `TimeUp` in the working thread (``PyThreadState_SetAsyncExc``), so no loop
has to check the clock, and it works in any thread, which a signal does not. It may only be raised
where nothing outside of memory is written: in the body of `Deadline.cut_off`. Children get the
remaining time, and are then ended (`verify.resources.children`).
"""

from __future__ import annotations

import ctypes
import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from typing import TypeVar

AGAIN = 0.25
"""Seconds after which `TimeUp` is raised again: the first may be lost in a finalizer."""

Made = TypeVar("Made")


class Stage(Enum):
    """The stages of a check, one after the other."""

    STARTING = "starting"
    """Before the first of the others: the process itself, where it is all for one check."""
    READING = "reading"
    GENERATING = "generating"
    COMPILING = "compiling"
    EXPLORING = "exploring"
    REPLAYING = "replaying"


class TimeUp(BaseException):
    """The deadline has passed; it is no `Exception`, so that nothing handles it as a failure."""


class Deadline:
    """A number of seconds from an instant on (0: no end), and the time of each stage."""

    def __init__(self, seconds: float = 0, started: float | None = None) -> None:
        """Start the clock: at ``started``, an instant of `time.monotonic`, or now."""
        self.seconds = seconds
        self._began = time.monotonic() if started is None else started
        self._spent: dict[Stage, float] = {}
        self._stage: Stage | None = None if started is None else Stage.STARTING
        self._since = self._began

    @property
    def left(self) -> float:
        """The remaining seconds, never less than 0; infinite without an end."""
        if not self.seconds:
            return math.inf
        return max(0.0, self._began + self.seconds - time.monotonic())

    @property
    def spent(self) -> dict[Stage, float]:
        """Seconds of each stage so far."""
        self._count()
        return dict(self._spent)

    def look(self) -> None:
        """Raise `TimeUp` if no time is left."""
        if not self.left:
            raise TimeUp

    def stage_times(self) -> str:
        """Return the time of each stage, as ``reading 0.4 s, compiling 2.6 s``."""
        spent = self.spent
        return ", ".join(f"{stage.value} {spent[stage]:.1f} s" for stage in Stage if stage in spent)

    @property
    def reached(self) -> str:
        """The reason for the end of the check."""
        return f"the time limit of {self.seconds:g} s was reached"

    def why(self) -> str:
        """Return the reason for the end of the check, and the time of each stage."""
        return f"{self.reached} ({self.stage_times()})"

    def _count(self) -> None:
        now = time.monotonic()
        if self._stage is not None:
            self._spent[self._stage] = self._spent.get(self._stage, 0.0) + now - self._since
        self._since = now

    @contextmanager
    def stage(self, stage: Stage) -> Iterator[None]:
        """Count the body as time of a stage. Raises `TimeUp` if none is left at its start."""
        self._count()
        before = None if self._stage is Stage.STARTING else self._stage
        self._stage = stage
        try:
            self.look()
            yield
        finally:
            self._count()
            self._stage = before

    def cut_off(self, stage: Stage, work: Callable[[], Made]) -> Made:
        """Return the result of ``work``, which only changes memory. Raises `TimeUp`.

        When the watch ends, one exception may be pending, and another about to be raised. So two
        can occur during the wait for its end, and the third wait is undisturbed. Between the end of
        the work and the end of the watch none can: there is no call.
        """
        with self.stage(stage):
            if not self.seconds:
                return work()
            with _unreported():
                return self._run_watched(work)

    def _run_watched(self, work: Callable[[], Made]) -> Made:
        """Run `work` under a watch that raises `TimeUp` once, and return its result."""
        watch = _Watch(self.left)
        try:
            try:
                try:
                    try:
                        watch.start()
                        return work()
                    finally:
                        watch.over = True
                finally:
                    watch.settle()
            except TimeUp:
                watch.settle()
                raise
        except TimeUp:
            watch.settle()
            raise


@contextmanager
def _unreported() -> Iterator[None]:
    """Suppress the report of a `TimeUp` raised where Python ignores exceptions, as in a finalizer.

    It is raised again, so nothing is lost; the report would be a traceback that a user sees.
    """
    before = sys.unraisablehook

    def hook(unraisable: sys.UnraisableHookArgs, /) -> None:
        if unraisable.exc_type is not TimeUp:
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        if sys.unraisablehook is hook:
            sys.unraisablehook = before


class _Watch:
    """A thread that raises `TimeUp` in its creator's thread, until it ends."""

    def __init__(self, seconds: float) -> None:
        self._worker = ctypes.c_ulong(threading.get_ident())
        self._seconds = seconds
        self._ended = threading.Event()
        self._raising = False
        self.over = False

    def start(self) -> None:
        thread = threading.Thread(target=self._wait, name="fsmkit deadline", daemon=True)
        with suppress(RuntimeError):  # no memory for a thread: the work will fail for that reason
            thread.start()

    def _wait(self) -> None:
        wait = self._seconds
        while not self._ended.wait(wait):
            self._raising = True  # first this, then the check: the worker does it in reverse order
            if not self.over:
                _raise_in(self._worker, TimeUp)
            self._raising = False
            wait = AGAIN

    def settle(self) -> None:
        """Wait until nothing is raised any more, and cancel a pending exception."""
        while self._raising:
            time.sleep(0)
        _raise_in(self._worker, None)
        self._ended.set()


def _raise_in(thread: ctypes.c_ulong, kind: type[BaseException] | None) -> None:
    """Raise an exception in a thread at its next step; None: cancel a pending one."""
    raised = None if kind is None else ctypes.py_object(kind)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, raised)
