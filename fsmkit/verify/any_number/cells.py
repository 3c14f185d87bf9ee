"""Local states of neighbouring machines that do not depend on the number of machines.

A *cell* holds the local states of all machines at one position of a ring: one of each array, and
the machines that model their connections and free inputs. Steps are those of the explorer
(`statespace.global_steps`) in one system that is long enough. A machine's elements of a shared
array are numbered relative to its own position, so all machines in the middle have the same local
states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import fail
from fsmkit.language import ArrayType, Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.system import System
from fsmkit.verify.any_number.family import RULE, Family
from fsmkit.verify.statespace.actions import FAULT, FULL, Message, Outcome
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.global_steps import GlobalSteps

OWN, OTHER = -1, -2
"""Values of a shared number of a machine: the machine itself, and another one."""
MOST_STARTS = 64
"""Initial states that are tried."""


@dataclass(frozen=True, slots=True)
class Facts:
    """The facts about a cell that decide which steps are possible.

    ``answers``: a machine of the environment has to react first. ``stuck``: nothing happens in it
    again, except for events under ``may``.
    """

    waiting: int
    answers: bool
    busy: bool
    stuck: bool
    at_rest: bool


@dataclass(frozen=True, slots=True)
class Move:
    """A step of a machine of a cell.

    ``after``: its cell after the step. ``sent``: the messages to other cells, by their distance.
    ``is_open``: an external event. ``answers``: the machine has to react before others.
    ``marks``: the findings of the step, each with its machine.
    """

    after: int
    sent: tuple[tuple[int, tuple[Message, ...]], ...]
    is_open: bool
    answers: bool
    marks: tuple[tuple[int, int], ...]


class Numbers:
    """Numbers of local states and of cells, common to systems of different length."""

    def __init__(self) -> None:
        """Start without states."""
        self.locals: dict[tuple[int, Snapshot, object], int] = {}
        self.known: list[tuple[int, Snapshot, object]] = []
        self.cells: dict[tuple[int, ...], int] = {}
        self.contents: list[tuple[int, ...]] = []

    def local(self, key: tuple[int, Snapshot, object]) -> int:
        """Return the number of a local state."""
        number = self.locals.setdefault(key, len(self.known))
        if number == len(self.known):
            self.known.append(key)
        return number

    def cell(self, content: tuple[int, ...]) -> int:
        """Return the number of a cell."""
        number = self.cells.setdefault(content, len(self.contents))
        if number == len(self.contents):
            self.contents.append(content)
        return number


class Ring:
    """The cells of a system with a given number of positions."""

    def __init__(self, family: Family, closed: ClosedSystem, numbers: Numbers) -> None:
        """Assign the machines to positions. Raises `FsmkitError` if the system has no such form."""
        self.family, self.closed, self.numbers = family, closed, numbers
        self.steps = GlobalSteps(closed)
        machines = closed.system.machines
        at = position_of_machines(family, closed.system)
        self.length = 1 + max(at)
        self.position = at
        self.members: list[list[int]] = [[] for _ in range(self.length)]
        for number, position in enumerate(at):
            self.members[position].append(number)
        self.place = {m: n for members in self.members for n, m in enumerate(members)}
        self.environment = [machine.environment for machine in machines]
        self._sized = [self._sized_data(number) for number in range(len(machines))]
        self._ids = [self._id_data(number) for number in range(len(machines))]
        self.reach = self._reach()
        self._canonical: dict[tuple[int, int], int] = {}
        self._placed: dict[tuple[int, int], int] = {}
        self._moves: dict[tuple[int, int], tuple[Move, ...]] = {}
        self._facts: dict[tuple[int, int], Facts] = {}
        self._delivered: dict[tuple[int, int, tuple[Message, ...]], tuple[int, bool]] = {}

    def distance(self, start: int, end: int) -> int:
        """Return the distance between two positions, negative to the left."""
        half = self.length // 2
        return (end - start + half) % self.length - half

    def kind(self, position: int) -> int:
        """Return 0 for a position in the middle; other numbers for each position at an end."""
        position %= self.length
        if position < self.family.ends.low:
            return 1 + position
        if position >= self.length - self.family.ends.high:
            return position - self.length
        return 0

    def _reach(self) -> int:
        """Return the greatest distance between two machines that are connected."""
        system = self.closed.system
        pairs = {(link.source, link.target) for link in system.event_links}
        pairs |= {(link.source, link.target) for link in system.input_links}
        return max((abs(self._between(*pair)) for pair in pairs), default=0)

    def _between(self, source: int, target: int) -> int:
        return self.distance(self.position[source], self.position[target])

    def _sized_data(self, number: int) -> tuple[tuple[int, tuple[tuple[int, int], ...]], ...]:
        """Return the shared arrays of a machine: the data, and its elements by their distance."""
        machine = self.closed.system.machines[number]
        found: dict[int, list[tuple[int, int]]] = {}
        for slot in machine.shared:
            if slot.element is not None:
                chart_type = machine.chart.data[slot.data].type
                length = chart_type.length if isinstance(chart_type, ArrayType) else 0
                distance = slot.element - self.position[number]
                if length == self.length:
                    distance = self.distance(self.position[number], slot.element)
                found.setdefault(slot.data, []).append((distance, slot.element))
        return tuple((data, tuple(sorted(elements))) for data, elements in found.items())

    def _id_data(self, number: int) -> tuple[int, ...]:
        """Return the data of a machine that hold the number of a machine."""
        machine = self.closed.system.machines[number]
        return tuple(slot.data for slot in machine.shared if slot.name in self.family.ids)

    # --- local states ----------------------------------------------------------------------------

    def canonical(self, machine: int, local: int) -> int:
        """Return the number of a local state without the position of its machine."""
        key = (machine, local)
        known = self._canonical.get(key)
        if known is None:
            snapshot = self.steps.local_states[machine][local].snapshot
            data, held = list(snapshot.data), []
            for place, elements in self._sized[machine]:
                array = data[place]
                assert isinstance(array, tuple)  # noqa: S101  (an array)
                held.append((place, tuple((d, array[element]) for d, element in elements)))
                data[place] = ()
            for place in self._ids[machine]:
                data[place] = self._owner(machine, data[place])
            bare = replace(snapshot, data=tuple(data))
            number = self.numbers.local((self.place[machine], bare, tuple(held)))
            known = self._canonical[key] = number
            self._placed[machine, number] = local
        return known

    def _owner(self, machine: int, value: Value) -> Value:
        """Return a shared number of a machine as seen by a machine: none, `OWN` or `OTHER`."""
        assert isinstance(value, int)  # noqa: S101  (a number)
        if value < self.family.low:
            return value
        return OWN if value == self.position[machine] + self.family.low else OTHER

    def placed(self, machine: int, number: int, owner: int | None = None) -> int:
        """Return the local state of a machine with that number of `canonical`.

        ``owner``: the position whose number other machines hold.
        """
        if self._ids[machine]:
            return self._with_owner(machine, number, owner)
        known = self._placed.get((machine, number))
        if known is None:
            _, bare, held = self.numbers.known[number]
            data = list(bare.data)
            chart: Chart = self.closed.charts[machine]
            values = dict(held)  # type: ignore[call-overload]
            for place, elements in self._sized[machine]:
                array = list(chart.data[place].init.value)  # type: ignore[arg-type]
                own = dict(elements)
                for distance, value in values[place]:
                    array[own[distance]] = value
                data[place] = tuple(array)
            known = self.steps.intern(machine, replace(bare, data=tuple(data)))
            self._placed[machine, number] = known
            self._canonical[machine, known] = number
        return known

    def _with_owner(self, machine: int, number: int, owner: int | None) -> int:
        _, bare, _ = self.numbers.known[number]
        data = list(bare.data)
        for place in self._ids[machine]:
            if data[place] in (OWN, OTHER):
                at = self.position[machine] if data[place] == OWN else owner
                assert at is not None  # noqa: S101  (the caller's condition)
                data[place] = at + self.family.low
        return self.steps.intern(machine, replace(bare, data=tuple(data)))

    def owned(self, number: int) -> Value | None:
        """Return the value of the shared number of a machine in a canonical local state."""
        _, bare, _ = self.numbers.known[number]
        return next((bare.data[place] for place in self._ids[0]), None)

    def shared_values(self, number: int) -> tuple[Value, ...]:
        """Return the shared variables in a canonical local state, without whose number it is."""
        _, bare, _ = self.numbers.known[number]
        slots = (slot.data for slot in self.closed.system.machines[0].shared)
        return tuple(OTHER if bare.data[n] == OWN else bare.data[n] for n in slots)

    def private(self, number: int) -> tuple[int, Snapshot]:
        """Return a canonical local state without shared variables."""
        place, bare, _ = self.numbers.known[number]
        shared = {slot.data for slot in self.closed.system.machines[0].shared}
        data = tuple(0 if n in shared else value for n, value in enumerate(bare.data))
        return place, replace(bare, data=data)

    def cell(self, position: int, state: Sequence[int]) -> int:
        """Return the cell at a position of a global state."""
        members = self.members[position % self.length]
        return self.numbers.cell(tuple(self.canonical(m, state[m]) for m in members))

    def locals_of(self, position: int, cell: int) -> dict[int, int]:
        """Return the local states of the machines at a position, by machine."""
        members = self.members[position % self.length]
        content = self.numbers.contents[cell]
        return {m: self.placed(m, number) for m, number in zip(members, content, strict=True)}

    def snapshots(self, start: int, cells: Sequence[int]) -> dict[int, Snapshot]:
        """Return the machines of consecutive cells from a position on."""
        return {
            machine: self.steps.local_states[machine][local].snapshot
            for n, cell in enumerate(cells)
            for machine, local in self.locals_of(start + n, cell).items()
        }

    def _cell_of(self, position: int, held: dict[int, int]) -> int:
        members = self.members[position % self.length]
        return self.numbers.cell(tuple(self.canonical(m, held[m]) for m in members))

    # --- steps -----------------------------------------------------------------------------------

    def facts(self, position: int, cell: int) -> Facts:
        """Return the facts about a cell."""
        position %= self.length
        known = self._facts.get((position, cell))
        if known is None:
            found, answers = [], False
            for machine, local in self.locals_of(position, cell).items():
                self.steps.own_steps(machine, local)
                self.steps.open_steps(machine, local)
                state = self.steps.local_states[machine][local]
                found.append(state)
                answers |= self.environment[machine] and state.view.waiting > 0
            known = Facts(
                sum(state.view.waiting for state in found),
                answers,
                any(state.busy for state in found),
                not any(
                    state.view.waiting
                    or state.view.awaited
                    or state.view.faulted
                    or state.busy
                    or state.fair
                    for state in found
                ),
                all(state.view.at_rest for state in found),
            )
            self._facts[position, cell] = known
        return known

    def moves(self, position: int, cell: int) -> tuple[Move, ...]:
        """Return the steps of the machines at a position."""
        position %= self.length
        known = self._moves.get((position, cell))
        if known is None:
            found: list[Move] = []
            held = self.locals_of(position, cell)
            for machine, local in held.items():
                waits = self.steps.local_states[machine][local].view.waiting > 0
                answers = self.environment[machine] and waits
                found += [
                    self._move(position, held, machine, outcome, answers=answers)
                    for outcome in self.steps.own_steps(machine, local)
                ]
                for outcome in self.steps.open_steps(machine, local):
                    move = self._move(position, held, machine, outcome, answers=answers)
                    found.append(replace(move, is_open=True))
            known = self._moves[position, cell] = tuple(found)
        return known

    def _move(
        self, position: int, held: dict[int, int], machine: int, outcome: Outcome, *, answers: bool
    ) -> Move:
        own = {**held, machine: self.steps.intern(machine, outcome.after)}
        marks = [(machine, note) for note in outcome.notes if note in (FULL, FAULT)]
        sent: dict[int, list[Message]] = {}
        for message in outcome.messages:
            target = message.target
            if target in own:
                own[target], is_full = self.steps.delivered(target, own[target], message)
                marks += [(target, FULL)] if is_full else []
            else:
                sent.setdefault(self._between(machine, target), []).append(message)
        by_distance = tuple((d, tuple(messages)) for d, messages in sorted(sent.items()))
        after = self._cell_of(position, own)
        return Move(after, by_distance, is_open=False, answers=answers, marks=tuple(marks))

    def deliver(self, position: int, cell: int, messages: tuple[Message, ...]) -> tuple[int, bool]:
        """Return a cell after messages, and whether a queue was full."""
        position %= self.length
        key = (position, cell, messages)
        known = self._delivered.get(key)
        if known is None:
            held, overflows = self.locals_of(position, cell), False
            for message in messages:
                target = message.target
                held[target], is_full = self.steps.delivered(target, held[target], message)
                overflows |= is_full
            known = self._delivered[key] = (self._cell_of(position, held), overflows)
        return known

    def elapsed(self, position: int, cell: int) -> int:
        """Return a cell after a unit of time."""
        held = self.locals_of(position, cell)
        return self._cell_of(position, {m: self.steps.elapsed(m, n) for m, n in held.items()})

    def initial(self) -> list[tuple[int, ...]]:
        """Return the initial states as cells, all positions in order. Raises `FsmkitError`."""
        found: dict[tuple[int, ...], None] = {}
        wrong = {first + note for first in self.closed.first_marks for note in (FULL, FAULT)}
        for edge in self.steps.initial():
            if wrong.intersection(edge.marks):
                raise fail(RULE, "a queue overflows or a machine faults when the machines start")
            found[tuple(self.cell(p, edge.to) for p in range(self.length))] = None
            if len(found) > MOST_STARTS:
                raise fail(
                    RULE,
                    f"the system has more than {MOST_STARTS} initial states",
                    help="give start values, or a number of machines",
                )
        return list(found)


def position_of_machines(family: Family, system: System) -> list[int]:
    """Return the position of each machine. Raises `FsmkitError` if one has none."""
    found: list[int | None] = [None] * len(system.machines)
    for number, machine in enumerate(system.machines):
        if machine.place is not None and machine.place[0] in family.arrays:
            found[number] = machine.place[1] - family.low
    for number, machine in enumerate(system.machines):
        if machine.drives is not None:
            found[number] = found[machine.drives.machine]
        elif machine.is_channel:
            sources = [link.source for link in system.event_links if link.target == number]
            found[number] = found[sources[0]]
    for number, machine in enumerate(system.machines):
        if found[number] is None:
            raise fail(
                RULE,
                f"`{machine.name}` is neither in an array over `{family.parameter}` nor a "
                "connection of one",
                machine.span,
                help="make it part of the machines of the array, or give a number of machines",
            )
    return [position for position in found if position is not None]
