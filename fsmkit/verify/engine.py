"""The engine in C: generate, compile, cache, run, read."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from types import TracebackType

from fsmkit.diagnostics import Findings, fail
from fsmkit.verify.closed import Closed
from fsmkit.verify.counterexample import Counterexample
from fsmkit.verify.exploration import Exploration, Trail


def compiler() -> str | None:
    """Return the path of the C compiler: that of CC, else cc, gcc or clang; None without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    return next((path for name in names if (path := shutil.which(name)) is not None), None)


class CEngine:
    """A compiled explorer."""

    def __init__(self, closed: Closed, findings: Findings) -> None:
        raise fail("explorer-build", "not there yet")

    def __enter__(self) -> CEngine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        pass

    def explore(
        self, memory: int, seconds: float, progress: Callable[[int, int, int], None] | None
    ) -> Exploration:
        raise AssertionError

    def trail(self, path: tuple[int, ...]) -> Trail:
        raise AssertionError

    def confirm(self, found: Counterexample, path: tuple[int, ...]) -> Counterexample:
        raise AssertionError
