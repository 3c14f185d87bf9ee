"""Names of variables, constants and functions in JANI, and tests of them.

The local state of a machine ``m`` is a variable for each component, ``m_at_state`` and so on; its
queue the variables ``m_queue_1`` (the head), ``m_queue_2``, 0 where nothing waits. Constants of
machines hold a double underscore, so that no two names are alike.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import assert_never

from fsmkit.export.changes import Change
from fsmkit.export.formula import All, Any, Constant, Formula, In, Not, QueueEmpty
from fsmkit.export.jani.terms import Json, binary, conjunction, differ, disjunction, equal, negated
from fsmkit.export.local_states import word
from fsmkit.export.names import identifiers
from fsmkit.export.network import Network
from fsmkit.export.parts import Parts

UNFORESEEN = "unforeseen"
"""The variable that tells that something happened which the explorer never saw."""


class Spelling:
    """The names of a network."""

    def __init__(self, network: Network) -> None:
        """Choose names for the machines."""
        self.network = network
        names = [automaton.name for automaton in network.automata]
        *machines, self.clock = identifiers([*names, "clock"])
        self.machines = tuple(machines)
        self.parts = Parts(network)
        self._fields = tuple(
            identifiers(word(component.name) for component in components)
            for components in self.parts.components
        )

    def component(self, machine: int, component: int) -> str:
        """Return the variable that holds a component of the local state."""
        return f"{self.machines[machine]}_at_{self._fields[machine][component]}"

    def value(self, machine: int, component: int, number: int) -> Json:
        """Return the constant of a value, or the value."""
        plain = self.parts.components[machine][component].plain
        return number if plain else self.constant(machine, component, number)

    def constant(self, machine: int, component: int, number: int) -> str:
        """Return the constant of a value."""
        text = self.parts.components[machine][component].words[number]
        return f"{self.machines[machine]}__{self._fields[machine][component]}__{text}"

    def becomes(self, machine: int, change: Change) -> dict[str, Json]:
        """Return the assignments that give components their values."""
        return {
            self.component(machine, component): self.value(machine, component, number)
            for component, number in change.items()
        }

    def slots(self, machine: int) -> tuple[str, ...]:
        """Return the variables of the queue, its head first.

        There is one more than the explorer ever saw in use, if the queue is that long.
        """
        automaton = self.network.automata[machine]
        count = min(automaton.queue, 1 + max(map(len, automaton.contents)))
        return tuple(f"{self.machines[machine]}_queue_{n + 1}" for n in range(count))

    def message(self, machine: int, number: int) -> str:
        """Return the constant of an event that can wait in a queue."""
        return f"to_{self.machines[machine]}__{self._arrival(machine, number)}"

    def _arrival(self, machine: int, number: int) -> str:
        return self.network.automata[machine].arrivals[number].name

    # --- tests -----------------------------------------------------------------------------------

    def is_in(self, machine: int, locals_: Collection[int]) -> Json:
        """Return whether the machine is in one of some local states."""
        cubes = self.parts.cover(machine, locals_)
        if cubes is None:
            return True
        return disjunction(
            conjunction(self.has(machine, component, values) for component, values in cube.items())
            for cube in cubes
        )

    def has(self, machine: int, component: int, values: Collection[int]) -> Json:
        """Return whether a component has one of some values; of those that there are."""
        name = self.component(machine, component)
        excluded = self.parts.excluded(machine, component, values)
        if excluded is not None:
            return differ(name, self.value(machine, component, excluded))
        tests: list[Json] = []
        for run in self.parts.runs(machine, component, values):
            first, last = (self.value(machine, component, number) for number in run)
            between = conjunction((binary("≤", first, name), binary("≤", name, last)))
            tests.append(equal(name, first) if run[0] == run[1] else between)
        return disjunction(tests)

    def waits(self, machine: int) -> Json:
        """Return whether an event waits for the machine."""
        slots = self.slots(machine)
        if slots:
            return negated(equal(slots[0], 0))
        automaton = self.network.automata[machine]
        return self.is_in(machine, automaton.where(lambda local: local.waiting > 0))

    def formula(self, formula: Formula) -> Json:
        """Return a condition."""
        match formula:
            case Constant(value):
                return value
            case In(machine, locals_):
                return self.is_in(machine, locals_)
            case QueueEmpty(machine):
                return negated(self.waits(machine))
            case Not(part):
                return negated(self.formula(part))
            case All(parts):
                return conjunction(map(self.formula, parts))
            case Any(parts):
                return disjunction(map(self.formula, parts))
            case _:
                assert_never(formula)
