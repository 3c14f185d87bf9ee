"""Model bounded queues as arrays: an event's number at each index, 0 if free.

The first event has index 0, so that equal queues are equal states. The fields of an event are
beside its number, the n-th in the n-th lane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fsmkit.export.uppaal.network import Declared, Function, Sort


@dataclass(frozen=True, slots=True)
class Queue:
    """The queue of a machine. ``lanes``: name, minimum and maximum of each.

    ``stopped`` is the variable that shows that the machine has stopped, if it ever does.
    """

    machine: str
    length: str
    events: str
    lanes: tuple[tuple[str, int, int], ...]
    overflow: str
    capacity: int
    numbers: dict[int, str]
    """The constant of each event that it can hold."""
    push_name: str
    pop_name: str
    look_name: str
    stopped: str = ""
    look: str = ""
    """Of a monitor that looks at its inputs: the constant of the event that makes it do so."""

    def declared(self) -> list[Declared]:
        """Return the variables."""
        found = [
            Declared(name, Sort.INT, n, n, init=(n,), constant=True)
            for n, name in enumerate(self.numbers.values(), 1)
        ]
        found.append(
            Declared(
                self.length, Sort.INT, 0, self.capacity, init=(0,), comment=f"queue: {self.machine}"
            )
        )
        free = (0,) * self.capacity
        found.append(Declared(self.events, Sort.INT, 0, len(self.numbers), self.capacity, free))
        for name, lo, hi in self.lanes:
            found.append(Declared(name, Sort.INT, min(lo, 0), max(hi, 0), self.capacity, free))
        found.append(Declared(self.overflow, Sort.BOOL, init=(0,)))
        if self.stopped:
            found.append(Declared(self.stopped, Sort.BOOL, init=(0,)))
        return found

    @property
    def _arrays(self) -> list[str]:
        return [*(name for name, _, _ in self.lanes), self.events]

    def functions(self) -> list[Function]:
        """Return the functions of the readable form: the updates of the flat one."""
        values = [f"value_{n}" for n, _ in enumerate(self.lanes, 1)]
        kinds = (f"int[{min(lo, 0)},{max(hi, 0)}]" for _, lo, hi in self.lanes)
        parameters = [f"{kind} {value}" for kind, value in zip(kinds, values, strict=True)]
        push = ", ".join([f"int[1,{len(self.numbers)}] event", *parameters])
        found = [
            _function(self.push_name, push, self._pushed("event", values)),
            _function(self.pop_name, "", self.pop(flat=True)),
        ]
        looked = self.insert_sampling("changed", flat=True)
        return [*found, _function(self.look_name, "bool changed", looked)] if self.look else found

    # --- updates ---------------------------------------------------------------------------------

    def push(self, event: int, values: Sequence[str], *, flat: bool) -> list[str]:
        """Return the updates that append an event; a full queue drops it and records that."""
        given = [*values, *["0"] * (len(self.lanes) - len(values))]
        if not flat:
            return [f"{self.push_name}({', '.join([self.numbers[event], *given])})"]
        return self._pushed(self.numbers[event], given)

    def _pushed(self, event: str, values: Sequence[str]) -> list[str]:
        runs = f"!{self.stopped} && " if self.stopped else ""
        room = f"{runs}{self.length} < {self.capacity}"
        last = self.capacity - 1
        at = f"({self.length} < {self.capacity} ? {self.length} : {last})"
        full = f"({runs}{self.length} == {self.capacity})"
        found = [f"{self.overflow} = {self.overflow} || {full}"]
        for name, value in zip(self._arrays, [*values, event], strict=True):
            found.append(f"{name}[{at}] = {room} ? {value} : {name}[{at}]")
        return [*found, f"{self.length} = {room} ? {self.length} + 1 : {self.length}"]

    def pop(self, *, flat: bool) -> list[str]:
        """Return the updates that remove the first event."""
        if not flat:
            return [f"{self.pop_name}()"]
        found = []
        for name in self._arrays:
            found += [f"{name}[{n}] = {name}[{n + 1}]" for n in range(self.capacity - 1)]
            found.append(f"{name}[{self.capacity - 1}] = 0")
        return [*found, f"{self.length} = {self.length} - 1"]

    def insert_sampling(self, changed: str, *, flat: bool) -> list[str]:
        """Return the updates that insert the sampling event first, if it is not there."""
        if not flat:
            return [f"{self.look_name}({changed})"]
        runs = f"!{self.stopped} && " if self.stopped else ""
        looks = f"{runs}{self.events}[0] != {self.look} && ({changed})"
        full = f"{self.length} == {self.capacity}"
        room = f"{looks} && {self.length} < {self.capacity}"
        found = [
            f"{self.overflow} = {self.overflow} || ({looks} && {full})",
            f"{self.length} = {room} ? {self.length} + 1 : {self.length}",
        ]
        for name in self._arrays:
            found += [
                f"{name}[{n}] = {looks} ? {name}[{n - 1}] : {name}[{n}]"
                for n in range(self.capacity - 1, 0, -1)
            ]
            first = self.look if name == self.events else "0"
            found.append(f"{name}[0] = {looks} ? {first} : {name}[0]")
        return found

    def clear(self) -> list[str]:
        """Return the updates that empty the queue of a machine that stops."""
        found = [f"{name}[{n}] = 0" for name in self._arrays for n in range(self.capacity)]
        return [*found, f"{self.length} = 0"]


def _function(name: str, parameters: str, updates: list[str]) -> Function:
    body = "".join(f"  {update};\n" for update in updates)
    return Function(name, f"void {name}({parameters}) {{\n{body}}}")
