"""Breakpoints: where a session stops. Conditions stop where they *become* true."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import msgspec

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError, fail
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.inspector.commands import Break, wrong
from fsmkit.inspector.simulation import Moment
from fsmkit.language import BOOL, ContentError, RangeFault, Value
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.runtime.live.messages import AnyMessage, Json, Pass, Points, Step
from fsmkit.system.properties.property import Property
from fsmkit.system.system import System, state_properties
from fsmkit.verify import questions
from fsmkit.verify.engines.python.evaluate import evaluate_property
from fsmkit.verify.questions import Expression

MOST = 100
"""Breakpoints of a session."""
KINDS = (
    *("entered", "left", "taken", "event", "sent", "fault"),
    *("error", "lost", "condition", "changed", "property"),
)
EXPRESSION = re.compile(r"\{([^{}]*)\}")
"""Placeholder of a value in the text of a log."""


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """A breakpoint with resolved names.

    ``machine`` None: any machine. ``what``: a state, transition or event by index. It counts the
    hits at which ``guard`` holds after the step, skips ``after`` of them, then stops at each
    ``every``-th one, at most ``times`` times (0: always). With ``log``, alternating texts and
    expressions, it prints instead of stopping.
    """

    on: str
    text: str
    machine: int | None = None
    what: int | None = None
    condition: Expression | None = None
    property: Property | None = None
    guard: Expression | None = None
    after: int = 0
    every: int = 1
    times: int = 0
    log: tuple[str | Expression, ...] = ()

    def is_counted(self, hit: int) -> bool:
        """Whether it does something the ``hit``-th time (from 1)."""
        over, rest = divmod(hit - self.after - 1, self.every)
        return over >= 0 and rest == 0 and (self.times == 0 or over < self.times)


def read(system: System, command: Break) -> Breakpoint:
    """Return a breakpoint; `FsmkitError` for a kind or a name that there is not."""
    if command.on not in KINDS:
        help_ = suggest(command.on, KINDS, f"use one of {', '.join(KINDS)}")
        raise wrong(f"there is no breakpoint on `{command.on}`", help_)
    machine = machine_of(system, command.m) if command.m or len(system.machines) == 1 else None
    guard = (
        questions.read(system, command.guard, machine_without_prefix(system, command.m), BOOL)
        if command.guard
        else None
    )
    if command.every < 1 or command.after < 0 or command.times < 0:
        raise wrong("a breakpoint counts from 1", "`every` is 1 or more, `after` and `times` 0")
    found = Breakpoint(
        command.on,
        str(command.what),
        machine,
        guard=guard,
        after=command.after,
        every=command.every,
        times=command.times,
        log=_log(system, command),
    )
    match command.on:
        case "condition":
            own = machine_without_prefix(system, command.m)
            condition = questions.read(system, str(command.what), own, BOOL)
            return replace(found, condition=condition)
        case "changed":
            own = machine_without_prefix(system, command.m)
            return replace(found, condition=questions.read(system, str(command.what), own, None))
        case "property":
            return replace(found, property=_property(system, str(command.what)))
        case "fault" | "error" | "lost":
            return found
        case _:
            if machine is None:
                raise wrong("the command names no machine", "give `m`")
            return replace(found, what=_place(system.machines[machine].chart, command))


def _log(system: System, command: Break) -> tuple[str | Expression, ...]:
    """Return the parts of a log text; the contents of braces are expressions."""
    parts: list[str | Expression] = []
    for place, part in enumerate(EXPRESSION.split(command.log)):
        if place % 2:
            parts.append(
                questions.read(system, part, machine_without_prefix(system, command.m), None)
            )
        elif part:
            parts.append(part)
    return tuple(parts)


def log_text(system: System, point: Breakpoint, moment: Moment | None) -> str:
    """Return the text of a breakpoint that logs, with its values."""
    tick = system.machines[0].chart.capacities.tick
    snapshots = None if moment is None else moment.snapshots
    return "".join(
        part if isinstance(part, str) else _shown(part, snapshots, tick) for part in point.log
    )


def _shown(expression: Expression, snapshots: Sequence[Snapshot] | None, tick: int) -> str:
    if snapshots is None:
        return "<unknown>"
    try:
        value, type_ = expression.value(snapshots), expression.tree.type
    except (ContentError, RangeFault) as error:
        return f"<{error.reason}>"
    return str(value) if type_ is None else show(value, type_, tick)


def machine_without_prefix(system: System, machine: str) -> int | None:
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
    known = {each.name: each for each in state_properties(system)}
    if name not in known:
        raise fail(
            "unknown-name",
            f"there is no property `{name}` of states",
            help=suggest(name, known, f"use one of {', '.join(list(known)[:8])}"),
        )
    return known[name]


def _place(chart: Chart, command: Break) -> int:
    """Return the index of the named state, transition or event."""
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


def is_hit(
    system: System,
    point: Breakpoint,
    before: Moment | None,
    after: Moment | None,
    messages: Sequence[AnyMessage],
) -> bool:
    """Return whether an entry hits a breakpoint; ``messages``: of the entry.

    Steps are taken from the messages. A condition does not hold if a moment is unknown.
    """
    if point.guard is not None and (
        after is None or not questions.holds(point.guard, after.snapshots)
    ):
        return False
    if point.condition is not None or point.property is not None:
        if before is None or after is None:
            return False
        if point.on == "changed":
            return _value(point.condition, before) != _value(point.condition, after)
        was, is_now = (_holds(system, point, moment) for moment in (before, after))
        return is_now and not was
    step = messages[0]
    if not isinstance(step, Step):
        return False
    if point.on == "lost" and any(isinstance(m, Pass) and m.how == "refused" for m in messages):
        return True
    if point.machine is not None and system.machines[point.machine].name != step.m:
        return False
    return _has_matching_row(system, point, step)


def _holds(system: System, point: Breakpoint, moment: Moment) -> bool:
    if point.condition is not None:
        return questions.holds(point.condition, moment.snapshots)
    charts = [machine.chart for machine in system.machines]
    snapshots = moment.snapshots
    return point.property is not None and evaluate_property(charts, point.property, snapshots)


def _value(expression: Expression | None, moment: Moment) -> tuple[Value | None, str]:
    """Return a value and a text that distinguishes NaNs and signed zeros."""
    if expression is None:
        return None, ""
    try:
        value = expression.value(moment.snapshots)
    except (ContentError, RangeFault) as error:
        return None, error.reason
    return value, repr(value)


SENT = ("out", "raise", "send")
WORDS = {"fault": "fault", "error": "error", "lost": "full"}
"""Words of rows in which a breakpoint without a name is hit."""


def _has_matching_row(system: System, point: Breakpoint, step: Step) -> bool:
    if point.on in WORDS:
        return any(row[0] == WORDS[point.on] for row in step.do)
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


Hit = Callable[[Moment | None, Moment | None, Sequence[AnyMessage]], list[Json] | None]
"""Returns the reasons to stop at an entry, given the moments around it and its messages."""


def hit_detector(system: System, point: Breakpoint) -> Hit:
    """Return a function that detects hits of one breakpoint, without a number."""
    return lambda *entry: ["sought"] if is_hit(system, point, *entry) else None


class Breakpoints:
    """The breakpoints of a session, by number, and how often each was hit."""

    def __init__(self, system: System) -> None:
        """Start without breakpoints."""
        self._system = system
        self._points: dict[int, Breakpoint] = {}
        self._commands: dict[int, Break] = {}
        self._hit: dict[int, int] = {}
        self._next = 1
        self.until: Breakpoint | None = None
        """A breakpoint that is removed at its first hit."""
        self.log: Callable[[int, str], None] = lambda _number, _text: None
        """Is given the text of a breakpoint that logs."""

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

    @property
    def message(self) -> Points:
        """All of them, for clients."""
        listed = [
            {"number": number, **{key: value for key, value in msgspec.to_builtins(command).items()
                                  if key not in ("id", "do") and value not in ("", 0)}}
            for number, command in self._commands.items()
        ]  # fmt: skip
        return Points(points=listed)

    def stop_reasons(
        self, before: Moment | None, after: Moment | None, messages: Sequence[AnyMessage]
    ) -> list[Json] | None:
        """Return the reasons to stop at an entry, ignoring counts; None if there is no reason."""
        for number, point in self._points.items():
            if not point.log and is_hit(self._system, point, before, after, messages):
                return ["breakpoint", number]
        return fault_of(messages)

    def set_system(self, system: System) -> None:
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
        """Count the hits of an entry, and log; return the reasons to stop, or None."""
        why: list[Json] | None = None
        for number, point in self._points.items():
            if is_hit(self._system, point, before, after, messages):
                self._hit[number] = self._hit.get(number, 0) + 1
                if not point.is_counted(self._hit[number]):
                    continue
                if point.log:
                    self.log(number, log_text(self._system, point, after))
                else:
                    why = why or ["breakpoint", number]
        if self.until is not None and is_hit(self._system, self.until, before, after, messages):
            why = why or ["until", self.until.text]
            self.until = None
        return why


def fault_of(messages: Sequence[AnyMessage]) -> list[Json] | None:
    """Return the fault with which an entry ends, as a reason to stop; None without one."""
    step = messages[0]
    if isinstance(step, Step) and isinstance(step.fault, str):
        return ["fault", step.fault, step.m]
    return None
