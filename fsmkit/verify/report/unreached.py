"""What no run of a machine comes to, and how one stops: words for what was explored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fsmkit.chart.chart import Chart, State, Transition
from fsmkit.document.document import Trigger
from fsmkit.runtime.cycles import cycle_text, taken_in
from fsmkit.system.properties.kinds.monitor import errors_of
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import TraceStep
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import Exploration


def never_entered(closed: ClosedSystem, found: Exploration, machine: int) -> Iterator[State]:
    """Yield the outermost states that are never entered."""
    chart, entered = closed.system.machines[machine].chart, found.machines[machine].states
    hoped = errors_of(closed.system.machines[machine])
    for state in chart.states[1:]:
        if state.is_history or state.index in entered or state.index in hoped:
            continue
        if not state.parent or state.parent in entered:
            yield state


def never_taken(closed: ClosedSystem, found: Exploration, machine: int) -> Iterator[Transition]:
    """Yield the transitions that are never taken though their source is entered."""
    chart, figures = closed.system.machines[machine].chart, found.machines[machine]
    hoped = errors_of(closed.system.machines[machine])
    for transition in chart.transitions:
        reachable = not transition.source or transition.source in figures.states
        expected = transition.trigger is not Trigger.INITIAL and not closed.is_silent(
            machine, transition.index
        )
        expected = expected and not hoped & {transition.source, *transition.targets}
        if reachable and expected and transition.index not in figures.transitions:
            yield transition


def lines_of(chart: Chart, transitions: Sequence[Transition]) -> str:
    """Return where transitions stand: ``of `a` at gate.yaml:7 and 9, of `b` at gate.yaml:12``."""
    found: dict[tuple[str, str], list[str]] = {}
    for transition in transitions:
        source = transition.span.source
        line, _ = source.position(transition.span.start)
        state = chart.states[transition.source].id
        found.setdefault((f"`{state}`" if state else "the root", source.name), []).append(str(line))
    told = (
        f"of {state} at {file}:{' and '.join(dict.fromkeys(lines))}"
        for (state, file), lines in found.items()
    )
    return ", ".join(told)


def fault_text(system: System, step: TraceStep) -> str:
    """Return why the last step of a path stopped its machine, as the end of a sentence."""
    reasons = [line.removeprefix("fault ") for line in step.lines if line.startswith("fault ")]
    machine = next((each for each in system.machines if each.name == step.machine), None)
    cycle = "" if machine is None else cycle_text(machine.chart, taken_in(step.lines))
    rounds = f", round and round: {cycle}" if reasons[-1:] == ["microsteps"] and cycle else ""
    return f": {reasons[-1]}{rounds}" if reasons else ""
