"""A step in a line, for whoever stands at it."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.diagram.states.labels import trigger
from fsmkit.inspector.simulation import Stepped
from fsmkit.runtime.interpreter.snapshot import (
    Cause,
    Deferred,
    Delayed,
    Microstep,
    Occurrence,
    Spent,
    Start,
    Timeout,
    Unhandled,
)
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.system.system import System
from fsmkit.texts import plain


def described(system: System, done: Stepped | None, small: tuple[int, Microstep] | None) -> str:
    """Return what a macrostep did, or one of its microsteps: ``feeder: arrived, a -> b``."""
    if done is None:
        return "at the start, or by hand"
    machine = system.machines[done.machine]
    chart, macrostep = machine.chart, done.macrostep
    prefix = f"{machine.name}: " if len(system.machines) > 1 else ""
    if small is not None:
        return plain(f"{prefix}microstep: {_small(chart, small[1])}")
    before, after = active_leaves(chart, macrostep.before), active_leaves(chart, macrostep.after)
    has_moved = before and before != after
    went = f"{_listed(before)} -> {_listed(after)}" if has_moved else f"in {_listed(after)}"
    ignored = [effect for effect in macrostep.effects if isinstance(effect, Unhandled)]
    if any(isinstance(effect, Deferred) for effect in macrostep.effects):
        went = f"kept for later {went}"
    elif ignored and not any(each.transitions for each in macrostep.microsteps):
        went = f"ignored {went}"
    elif any(isinstance(effect, Spent) for effect in macrostep.effects):
        went = f"its guard is false {went}"
    return plain(f"{prefix}{_cause(chart, macrostep.event)}, {went}")


def _cause(chart: Chart, cause: Cause) -> str:
    match cause:
        case Start():
            return "start"
        case Occurrence(event):
            return chart.events[event].name
        case Delayed(Occurrence(event)):
            return f"{chart.events[event].name} is due"
        case Timeout(number):
            return trigger(chart, chart.transitions[number])
        case None:
            return "inputs changed"
        case _:
            return "what it invoked went on"


def _small(chart: Chart, small: Microstep) -> str:
    left = _listed([chart.states[state].id for state in small.exited])
    entered = _listed([chart.states[state].id for state in small.entered])
    cause = "no event" if small.event is None else _cause(chart, small.event)
    taken = "".join(f", transition {number}" for number in small.transitions)
    return f"{cause}{taken}, {left} -> {entered}" if left or entered else f"{cause}{taken}"


def _listed(names: list[str]) -> str:
    return " ".join(names)
