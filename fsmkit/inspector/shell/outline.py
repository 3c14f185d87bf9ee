"""Print the active states: as a line below the prompt, and as an outline."""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text

from fsmkit.chart.chart import Chart
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.simulation import Moment
from fsmkit.language.units import duration_text
from fsmkit.runtime.interpreter.snapshot import Snapshot, Timeout
from fsmkit.runtime.interpreter.trace import active_leaves
from fsmkit.runtime.trace_text import Printer


def moment_of(hub: Hub) -> Moment:
    """Return the system at the entry in view; `FsmkitError` where it is not known."""
    if hub.moment is None:
        raise wrong("the data are not known at this entry", "go back, or let time pass")
    return hub.moment


def bottom_line(hub: Hub) -> str:
    """Return the time, the active states and the next deadline."""
    tick, now = hub.simulation.tick, hub.at
    parts = [duration_text(now * tick), "  ".join(_machines(hub))]
    due = hub.simulation.next_deadline(moment_of(hub))
    parts.append(
        "no timer" if due is None else f"{_due(hub, due)} in {duration_text((due - now) * tick)}"
    )
    return " | ".join(parts)


def _machines(hub: Hub) -> Iterator[str]:
    names, charts = hub.simulation.names, hub.simulation.charts
    for name, chart, snapshot in zip(names, charts, moment_of(hub).snapshots, strict=True):
        active = ", ".join(active_leaves(chart, snapshot)) or "-"
        if snapshot.fault is not None:
            active += f" ({snapshot.fault})"
        elif snapshot.finished:
            active += " (finished)"
        yield active if len(names) == 1 else f"{name}: {active}"


def _due(hub: Hub, deadline: int) -> str:
    """Return the name of the timer with the first deadline."""
    names, charts = hub.simulation.names, hub.simulation.charts
    for name, chart, snapshot in zip(names, charts, moment_of(hub).snapshots, strict=True):
        if snapshot.running and snapshot.timers and snapshot.timers[0].deadline == deadline:
            what = snapshot.timers[0].what
            if isinstance(what, Timeout):
                transition = chart.transitions[what.transition]
                source = chart.states[transition.source].id
                text = f"{source}: {Printer(chart).trigger(transition)}"
            else:
                text = Printer(chart).event(what.occurrence)
            return text if len(names) == 1 else f"{name}.{text}"
    return "a timer of an invoked machine"


def outline(chart: Chart, snapshot: Snapshot) -> Iterator[Text]:
    """Yield a line for each state within something active: ``*`` marks those that are active."""
    for state in chart.states[1:]:
        if state.parent not in snapshot.configuration or state.is_history:
            continue
        is_active = state.index in snapshot.configuration
        line = f"{'*' if is_active else ' '} {'  ' * (state.depth - 1)}{state.id}"
        yield Text(line, "bold green" if is_active else "dim")
