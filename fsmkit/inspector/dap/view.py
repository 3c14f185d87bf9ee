"""Show a session to an editor: stack frames, scopes and variables of the step in view.

The editor refers to frames and variables by numbers. A number identifies a location (a state of a
machine, an element of an array), not a value, so it remains valid.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import Generic, NamedTuple, TypeVar

from fsmkit.chart.chart import Chart
from fsmkit.chart.drawing.states.labels import trigger
from fsmkit.diagnostics import Span
from fsmkit.document.document import Kind
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.hub import Hub
from fsmkit.inspector.questions.microsteps import snapshots_within
from fsmkit.inspector.simulation import Moment, SimulationStep
from fsmkit.language import ArrayType, ContentError, RangeFault, RecordType, Type, Value
from fsmkit.language.units import duration_text
from fsmkit.language.values import part_types, show
from fsmkit.runtime.interpreter import snapshot as snap
from fsmkit.runtime.live.steps import cause_of, status_of
from fsmkit.system.of_one_chart import system_of
from fsmkit.verify import questions

Key = TypeVar("Key")


class Numbers(Generic[Key]):
    """Numbers from 1 for keys, the same one for the same key."""

    def __init__(self) -> None:
        self._numbers: dict[Key, int] = {}
        self._keys: list[Key] = []

    def number(self, key: Key) -> int:
        """Return the number of a key."""
        if key not in self._numbers:
            self._keys.append(key)
            self._numbers[key] = len(self._keys)
        return self._numbers[key]

    def key(self, number: int) -> Key:
        """Return the key of a number; `FsmkitError` for a number that was not given out."""
        if not 1 <= number <= len(self._keys):
            raise wrong(f"the session gave out no number {number}")
        return self._keys[number - 1]


@dataclass(frozen=True, slots=True)
class Frame:
    """A line of a stack: a state of a machine, or of an invoked machine.

    ``within``: the path of invocations. ``kind``: ``state``, ``region`` (a child of a parallel
    state whose siblings are active), ``invoked`` (the boundary of an invoked machine) or
    ``transition`` (taken by the microstep in view).
    """

    machine: int
    within: tuple[int, ...]
    kind: str
    index: int


@dataclass(frozen=True, slots=True)
class Holder:
    """Something that holds variables: a scope, or an array or record in one.

    ``scope``: one of `SCOPES`, or ``watch``, for the expression ``text``.
    """

    machine: int
    within: tuple[int, ...]
    scope: str
    parts: tuple[int, ...] = ()
    text: str = ""


class Shown(NamedTuple):
    """A variable: ``holder`` is given where it holds others."""

    name: str
    value: str
    type: Type | None = None
    holder: Holder | None = None
    size: int = 0
    """Type of its value."""
    expression: str = ""
    """Its expression in the action language."""


SCOPES = ("data", "inputs", "outputs", "event", "timers", "queue")


class View:
    """The step in view of a hub; within a macrostep, one of its microsteps.

    ``micro``: how many microsteps are done; None at the end of the macrostep.
    """

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self.micro: int | None = None
        self._inside: tuple[SimulationStep, tuple[snap.Snapshot, ...]] | None = None
        self._entered_at: Moment | None = None

    @property
    def charts(self) -> Sequence[Chart]:
        """The charts of the machines."""
        return self.hub.simulation.charts

    # --- within a macrostep ----------------------------------------------------------------------

    def enter(self, micro: int) -> bool:
        """Go into the macrostep that ends at the step in view; False if nothing is to be seen.

        ``micro``: how many microsteps are done; from the end, if negative.
        """
        done = self.stepped
        seen = () if done is None else snapshots_within(self.charts[done.machine], done.macrostep)
        place = micro if micro >= 0 else len(seen) + micro
        if done is None or not 1 <= place <= len(seen):
            return False
        self._inside, self.micro, self._entered_at = (done, seen), place, self.hub.moment
        return True

    def leave(self) -> None:
        """Go to the end of the macrostep."""
        self._inside = self.micro = None

    @property
    def is_within(self) -> bool:
        """Return whether the macrostep in view has further microsteps."""
        return self._inside is not None and self.micro != len(self._inside[1])

    def follow(self) -> None:
        """Leave a macrostep from which the hub has gone."""
        if self._inside is not None and self.hub.moment is not self._entered_at:
            self.leave()

    @property
    def stepped(self) -> SimulationStep | None:
        """The macrostep in view; None if the entry is not one, such as the start."""
        if self._inside is not None:
            return self._inside[0]
        return self.hub.stepped

    @property
    def microstep(self) -> tuple[int, snap.Microstep] | None:
        """The machine and the microstep in view, if it is one."""
        if self._inside is None or self.micro is None:
            return None
        done = self._inside[0]
        return done.machine, done.macrostep.microsteps[self.micro - 1]

    @property
    def snapshots(self) -> tuple[snap.Snapshot, ...]:
        """The machines as they are in view."""
        if self.hub.moment is None:
            raise wrong("the data are not known at this step", "go to one where they are")
        found = self.hub.moment.snapshots
        if self._inside is None or self.micro is None:
            return found
        done, seen = self._inside
        return (*found[: done.machine], seen[self.micro - 1], *found[done.machine + 1 :])

    def machine(self, number: int, within: tuple[int, ...]) -> tuple[Chart, snap.Snapshot | None]:
        """Return a machine, or one that it invoked; None if it does not run or is unknown."""
        chart = self.charts[number]
        here = None if self.hub.moment is None else self.snapshots[number]
        for slot in within:
            chart = chart.invocations[slot].chart
            here = None if here is None else here.invoked[slot]
        return chart, here

    # --- frames ----------------------------------------------------------------------------------

    def frames(self, machine: int) -> Iterator[Frame]:
        """Yield the stack of a machine: the innermost states first, its chart last."""
        small = self.microstep
        if small is not None and small[0] == machine:
            for index in small[1].transitions:
                yield Frame(machine, (), "transition", index)
        if self.hub.moment is not None:
            yield from self._frames(machine, ())
            return
        chart, state = self.charts[machine], self.hub.view.course.folded(self.hub.n).states[machine]
        active = {chart.state_index[name] for name in state.on if name in chart.state_index}
        unknown = (None,) * len(chart.invocations)
        yield from self._below(chart, active, unknown, Frame(machine, (), "state", 0))

    def _frames(self, machine: int, within: tuple[int, ...]) -> Iterator[Frame]:
        chart, snapshot = self.machine(machine, within)
        if snapshot is not None:
            root = Frame(machine, within, "state", 0)
            yield from self._below(chart, snapshot.configuration, snapshot.invoked, root)

    def _below(
        self,
        chart: Chart,
        configuration: AbstractSet[int],
        invoked: Sequence[snap.Snapshot | None],
        frame: Frame,
    ) -> Iterator[Frame]:
        """Yield the frames of the active descendants of a state, then its own."""
        state = chart.states[frame.index]
        active = [child for child in state.children if child in configuration]
        for child in active:
            inner = replace(frame, index=child)
            yield from self._below(chart, configuration, invoked, inner)
        for invocation in chart.invocations:
            slot = invocation.index
            if invocation.state == frame.index and invoked[slot] is not None:
                yield from self._frames(frame.machine, (*frame.within, slot))
                yield replace(frame, kind="invoked", index=slot)
        is_region = state.parent is not None and chart.states[state.parent].kind is Kind.PARALLEL
        yield replace(frame, kind="region") if is_region and active else frame

    def title(self, frame: Frame) -> str:
        """Return the name of a frame."""
        chart, snapshot = self.machine(frame.machine, frame.within)
        match frame.kind:
            case "transition":
                return f"transition {frame.index}: {_title_of(chart, frame.index)}"
            case "invoked":
                return f"invoked {chart.invocations[frame.index].id}"
            case "region":
                return f"region {chart.states[frame.index].id}"
            case _ if frame.index:
                return chart.states[frame.index].id
        status = "" if snapshot is None else status_of(snapshot)
        told = {"before": "not started", "finished": "finished"}.get(status, "")
        if snapshot is not None and snapshot.fault is not None:
            told = f"fault {snapshot.fault}"
        return f"{chart.name} ({told})" if told else chart.name

    def span(self, frame: Frame) -> Span:
        """Return where the file has a frame."""
        chart, _ = self.machine(frame.machine, frame.within)
        match frame.kind:
            case "transition":
                return chart.transitions[frame.index].span
            case "invoked":
                invocation = chart.invocations[frame.index]
                return invocation.span or chart.states[invocation.state].span
            case _:
                return chart.states[frame.index].span

    # --- variables -------------------------------------------------------------------------------

    def scopes(self, frame: Frame) -> list[Holder]:
        """Return the scopes of a frame; all frames of a machine have the same."""
        return [Holder(frame.machine, frame.within, scope) for scope in SCOPES]

    def held(self, holder: Holder) -> list[Shown]:
        """Return the variables of a holder."""
        chart, snapshot = self.machine(holder.machine, holder.within)
        if snapshot is None:
            return []
        if holder.parts or holder.scope == "watch":
            value, type_, expression = self.value(holder)
            return list(self._parts(holder, value, type_, expression))
        match holder.scope:
            case "event":
                return self._event(holder)
            case "timers":
                return [_timer(chart, timer, snapshot.now) for timer in snapshot.timers]
            case "queue":
                waiting = [(f"{n}", each) for n, each in enumerate(snapshot.queue)]
                waiting += [(f"deferred {n}", each) for n, each in enumerate(snapshot.deferred)]
                return [Shown(name, _event_text(chart, each)) for name, each in waiting]
            case scope:
                return [
                    self.shown(replace(holder, parts=(n,)), name, value, type_, name)
                    for n, (name, value, type_) in enumerate(_variables(chart, snapshot, scope))
                ]

    def value(self, holder: Holder) -> tuple[Value, Type, str]:
        """Return a holder's value, type and expression; raises `FsmkitError` if it has none."""
        chart, snapshot = self.machine(holder.machine, holder.within)
        parts = holder.parts
        if snapshot is None or (not parts and holder.scope != "watch"):
            raise wrong("this has no value")
        if holder.scope == "watch":
            value, type_ = self.evaluated(holder.machine, holder.within, holder.text)
            is_name = re.fullmatch(r"[\w.\[\]]+", holder.text)
            expression = holder.text if is_name else f"({holder.text})"
        else:
            expression, value, type_ = _variables(chart, snapshot, holder.scope)[parts[0]]
            parts = parts[1:]
        for part in parts:
            names = _part_names(type_)
            if not isinstance(type_, ArrayType | RecordType) or not isinstance(value, tuple):
                raise wrong("this has no value")
            dot = "." if isinstance(type_, RecordType) else ""
            expression, value, type_ = (
                f"{expression}{dot}{names[part]}",
                value[part],
                part_types(type_)[part],
            )
        return value, type_, expression

    def evaluated(
        self, machine: int | None, within: tuple[int, ...], text: str
    ) -> tuple[Value, Type]:
        """Return the value of an expression; ``machine``: whose names it has, None: ``m.name``."""
        system, snapshots = self.hub.system, self.snapshots
        if machine is not None and within:
            chart, snapshot = self.machine(machine, within)
            if snapshot is None:
                raise wrong("this machine does not run any more")
            system, snapshots, machine = system_of(chart), (snapshot,), 0
        expression = questions.read(system, text, machine, None)
        type_ = expression.tree.type
        if type_ is None:
            raise wrong(f"`{text}` has no type")
        return _value(expression, snapshots), type_

    def typed(self, machine: int, text: str, type_: Type) -> Value:
        """Return the value of an expression in a type; `FsmkitError` where it does not fit."""
        return _value(questions.read(self.hub.system, text, machine, type_), self.snapshots)

    def shown(self, holder: Holder, name: str, value: Value, type_: Type, expression: str) -> Shown:
        """Return a value as a variable."""
        tick = self.charts[holder.machine].capacities.tick
        count = len(value) if isinstance(value, tuple) else 0
        kept = holder if count else None
        return Shown(name, show(value, type_, tick), type_, kept, count, expression)

    def _parts(self, holder: Holder, value: Value, type_: Type, expression: str) -> Iterator[Shown]:
        if not isinstance(type_, ArrayType | RecordType) or not isinstance(value, tuple):
            return
        dot = "." if isinstance(type_, RecordType) else ""
        names, types = _part_names(type_), part_types(type_)
        for n, (name, part, of) in enumerate(zip(names, value, types, strict=True)):
            inner = replace(holder, parts=(*holder.parts, n))
            yield self.shown(inner, name, part, of, f"{expression}{dot}{name}")

    def _event(self, holder: Holder) -> list[Shown]:
        """Return the event of the step in view, if it is one of this machine."""
        done, chart = self.stepped, self.charts[holder.machine]
        if holder.within or done is None or done.machine != holder.machine:
            return []
        small, cause = self.microstep, done.macrostep.event
        if small is not None and small[1].event is not None:
            cause = small[1].event
        rows = [Shown("cause", " ".join(map(str, cause_of(chart, cause)[:2])))]
        match cause:
            case snap.Occurrence(event, payload) | snap.Delayed(snap.Occurrence(event, payload)):
                fields, tick = chart.events[event].fields, chart.capacities.tick
                rows += [
                    Shown(field.name, show(value, field.type, tick), field.type)
                    for field, value in zip(fields, payload, strict=True)
                ]
            case snap.Timeout(transition):
                rows.append(Shown("timeout of", _title_of(chart, transition)))
            case _:
                pass
        return rows


def _value(expression: questions.Expression, snapshots: Sequence[snap.Snapshot]) -> Value:
    try:
        return expression.value(snapshots)
    except (ContentError, RangeFault) as error:
        raise wrong(f"`{expression.text}` has no value: {error.reason}") from error


def _variables(chart: Chart, snapshot: snap.Snapshot, scope: str) -> list[tuple[str, Value, Type]]:
    count = len(chart.data)
    match scope:
        case "data":
            declared, values = chart.data, snapshot.data[:count]
        case "outputs":
            declared, values = chart.outputs, snapshot.data[count:]
        case _:
            declared, values = chart.inputs, snapshot.inputs
    return [(one.name, value, one.type) for one, value in zip(declared, values, strict=True)]


def _part_names(type_: Type) -> list[str]:
    match type_:
        case ArrayType(_, length):
            return [f"[{n}]" for n in range(length)]
        case RecordType(_, fields):
            return [field.name for field in fields]
        case _:
            return []


def _event_text(chart: Chart, occurrence: snap.Occurrence) -> str:
    event = chart.events[occurrence.event]
    pairs = zip(event.fields, occurrence.payload, strict=True)
    tick = chart.capacities.tick
    return " ".join([event.name, *(f"{f.name}={show(v, f.type, tick)}" for f, v in pairs)])


def _title_of(chart: Chart, transition: int) -> str:
    words = trigger(chart, chart.transitions[transition]) or "always"
    return f"{words} of {chart.states[chart.transitions[transition].source].id}"


def _timer(chart: Chart, timer: snap.Timer, now: int) -> Shown:
    tick = chart.capacities.tick
    left = duration_text(max(0, timer.deadline - now) * tick)
    text = f"at {duration_text(timer.deadline * tick)}, in {left}"
    if isinstance(timer.what, snap.Timeout):
        return Shown(_title_of(chart, timer.what.transition), text)
    return Shown(_event_text(chart, timer.what.occurrence), text)
