"""One deadline for all that a check does, and where its time went.

Work in Python (reading, elaborating, generating) is interrupted wherever it is: a thread that
sleeps until the deadline raises `TimeUp` in the thread that works (``PyThreadState_SetAsyncExc``),
so no loop has to look at the clock, and it holds in any thread, which a signal does not. It may
only be raised where nothing is written outside of memory; that is the body of `Deadline.cut_off`.
Children are waited for with what time is left, and ended (`verify.resources.children`).
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
    """What a check does, one after the other."""

    STARTING = "starting"
    """Before the first of the others: the process itself, where it is all for one check."""
    READING = "reading"
    GENERATING = "generating"
    COMPILING = "compiling"
    EXPLORING = "exploring"
    REPLAYING = "replaying"


class TimeUp(BaseException):
    """The deadline has passed; no `Exception`, so that nothing takes it for a failure."""


class Deadline:
    """So many seconds from a moment on (0: no end), and how much each stage took of them."""

    def __init__(self, seconds: float = 0, began: float | None = None) -> None:
        """``began``: the moment, by `time.monotonic`; now, unless it is given."""
        self.seconds = seconds
        self._began = time.monotonic() if began is None else began
        self._spent: dict[Stage, float] = {}
        self._stage: Stage | None = None if began is None else Stage.STARTING
        self._since = self._began

    @property
    def left(self) -> float:
        """Seconds that are left, never less than 0; infinite without an end."""
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

    def told(self) -> str:
        """Return where the time went, as ``reading 0.4 s, compiling 2.6 s``."""
        spent = self.spent
        return ", ".join(f"{stage.value} {spent[stage]:.1f} s" for stage in Stage if stage in spent)

    @property
    def reached(self) -> str:
        """Why nothing more was done."""
        return f"the time limit of {self.seconds:g} s was reached"

    def why(self) -> str:
        """Return why nothing more was done, and where the time went."""
        return f"{self.reached} ({self.told()})"

    def _count(self) -> None:
        now = time.monotonic()
        if self._stage is not None:
            self._spent[self._stage] = self._spent.get(self._stage, 0.0) + now - self._since
        self._since = now

    @contextmanager
    def stage(self, stage: Stage) -> Iterator[None]:
        """Count what is done within as time of a stage; `TimeUp` if none is left at its begin."""
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
        """Return what the work makes, which touches nothing but memory; `TimeUp` where time ends.

        When the watch is over, one may be left that has not come up, and one that it is about to
        raise: so two can come up while it is waited for, and the third wait is undisturbed.
        Between the end of the work and the end of the watch none can: there is no call.
        """
        with self.stage(stage):
            if not self.seconds:
                return work()
            with _unreported():
                return self._watched(work)

    def _watched(self, work: Callable[[], Made]) -> Made:
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
    """Report no `TimeUp` that came up where Python ignores exceptions, as in a finalizer.

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
    """A thread that raises `TimeUp` in the one that made it, until it is over."""

    def __init__(self, seconds: float) -> None:
        self._worker = ctypes.c_ulong(threading.get_ident())
        self._seconds = seconds
        self._ended = threading.Event()
        self._raising = False
        self.over = False

    def start(self) -> None:
        thread = threading.Thread(target=self._wait, name="fsmkit deadline", daemon=True)
        with suppress(RuntimeError):  # no memory for a thread: the work ends for want of it, too
            thread.start()

    def _wait(self) -> None:
        wait = self._seconds
        while not self._ended.wait(wait):
            self._raising = True  # first this, then a look: the worker does it the other way round
            if not self.over:
                _raise_in(self._worker, TimeUp)
            self._raising = False
            wait = AGAIN

    def settle(self) -> None:
        """Wait until nothing is raised any more, and take back what has not come up."""
        while self._raising:
            time.sleep(0)
        _raise_in(self._worker, None)
        self._ended.set()


def _raise_in(thread: ctypes.c_ulong, kind: type[BaseException] | None) -> None:
    """Let an exception come up in a thread at its next step; None: take back one that has not."""
    raised = None if kind is None else ctypes.py_object(kind)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, raised)
