"""Performs a recorded trace again: what the saved pytests call."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from fsmkit.diagnostics import Findings
from fsmkit.system.any_file import load_any
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import Replay, TraceStep
from fsmkit.verify.statespace.actions import Action, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import Trail
from fsmkit.verify.testgen.replay_python import in_python


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
    _, closed, trail = loaded(recorded, folder)
    return closed, Replay(closed).write(trail)


def loaded(
    recorded: Mapping[str, Any], folder: Path = Path()
) -> tuple[System, ClosedSystem, Trail]:
    """Return the system of a saved trace as it is read, as it is explored, and the path in it.

    The machines that were read come first in the explored system. `FsmkitError` where the file is
    not to be read.
    """
    replacing = {n: folder / file for n, file in recorded.get("replaced", {}).items()}
    wires = [folder / file for file in recorded.get("wires", ())]
    parameters = recorded.get("parameters", {})
    system = load_any(
        folder / recorded["file"], Findings(), replacing, wires=wires, parameters=parameters
    )
    closed = close(system, untimed=recorded["untimed"], silent=recorded["silent"])
    trail = tuple(
        tuple(
            Step(Action(action), machine, argument, tuple(choices), *map(Fraction, ticks))
            for action, machine, argument, choices, *ticks in steps
        )
        for steps in recorded["trail"]
    )
    return system, closed, trail
