"""Names of variables, constants and functions in JANI, and tests of them.

The local state of a machine ``m`` is the variable ``m_at``; its queue the variables ``m_queue_1``
(the head), ``m_queue_2``, 0 where nothing waits. Constants and functions of machines hold a double
underscore, so that no two names are alike.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import assert_never

from fsmkit.verify.export.formula import All, Any, Constant, Formula, In, Not, QueueEmpty
from fsmkit.verify.export.jani.terms import Json, binary, conjunction, disjunction, equal, negated
from fsmkit.verify.export.local_states import ranges
from fsmkit.verify.export.names import identifiers
from fsmkit.verify.export.network import Automaton, Network

FEW = 3
"""So many local states are listed one by one."""

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

    def at(self, machine: int) -> str:
        """Return the variable that holds the local state."""
        return f"{self.machines[machine]}_at"

    def slots(self, machine: int) -> tuple[str, ...]:
        """Return the variables of the queue, its head first.

        There is one more than the explorer ever saw in use, if the queue is that long.
        """
        automaton = self.network.automata[machine]
        count = min(automaton.queue, 1 + max(map(len, automaton.contents)))
        return tuple(f"{self.machines[machine]}_queue_{n + 1}" for n in range(count))

    def local(self, machine: int, number: int) -> str:
        """Return the constant of a local state."""
        return f"{self.machines[machine]}__{self.network.automata[machine].locals[number].name}"

    def message(self, machine: int, number: int) -> str:
        """Return the constant of an event that can wait in a queue."""
        return f"to__{self.machines[machine]}__{self._arrival(machine, number)}"

    def after(self, machine: int, number: int) -> str:
        """Return the function from a local state to that after a message that is not queued."""
        return f"after__{self.machines[machine]}__{self._arrival(machine, number)}"

    def elapsed(self, machine: int) -> str:
        """Return the function from a local state to that after a unit of time."""
        return f"elapsed__{self.machines[machine]}"

    def _arrival(self, machine: int, number: int) -> str:
        return self.network.automata[machine].arrivals[number].name

    # --- tests -----------------------------------------------------------------------------------

    def is_in(self, machine: int, locals_: Collection[int], at: str = "") -> Json:
        """Return whether the machine, or what ``at`` holds, is one of some local states."""
        at = at or self.at(machine)
        if len(locals_) == len(self.network.automata[machine].locals):
            return True
        tests: list[Json] = []
        for first, last in ranges(locals_):
            if last - first < FEW:
                tests += (equal(at, self.local(machine, n)) for n in range(first, last + 1))
            else:
                ends = self.local(machine, first), self.local(machine, last)
                tests.append(conjunction((binary("≤", ends[0], at), binary("≤", at, ends[1]))))
        return disjunction(tests)

    def waits(self, machine: int) -> Json:
        """Return whether an event waits for the machine."""
        slots = self.slots(machine)
        if slots:
            return negated(equal(slots[0], 0))
        automaton = self.network.automata[machine]
        return self.is_in(machine, waiting_at(automaton))

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


def waiting_at(automaton: Automaton) -> set[int]:
    """Return the local states of which waiting events are part."""
    return {n for n, local in enumerate(automaton.locals) if local.waiting}
