"""Bounded queues as arrays: an event's number at each place, 0 at those that are free.

The first event stands at place 0, so that equal queues are equal states. The fields of an event
stand beside its number, the n-th in the n-th lane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fsmkit.export.uppaal.network import Declared, Function, Sort


@dataclass(frozen=True, slots=True)
class Queue:
    """The queue of a machine. ``lanes``: name, least and greatest value of each.

    ``stopped`` names what tells that the machine has stopped and takes nothing, if it ever does.
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

    # --- as functions ----------------------------------------------------------------------------

    def functions(self) -> list[Function]:
        """Return the functions that push and pop."""
        parameters = [f"int[1,{len(self.numbers)}] event"]
        parameters += [
            f"int[{min(lo, 0)},{max(hi, 0)}] value_{n}" for n, (_, lo, hi) in self._each()
        ]
        lines = [f"void {self.push_name}({', '.join(parameters)}) {{"]
        if self.stopped:
            lines.append(f"  if ({self.stopped}) return;")
        lines += [
            f"  if ({self.length} == {self.capacity}) {{",
            f"    {self.overflow} = true;",
            "  } else {",
            f"    {self.events}[{self.length}] = event;",
            *(f"    {name}[{self.length}] = value_{n};" for n, (name, _, _) in self._each()),
            f"    {self.length} = {self.length} + 1;",
            "  }",
            "}",
        ]
        push = Function(self.push_name, "\n".join(lines))
        last = self.capacity - 1
        arrays = [self.events, *(name for name, _, _ in self.lanes)]
        moved = [f"    {name}[i] = {name}[i + 1];" for name in arrays]
        pop = [f"void {self.pop_name}() {{"]
        if last > 0:
            pop += [f"  for (i : int[0,{last - 1}]) {{", *moved, "  }"]
        pop += [*(f"  {name}[{last}] = 0;" for name in arrays)]
        pop += [f"  {self.length} = {self.length} - 1;", "}"]
        found = [push, Function(self.pop_name, "\n".join(pop))]
        return [*found, self._look_function(arrays)] if self.look else found

    def _look_function(self, arrays: list[str]) -> Function:
        lines = [f"void {self.look_name}(bool changed) {{"]
        stopped = f" || {self.stopped}" if self.stopped else ""
        lines.append(f"  if (!changed || {self.events}[0] == {self.look}{stopped}) return;")
        lines.append(f"  if ({self.length} == {self.capacity}) {{")
        lines += [f"    {self.overflow} = true;", "  } else {"]
        lines += [f"    {self.length} = {self.length} + 1;", "  }"]
        if self.capacity > 1:
            lines.append(f"  for (i : int[1,{self.capacity - 1}]) {{")
            lines += [
                f"    {name}[{self.capacity} - i] = {name}[{self.capacity} - i - 1];"
                for name in arrays
            ]
            lines.append("  }")
        lines += [f"  {self.events}[0] = {self.look};"]
        lines += [f"  {name}[0] = 0;" for name in arrays[1:]]
        return Function(self.look_name, "\n".join([*lines, "}"]))

    def _each(self) -> list[tuple[int, tuple[str, int, int]]]:
        return list(enumerate(self.lanes, 1))

    # --- as updates ------------------------------------------------------------------------------

    def push(self, event: int, values: Sequence[str], *, flat: bool) -> list[str]:
        """Return the updates that append an event; a full queue drops it and notes so."""
        number = self.numbers[event]
        given = [*values, *["0"] * (len(self.lanes) - len(values))]
        if not flat:
            return [f"{self.push_name}({', '.join([number, *given])})"]
        runs = f"!{self.stopped} && " if self.stopped else ""
        room = f"{runs}{self.length} < {self.capacity}"
        last = self.capacity - 1
        at = f"({self.length} < {self.capacity} ? {self.length} : {last})"
        full = f"({runs}{self.length} == {self.capacity})"
        found = [f"{self.overflow} = {self.overflow} || {full}"]
        for name, value in [(self.events, number), *zip(self._names(), given, strict=True)]:
            found.append(f"{name}[{at}] = {room} ? {value} : {name}[{at}]")
        return [*found, f"{self.length} = {room} ? {self.length} + 1 : {self.length}"]

    def _names(self) -> list[str]:
        return [name for name, _, _ in self.lanes]

    def pop(self, *, flat: bool) -> list[str]:
        """Return the updates that take the first event away."""
        if not flat:
            return [f"{self.pop_name}()"]
        found = []
        for name in [self.events, *self._names()]:
            found += [f"{name}[{n}] = {name}[{n + 1}]" for n in range(self.capacity - 1)]
            found.append(f"{name}[{self.capacity - 1}] = 0")
        return [*found, f"{self.length} = {self.length} - 1"]

    def let_look(self, changed: str, *, flat: bool) -> list[str]:
        """Return the updates that put the event for looking first, if it is not there."""
        if not flat:
            return [f"{self.look_name}({changed})"]
        runs = f"!{self.stopped} && " if self.stopped else ""
        looks = f"{runs}{self.events}[0] != {self.look} && ({changed})"
        found = [
            f"{self.overflow} = {self.overflow} || ({looks} && {self.length} == {self.capacity})"
        ]
        found.append(
            f"{self.length} = {looks} && {self.length} < {self.capacity} "
            f"? {self.length} + 1 : {self.length}"
        )
        for name in [*self._names(), self.events]:
            found += [
                f"{name}[{n}] = {looks} ? {name}[{n - 1}] : {name}[{n}]"
                for n in range(self.capacity - 1, 0, -1)
            ]
            first = self.look if name == self.events else "0"
            found.append(f"{name}[0] = {looks} ? {first} : {name}[0]")
        return found

    def clear(self) -> list[str]:
        """Return the updates that empty the queue of a machine that stops."""
        places = range(self.capacity)
        found = [f"{name}[{n}] = 0" for name in [self.events, *self._names()] for n in places]
        return [*found, f"{self.length} = 0"]
