"""Breakpoints of an editor as breakpoints of the hub; one of an editor may be several there."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec

from fsmkit.diagnostics import FsmkitError
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap.face import Face
from fsmkit.inspector.dap.places import Places, Target
from fsmkit.runtime.script import is_received
from fsmkit.system.system import state_properties

HITS = re.compile(r"\s*(>=|>|==|=|<=|<|%|)\s*(\d{1,9})\s*")
FILTERS = (
    ("fault", "Faults", "A machine stops with a fault.", True),
    ("property", "Broken properties", "A property of the system is violated.", True),
    ("lost", "Lost events", "A queue is full, and an event is dropped.", True),
    ("error", "Error events", "The platform raises an event `error.*`.", False),
)
"""The exception filters: id, name, description, and whether they are on by default."""


class RequestedBreakpoint(msgspec.Struct, rename="camel"):
    """A breakpoint as an editor gives it; of each kind some of these."""

    line: int = 0
    column: int | None = None
    name: str = ""
    data_id: str = ""
    condition: str | None = None
    hit_condition: str | None = None
    log_message: str | None = None


@dataclass(frozen=True, slots=True)
class Stop:
    """A breakpoint of the editor, to which one of the hub belongs: its number there, its kind."""

    number: int
    reason: str
    title: str = ""


@dataclass(slots=True)
class Stops:
    """The breakpoints of a session."""

    face: Face
    places: Places
    filters: frozenset[str] = frozenset(name for name, _, _, on in FILTERS if on)
    _own: dict[str, list[int]] = field(default_factory=dict)
    """Numbers of the hub by group: a file, functions, data, exceptions."""
    _of: dict[int, Stop] = field(default_factory=dict)
    _next: int = 1

    def of(self, number: int) -> Stop | None:
        """Return the breakpoint of the editor to which one of the hub belongs, if to any."""
        return self._of.get(number)

    def close(self) -> None:
        """Remove all: others may go on with the session."""
        for group in tuple(self._own):
            self._clear(group)

    # --- breakpoints of the editor ------------------------------------------------------------

    def in_source(
        self, path: str, wanted: Iterable[RequestedBreakpoint]
    ) -> Iterator[dict[str, Any]]:
        """Set the breakpoints of a file, and yield the result of each; lines and columns from 1."""
        group = f"source {path}"
        self._clear(group)
        for each in wanted:
            place = self.places.at(path, each.line, each.column)
            if place is None:
                lost = "no state, transition or statement of a machine that runs is here or below"
                known = self.places.of(path)
                yield self._rejected_breakpoint(
                    lost if known else "no machine that runs is of this file"
                )
                continue
            found = self._set(group, "breakpoint", map(self._break, place.targets), each)
            yield {**found, "line": place.line, "column": place.column}

    def on_functions(self, wanted: Iterable[RequestedBreakpoint]) -> Iterator[dict[str, Any]]:
        """Set those on names of states and events: ``name`` or ``machine.name``."""
        self._clear("function")
        for each in wanted:
            breaks = list(self._named(each.name))
            if breaks:
                yield self._set("function", "function breakpoint", breaks, each)
            else:
                names = [n for m in self.face.hub.system.machines for n in m.chart.state_index]
                near = suggest(each.name, names, "name a state or an event")
                yield self._rejected_breakpoint(
                    f"there is no state and no event `{each.name}`: {near}"
                )

    def on_data(self, wanted: Iterable[RequestedBreakpoint]) -> Iterator[dict[str, Any]]:
        """Set those on values that change."""
        self._clear("data")
        for each in wanted:
            try:
                machine, expression = read_data_id(each.data_id)
            except FsmkitError as error:
                yield self._rejected_breakpoint(error.diagnostics[0].message)
                continue
            given = {"on": "changed", "m": machine, "what": expression}
            yield self._set("data", "data breakpoint", (given,), each, title=expression)

    def on_exceptions(self, filters: Iterable[str]) -> Iterator[dict[str, Any]]:
        """Set the filters."""
        self._clear("exception")
        given = list(filters)
        known = [name for name, *_ in FILTERS]
        self.filters = frozenset(given)
        for name in given:
            if name not in known:
                yield self._rejected_breakpoint(f"there is no filter `{name}`: {', '.join(known)}")
                continue
            breaks: list[Mapping[str, Any]] = []
            if name == "property":
                breaks = [
                    {"on": "property", "what": each.name}
                    for each in state_properties(self.face.hub.system)
                    if not each.is_existential
                ]
            elif name != "fault":  # the hub always stops at faults
                breaks = [{"on": name}]
            yield self._set("exception", "exception", breaks, RequestedBreakpoint(), title=name)

    # --- inside ----------------------------------------------------------------------------------

    def _break(self, target: Target) -> Mapping[str, Any]:
        machine = self.face.hub.system.machines[target.machine]
        is_state = target.on in ("entered", "left")
        what = machine.chart.states[target.what].id if is_state else target.what
        return {"on": target.on, "m": machine.name, "what": what}

    def _named(self, name: str) -> Iterator[Mapping[str, Any]]:
        machines = self.face.hub.system.machines
        first, _, rest = name.partition(".")
        for machine in machines:
            for own in {name, rest} if machine.name == first else {name}:
                given = {"m": machine.name, "what": own}
                if own in machine.chart.state_index:
                    yield {**given, "on": "entered"}
                if own in machine.chart.event_index:
                    event = machine.chart.events[machine.chart.event_index[own]]
                    yield {**given, "on": "event" if is_received(event) else "sent"}

    def _set(
        self,
        group: str,
        reason: str,
        breaks: Iterable[Mapping[str, Any]],
        wanted: RequestedBreakpoint,
        title: str = "",
    ) -> dict[str, Any]:
        """Set breakpoints of the hub; one that any machine accepts is verified."""
        number, self._next = self._next, self._next + 1
        refused: list[str] = []
        is_set = False
        for given in breaks:
            try:
                more = {**counting(wanted.hit_condition), "if": wanted.condition or ""}
                hub = self.face.do("break", **given, **more, log=wanted.log_message or "")
            except FsmkitError as error:
                refused.append(_words(error))
                continue
            is_set = True
            self._own.setdefault(group, []).append(hub)
            name = given["what"] if given["on"] == "property" else title
            self._of[hub] = Stop(number, reason, name)
        if refused and not is_set:
            return {"id": number, "verified": False, "message": refused[0]}
        return {"id": number, "verified": True}

    def _rejected_breakpoint(self, message: str) -> dict[str, Any]:
        self._next += 1
        return {"id": self._next - 1, "verified": False, "message": message}

    def _clear(self, group: str) -> None:
        for number in self._own.pop(group, ()):
            self._of.pop(number, None)
            try:
                self.face.do("unbreak", number=number)
            except FsmkitError:  # another client removed it
                continue


def counting(hits: str | None) -> dict[str, int]:
    """Return how a breakpoint counts: ``3``, ``>= 3``, ``> 2``, ``== 3``, ``<= 3``, ``% 10``."""
    if not (hits or "").strip():
        return {}
    found = HITS.fullmatch(hits or "")
    sign, number = ("", 0) if found is None else (found[1], int(found[2]))
    match sign:
        case "" | ">=" if number > 0:
            return {"after": number - 1}
        case ">" if found:
            return {"after": number}
        case "==" | "=" if number > 0:
            return {"after": number - 1, "times": 1}
        case "<=" if number > 0:
            return {"times": number}
        case "<" if number > 1:
            return {"times": number - 1}
        case "%" if number > 0:
            return {"after": number - 1, "every": number}
        case _:
            raise wrong(
                f"`{hits}` counts no hits", "write a number, or one behind >=, >, ==, <=, < or %"
            )


def data_id(machine: str, expression: str) -> str:
    """Return the name of a value that can be watched for changes."""
    return json.dumps([machine, expression])


def read_data_id(text: str) -> tuple[str, str]:
    """Return the machine and the expression of a name created by `data_id`."""
    try:
        machine, expression = msgspec.json.decode(text, type=tuple[str, str])
    except (ValueError, RecursionError) as error:
        raise wrong("this names no value", "ask for it with `dataBreakpointInfo`") from error
    return machine, expression


def _words(error: FsmkitError) -> str:
    first = error.diagnostics[0]
    return f"{first.message}; {first.help}" if first.help else first.message
