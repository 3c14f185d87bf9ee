"""From the configuration of an editor to a session."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from fsmkit.diagnostics import Diagnostic, Findings, Severity
from fsmkit.document.python_objects import is_reference
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.sources.opening import open_source

MOST_SEED = 2**31 - 1


class Launch(msgspec.Struct, rename="camel"):
    """The arguments of `launch`; unknown keys of an editor are ignored."""

    program: str = ""
    cwd: str = ""
    stop_on_entry: bool = True
    speed: float = 1.0
    """Simulated seconds in a second while the session runs; 0: as fast as can be."""
    seed: int = 1
    strict: bool = False
    replace: dict[str, str] = {}
    """Charts that machines of a system run in place of those the file names."""
    replay: str | None = None
    """The log of a machine in C, made from the chart; it is shown instead of a simulation."""
    instance: int | None = None
    """Instance of the machine in the log."""
    trace: bool = False
    """Whether to print the trace of each macrostep to the console (`fsmkit run --trace`)."""


@dataclass(frozen=True, slots=True)
class LaunchedSession:
    """A new session, and the findings about its files."""

    hub: Hub
    remarks: tuple[Diagnostic, ...]


def launch(wanted: Launch) -> LaunchedSession:
    """Read the program and start a session; raises `FsmkitError` with all findings."""
    if not wanted.program:
        raise wrong("the configuration names no program", 'give `"program": "gate.yaml"`')
    if not 0 <= wanted.seed <= MOST_SEED:
        raise wrong(f"there is no seed {wanted.seed}", f"give one from 0 to {MOST_SEED}")
    folder = Path(wanted.cwd) if wanted.cwd else Path.cwd()
    path = folder / wanted.program
    findings = Findings()
    replacing = {name: folder / chart for name, chart in wanted.replace.items()}
    opened = open_source(
        _shortest(path),
        findings,
        replacing,
        strict=wanted.strict,
        replay=folder / wanted.replay if wanted.replay is not None else None,
        instance=wanted.instance,
    )
    hub = Hub(opened.source, file=opened.file, session=secrets.token_hex(4), seed=wanted.seed)
    return LaunchedSession(hub, tuple(_finding_json(findings)))


def _shortest(path: Path) -> Path:
    """Return a path below the working directory as one from there: findings are shorter.

    A path is a file, and never an object of a Python module: whoever can connect imports nothing.
    """
    whole = Path(os.path.abspath(path))  # noqa: PTH100  (a link stays as the editor has it)
    here = Path.cwd()
    short = whole.relative_to(here) if whole.is_relative_to(here) else whole
    return whole if is_reference(str(short)) else short


def _finding_json(findings: Iterable[Diagnostic]) -> Iterable[Diagnostic]:
    return (each for each in findings if each.severity is not Severity.NOTE)
