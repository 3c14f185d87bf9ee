"""Breakpoints: where a session stops. Conditions stop where they *become* true."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.diagnostics.suggest import suggest
from fsmkit.inspector import queries
from fsmkit.inspector.commands import Break, wrong
from fsmkit.inspector.queries import Expression
from fsmkit.inspector.simulation import Moment, Stepped
from fsmkit.language import BOOL
from fsmkit.runtime.interpreter import snapshot as effects
from fsmkit.runtime.interpreter.snapshot import Delayed, Macrostep, Occurrence
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System
from fsmkit.verify.engines.python.evaluate import evaluate_property

MOST = 100
"""Breakpoints of a session."""
KINDS = ("entered", "left", "taken", "event", "sent", "fault", "condition", "property")


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """A breakpoint, its names found.

    ``machine`` None: any. ``what``: a state, transition or event by index. It stops from the
    ``after + 1``-th time on, where ``guard`` holds after the step.
    """

    on: str
    text: str
    machine: int | None = None
    what: int | None = None
    condition: Expression | None = None
    property: Property | None = None
    guard: Expression | None = None
    after: int = 0


def read(system: System, command: Break) -> Breakpoint:
    """Return a breakpoint; `FsmkitError` for a kind or a name that there is not."""
    if command.on not in KINDS:
        help_ = suggest(command.on, KINDS, f"use one of {', '.join(KINDS)}")
        raise wrong(f"there is no breakpoint on `{command.on}`", help_)
    machine = machine_of(system, command.m) if command.m or len(system.machines) == 1 else None
    guard = (
        queries.read(system, command.guard, own_names(system, command.m), BOOL)
        if command.guard
        else None
    )
    found = Breakpoint(command.on, str(command.what), machine, guard=guard, after=command.after)
    match command.on:
        case "condition":
            own = own_names(system, command.m)
            condition = queries.read(system, str(command.what), own, BOOL)
            return _with(found, condition=condition)
        case "property":
            return _with(found, property_=_property(system, str(command.what)))
        case "fault":
            return found
        case _:
            if machine is None:
                raise wrong("the command names no machine", "give `m`")
            return _with(found, what=_place(system.machines[machine].chart, command))


def _with(
    found: Breakpoint,
    *,
    what: int | None = None,
    condition: Expression | None = None,
    property_: Property | None = None,
) -> Breakpoint:
    return Breakpoint(
        found.on, found.text, found.machine, what, condition, property_, found.guard, found.after
    )


def own_names(system: System, machine: str) -> int | None:
    """Return the machine whose names an expression has; None: names are ``machine.name``."""
    if machine:
        return machine_of(system, machine)
    return 0 if len(system.machines) == 1 else None


def machine_of(system: System, name: str) -> int:
    """Return the place of a machine; `FsmkitError` (``unknown-name``) for none."""
    names = [machine.name for machine in system.machines]
    if not name and len(names) == 1:
        return 0
    if name not in names:
        raise fail(
            "unknown-name",
            f"there is no machine `{name}`",
            help=suggest(name, names, f"use one of {', '.join(names[:8])}"),
        )
    return names.index(name)


def _property(system: System, name: str) -> Property:
    known = {each.name: each for each in system.properties if each.condition is not None}
    if name not in known:
        raise fail(
            "unknown-name",
            f"there is no property `{name}` of states",
            help=suggest(name, known, f"use one of {', '.join(list(known)[:8])}"),
        )
    return known[name]


def _place(chart: Chart, command: Break) -> int:
    """Return the index of what a breakpoint names."""
    if command.on == "taken":
        if not isinstance(command.what, int) or not 0 <= command.what < len(chart.transitions):
            raise wrong(
                f"there is no transition {command.what}",
                f"give a number from 0 to {len(chart.transitions) - 1}",
            )
        return command.what
    is_state = command.on in ("entered", "left")
    known = chart.state_index if is_state else chart.event_index
    if command.what not in known:
        kind, names = ("state" if is_state else "event"), list(known)
        raise fail(
            "unknown-name",
            f"`{chart.name}` has no {kind} `{command.what}`",
            help=suggest(str(command.what), names, f"use one of {', '.join(names[:8])}"),
        )
    return known[str(command.what)]


def hits(system: System, point: Breakpoint, before: Moment, after: Moment, done: Stepped) -> bool:
    """Whether a step hits a breakpoint."""
    if point.guard is not None and not queries.holds(point.guard, after.snapshots):
        return False
    if point.condition is not None:
        was = queries.holds(point.condition, before.snapshots)
        return not was and queries.holds(point.condition, after.snapshots)
    if point.property is not None:
        charts = [machine.chart for machine in system.machines]
        was = evaluate_property(charts, point.property, before.snapshots)
        return not was and evaluate_property(charts, point.property, after.snapshots)
    if point.machine not in (None, done.machine):
        return False
    return _happened(point, done.macrostep)


def _happened(point: Breakpoint, macrostep: Macrostep) -> bool:
    for effect in macrostep.effects:
        match point.on, effect:
            case "entered", effects.Entered(state) if state == point.what:
                return True
            case "left", effects.Exited(state) if state == point.what:
                return True
            case "taken", effects.Taken(transition) if transition == point.what:
                return True
            case "sent", effects.Emitted(Occurrence(event)) if event == point.what:
                return True
            case "sent", effects.Raised(Occurrence(event)) if event == point.what:
                return True
            case "sent", effects.Sent(Occurrence(event)) if event == point.what:
                return True
            case "fault", effects.Faulted():
                return True
            case _:
                pass
    match point.on, macrostep.event:
        case "event", Occurrence(event):
            return event == point.what
        case "event", Delayed(Occurrence(event)):
            return event == point.what
        case _:
            return False
