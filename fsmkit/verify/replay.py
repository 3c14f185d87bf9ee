"""Perform a recorded trace again; the saved pytests call this."""

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

    Files are relative to ``folder``. Raises `ReplayError` if a step is no longer possible: the
    charts have changed.
    """
    return [list(step.lines) for step in _perform(recorded, folder)[1]]


def perform_in_python(recorded: Mapping[str, Any], folder: Path = Path()) -> list[list[str]]:
    """Perform them in the generated Python, without the lines with the time of a step."""
    closed, steps = _perform(recorded, folder)
    return in_python(closed, steps)


def _perform(recorded: Mapping[str, Any], folder: Path) -> tuple[ClosedSystem, list[TraceStep]]:
    _, closed, trail = load_trace(recorded, folder)
    return closed, Replay(closed).write(trail)


def load_trace(
    recorded: Mapping[str, Any], folder: Path = Path()
) -> tuple[System, ClosedSystem, Trail]:
    """Return the system of a saved trace, the same as it is explored, and the path in it.

    The machines of the system come first in the explored system. Raises `FsmkitError` if the file
    cannot be read.
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
