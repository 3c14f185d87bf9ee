"""``--watch``: a verb is run again when a file that it read has changed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import wraps
from pathlib import Path
from typing import Any

import click

from fsmkit.chart.loading import READ, Stamp, stamp
from fsmkit.cli.common.console import err, report, reported
from fsmkit.cli.common.interrupts import received, restarted_clock
from fsmkit.diagnostics import FsmkitError
from fsmkit.document.project import project_of
from fsmkit.document.python_objects import is_reference

POLL = 0.3
"""Seconds between two checks of the files if the system does not report changes."""
SETTLE = 0.05
"""Seconds without a change until files count as written."""


def watched(body: Callable[..., int]) -> Callable[..., int]:
    """Add ``--watch`` to a verb with the argument ``file``, ``files`` or ``paths``."""

    @click.option(
        "--watch",
        "is_watching",
        is_flag=True,
        help="Run again whenever a file changes, until interrupted.",
    )
    @wraps(body)
    def whole(*arguments: Any, is_watching: bool, **more: Any) -> int:
        if not is_watching:
            return body(*arguments, **more)
        if more.get("as_json") or more.get("as_json_document"):
            raise click.UsageError("--watch does not go with --json, which prints one document")
        named = more.get("file") or more.get("files") or more.get("paths") or (Path(),)
        paths = (named,) if isinstance(named, Path) else tuple(named)
        files = tuple(path for path in paths if not is_reference(str(path)))
        return run_again(lambda: body(*arguments, **more), files)

    return whole


def run_again(run: Callable[[], int], paths: Iterable[Path]) -> int:
    """Run a verb after each change of a file that it read.

    Args:
        run: The verb; its findings are reported.
        paths: The files and folders of the command line.

    Returns:
        The exit code of a run that was interrupted. An interrupt while waiting is raised as
        `KeyboardInterrupt`.

    """
    clock: AbstractContextManager[None] = nullcontext()
    while True:
        stamps: dict[Path, Stamp] = {path: stamp(path) for path in _with_folders(paths)}
        token = READ.set(stamps)
        try:
            with clock:
                code = run()
        except FsmkitError as error:
            report(error.diagnostics)
            code = 1
        finally:
            READ.reset(token)
        if received():
            return code
        err.print(f"watching {len(stamps)} files and folders", style="dim")
        wait(stamps)
        clock = restarted_clock()
        reported.clear()


def _with_folders(paths: Iterable[Path]) -> Iterable[Path]:
    """Yield paths with all folders below them, and their project files."""
    for path in paths:
        yield path
        if path.is_dir():
            yield from (
                folder
                for folder in path.rglob("*/")
                if folder.is_dir() and not any(part.startswith(".") for part in folder.parts)
            )
        try:
            project = project_of(path)
        except FsmkitError:  # the verb reports it; the fix may be in an unknown file
            continue
        if project is not None:
            yield project.path


def wait(stamps: Mapping[Path, Stamp]) -> None:
    """Return as soon as one of some files is another than its stamp, and is written."""
    while not has_changed(stamps):
        _sleep(stamps)
    before: dict[Path, Stamp] = {}
    while before != (now := {path: stamp(path) for path in stamps}):
        before = now
        time.sleep(SETTLE)


def has_changed(stamps: Mapping[Path, Stamp]) -> bool:
    """Whether one of some files is another than its stamp."""
    return any(stamp(path) != before for path, before in stamps.items())


def _sleep(stamps: Mapping[Path, Stamp]) -> None:
    """Wait for a change near the files, at most some seconds; without watchfiles for a moment."""
    try:
        from watchfiles import watch
    except ImportError:
        time.sleep(POLL)
        return
    folders = {path if path.is_dir() else path.parent for path in stamps}
    there = [folder for folder in folders if folder.is_dir()]
    if not there:
        time.sleep(POLL)
        return
    # a change before the watch starts is found at the next check, after a second
    next(iter(watch(*there, recursive=False, rust_timeout=1000, yield_on_timeout=True)))
