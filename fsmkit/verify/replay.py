"""Performs a recorded trace again: what the saved pytests call."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings, fail
from fsmkit.loading import load_with_findings
from fsmkit.system.reader import is_system_file, load_system
from fsmkit.system.system import System, system_of
from fsmkit.verify.report.counterexample import Replay, TraceStep
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.testgen.replay_python import in_python


def load_any(
    path: Path,
    findings: Findings,
    replacing: Mapping[str, Path] | None = None,
    *,
    strict: bool = False,
) -> System:
    """Return the system of a system file, or that of one chart alone.

    ``replacing``: charts that machines of the system run in place of those the file names.
    ``strict``: as of `fsmkit.loading.load_with_findings`.
    """
    if is_system_file(path):
        return load_system(path, findings, replacing, strict=strict)
    if replacing:
        raise fail(
            "not-a-system",
            f"`{path}` is one chart: it has no machine to replace",
            help="name a system file",
        )
    return system_of(load_with_findings(path, findings, strict=strict))


def perform(recorded: Mapping[str, Any], folder: Path = Path()) -> list[list[str]]:
    """Perform the steps of a saved trace in the interpreter; return the trace lines of each.

    Files are looked for in a folder. `ReplayError` if a step cannot be taken any more: the charts
    have changed.
    """
    return [list(step.lines) for step in _performed(recorded, folder)[1]]


def perform_in_python(recorded: Mapping[str, Any], folder: Path = Path()) -> list[list[str]]:
    """Perform them in the generated Python; the line that tells the time of a step is left out."""
    closed, steps = _performed(recorded, folder)
    return in_python(closed, steps)


def _performed(recorded: Mapping[str, Any], folder: Path) -> tuple[ClosedSystem, list[TraceStep]]:
    replacing = {n: folder / file for n, file in recorded.get("replaced", {}).items()}
    system = load_any(folder / recorded["file"], Findings(), replacing)
    closed = close(system, untimed=recorded["untimed"], silent=recorded["silent"])
    trail = tuple(
        tuple(
            Step(Action(action), machine, argument, tuple(choices), *map(Fraction, ticks))
            for action, machine, argument, choices, *ticks in steps
        )
        for steps in recorded["trail"]
    )
    return closed, Replay(closed).write(trail)
