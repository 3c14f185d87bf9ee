"""Describe a step in one line."""

from __future__ import annotations

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.states.labels import trigger
from fsmkit.emit import plain
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.simulation import SimulationStep
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.live.messages import Post, Set, Step


def describe_step(
    hub: Hub, done: SimulationStep | None, small: tuple[int, snap.Microstep] | None
) -> str:
    """Return the last step: ``feeder: arrived, pushing -> pressing``.

    ``done``: the macrostep in view; None if the entry is no macrostep or its data are unknown.
    ``small``: the microstep in view.
    """
    if done is None:
        return plain(_told(hub))
    machine = hub.system.machines[done.machine]
    chart, macrostep = machine.chart, done.macrostep
    prefix = _prefix(hub, machine.name)
    if small is not None:
        return plain(f"{prefix}microstep: {_small(chart, small[1])}")
    return plain(f"{prefix}{_cause(chart, macrostep.event)}, {_leaf_changes(chart, macrostep)}")


def _prefix(hub: Hub, machine: str) -> str:
    return f"{machine}: " if len(hub.system.machines) > 1 else ""


def _told(hub: Hub) -> str:
    """Describe an entry by its messages."""
    match hub.messages:
        case [Post(m=name, event=[event, *_], how=how), *_]:
            return f"{_prefix(hub, name)}{event} is {how}"
        case [Set(m=name, inputs=inputs, data=data, results=results), *_]:
            changed = [f"{key} = {value}" for key, value in (*inputs.items(), *data.items())]
            changed += [f"{key} returns {', '.join(map(str, r))}" for key, r in results.items()]
            return f"{_prefix(hub, name)}{', '.join(changed)}"
        case [Step(m=name, cause=cause), *_]:
            return f"{_prefix(hub, name)}{' '.join(map(str, cause))}"
        case [first, *_]:
            return type(first).__name__.lower()
        case _:
            return "not started"


def _leaf_changes(chart: Chart, macrostep: snap.Macrostep) -> str:
    """Return the leaves that a macrostep exited and entered, or the result of its cause."""
    before, after = active_leaves(chart, macrostep.before), active_leaves(chart, macrostep.after)
    left = [name for name in before if name not in after]
    entered = [name for name in after if name not in before]
    effects = macrostep.effects
    if left and entered:
        return f"{' '.join(left)} -> {' '.join(entered)}"
    what = "in"
    if any(isinstance(effect, snap.Deferred) for effect in effects):
        what = "deferred in"
    elif any(isinstance(effect, snap.SpentTimeout) for effect in effects):
        what = "its guard is false in"
    elif not any(each.transitions for each in macrostep.microsteps) and any(
        isinstance(effect, snap.Unhandled) for effect in effects
    ):
        what = "ignored in"
    return f"{what} {' '.join(after)}"


def _cause(chart: Chart, cause: snap.Cause) -> str:
    match cause:
        case snap.Start():
            return "start"
        case snap.Occurrence(event):
            return chart.events[event].name
        case snap.Delayed(snap.Occurrence(event)):
            return f"{chart.events[event].name} after its delay"
        case snap.Timeout(number):
            return trigger(chart, chart.transitions[number])
        case None:
            return "inputs changed"
        case _:
            return "invoked machines continued"


def _small(chart: Chart, small: snap.Microstep) -> str:
    left = " ".join(chart.states[state].id for state in small.exited)
    entered = " ".join(chart.states[state].id for state in small.entered)
    cause = "no event" if small.event is None else _cause(chart, small.event)
    taken = "".join(f", transition {number}" for number in small.transitions)
    return f"{cause}{taken}, {left} -> {entered}" if left or entered else f"{cause}{taken}"
