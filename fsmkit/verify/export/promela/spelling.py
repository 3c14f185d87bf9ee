"""Spellings: variables, constants and tests of local states in Promela.

Constants hold a double underscore, which no other name does; what is made from machines ends in
``_at``, ``_queue`` and the like, so that no name is a reserved word.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import assert_never

from fsmkit.verify.export.formula import All, Any, Constant, Formula, In, Not, QueueEmpty
from fsmkit.verify.export.local_states import ranges
from fsmkit.verify.export.names import identifiers
from fsmkit.verify.export.network import Network

FEW = 3
"""So many local states are listed one by one."""


class Spelling:
    """The names of a network."""

    def __init__(self, network: Network) -> None:
        """Choose names for the machines."""
        self.network = network
        self.machines = identifiers(automaton.name for automaton in network.automata)

    def at(self, machine: int) -> str:
        """Return the variable that holds the local state."""
        return f"{self.machines[machine]}_at"

    def queue(self, machine: int) -> str:
        """Return the channel."""
        return f"{self.machines[machine]}_queue"

    def local(self, machine: int, number: int) -> str:
        """Return the constant of a local state."""
        return f"{self.machines[machine]}__{self.network.automata[machine].locals[number].name}"

    def message(self, machine: int, number: int) -> str:
        """Return the constant of a message, or the name of what a value does."""
        return (
            f"to_{self.machines[machine]}__{self.network.automata[machine].arrivals[number].name}"
        )

    def is_in(self, machine: int, locals_: Collection[int]) -> str:
        """Return whether the machine is in one of some local states."""
        at = self.at(machine)
        if len(locals_) == len(self.network.automata[machine].locals):
            return "true"
        tests = []
        for first, last in ranges(locals_):
            if last - first < FEW:
                each = (f"{at} == {self.local(machine, n)}" for n in range(first, last + 1))
                tests.append(" || ".join(each))
            else:
                ends = self.local(machine, first), self.local(machine, last)
                tests.append(f"({ends[0]} <= {at} && {at} <= {ends[1]})")
        return f"({' || '.join(tests)})" if tests else "false"

    def formula(self, formula: Formula) -> str:
        """Return a condition, in parentheses."""
        match formula:
            case Constant(value):
                return "true" if value else "false"
            case In(machine, locals_):
                return self.is_in(machine, locals_)
            case QueueEmpty(machine):
                return f"(len({self.queue(machine)}) == 0)"
            case Not(part):
                return f"!{self.formula(part)}"
            case All(parts):
                return f"({' && '.join(map(self.formula, parts))})"
            case Any(parts):
                return f"({' || '.join(map(self.formula, parts))})"
            case _:
                assert_never(formula)
