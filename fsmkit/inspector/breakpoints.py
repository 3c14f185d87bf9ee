"""Breakpoints: where a session stops. Conditions stop where they *become* true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.suggest import suggest
from fsmkit.inspector import queries
from fsmkit.inspector.commands import Break, wrong
from fsmkit.inspector.queries import Expression
from fsmkit.inspector.simulation import Moment
from fsmkit.language import BOOL
from fsmkit.runtime.live.messages import AnyMessage, Json, Step
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


def hits(
    system: System,
    point: Breakpoint,
    before: Moment | None,
    after: Moment | None,
    messages: Sequence[AnyMessage],
) -> bool:
    """Whether an entry hits a breakpoint; ``messages``: of the entry.

    What happened is in the messages; a condition is never met where a moment is not known.
    """
    if point.guard is not None and (
        after is None or not queries.holds(point.guard, after.snapshots)
    ):
        return False
    if point.condition is not None or point.property is not None:
        if before is None or after is None:
            return False
        was, is_now = (_holds(system, point, moment) for moment in (before, after))
        return is_now and not was
    step = messages[0]
    if not isinstance(step, Step):
        return False
    if point.machine is not None and system.machines[point.machine].name != step.m:
        return False
    return _happened(system, point, step)


def _holds(system: System, point: Breakpoint, moment: Moment) -> bool:
    if point.condition is not None:
        return queries.holds(point.condition, moment.snapshots)
    charts = [machine.chart for machine in system.machines]
    snapshots = moment.snapshots
    return point.property is not None and evaluate_property(charts, point.property, snapshots)


SENT = ("out", "raise", "send")


def _happened(system: System, point: Breakpoint, step: Step) -> bool:
    if point.on == "fault":
        return any(row[0] == "fault" for row in step.do)
    if point.machine is None or point.what is None:
        return False
    chart = system.machines[point.machine].chart
    match point.on:
        case "taken":
            wanted = [["t", point.what]]
        case "entered":
            wanted = [["+", chart.states[point.what].id]]
        case "left":
            wanted = [["-", chart.states[point.what].id]]
        case "event":
            event = chart.events[point.what].name
            return step.cause[0] in ("event", "delayed") and step.cause[1] == event
        case _:
            event = chart.events[point.what].name
            to_peer = any(row[0] == "out to" and row[2] == event for row in step.do)
            return to_peer or any(row[0] in SENT and row[1] == event for row in step.do)
    return any(row in wanted for row in step.do)


class Breakpoints:
    """The breakpoints of a session, by number, and how often each was hit."""

    def __init__(self, system: System) -> None:
        """Begin without any."""
        self._system = system
        self._points: dict[int, Breakpoint] = {}
        self._commands: dict[int, Break] = {}
        self._hit: dict[int, int] = {}
        self._next = 1
        self.until: Breakpoint | None = None
        """One that is gone once it is hit."""

    def add(self, command: Break) -> int:
        """Add a breakpoint; return its number. `FsmkitError` for names that there are not."""
        if len(self._points) >= MOST:
            raise wrong(f"there are {MOST} breakpoints", "remove one")
        point = read(self._system, command)
        number, self._next = self._next, self._next + 1
        self._points[number], self._commands[number] = point, command
        return number

    def remove(self, number: int) -> None:
        """Remove a breakpoint; `FsmkitError` for a number of none."""
        if self._points.pop(number, None) is None:
            raise wrong(f"there is no breakpoint {number}")
        del self._commands[number]
        self._hit.pop(number, None)

    def read_anew(self, system: System) -> None:
        """Take another system: breakpoints whose names it does not have are removed."""
        self._system, self.until = system, None
        for number, command in list(self._commands.items()):
            try:
                self._points[number] = read(system, command)
            except FsmkitError:
                self.remove(number)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._points) or self.until is not None

    def hit(
        self, before: Moment | None, after: Moment | None, messages: Sequence[AnyMessage]
    ) -> list[Json] | None:
        """Count what an entry hits; return the reason to stop there, None for none."""
        why: list[Json] | None = None
        for number, point in self._points.items():
            if hits(self._system, point, before, after, messages):
                self._hit[number] = self._hit.get(number, 0) + 1
                if self._hit[number] > point.after:
                    why = why or ["breakpoint", number]
        if self.until is not None and hits(self._system, self.until, before, after, messages):
            why = why or ["until", self.until.text]
            self.until = None
        return why
