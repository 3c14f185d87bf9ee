"""Name the parts of a network in a notation with variables, and express its conditions in them.

The local state of a machine is a variable for each component. Constants of machines hold a double
underscore, so that all names are distinct.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator
from typing import assert_never

from fsmkit.export.changes import Change, Joint
from fsmkit.export.components import Parts
from fsmkit.export.formula import All, Any, Constant, Formula, In, Not, QueueEmpty
from fsmkit.export.identifiers import Names, word
from fsmkit.export.network import Move, Network
from fsmkit.export.terms import (
    Json,
    binary,
    call,
    choice,
    conjunction,
    differ,
    disjunction,
    equal,
    negation,
    total,
)
from fsmkit.verify.statespace.actions import Action
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT

MONITORS_WAIT, PLANT_WAITS, CALM, FEW_WAIT = "monitors_wait", "plant_waits", "calm", "few_wait"
"""Functions that say who may move: monitors see everything first, then the environment answers."""


class Vocabulary(ABC):
    """Base of a notation, which defines the names of components and the reading of queues."""

    def __init__(self, network: Network) -> None:
        """Split local states into components, and choose names."""
        self.network = network
        self.parts = Parts(network)
        self.names = Names()
        self.machines = tuple(self.names.take(automaton.name) for automaton in network.automata)
        self.fields = tuple(
            tuple(map(Names().take, (self.field(component.name) for component in components)))
            for components in self.parts.components
        )

    def field(self, name: str) -> str:
        """Return the name of a component among those of its machine."""
        return word(name)

    @abstractmethod
    def component(self, machine: int, component: int) -> str:
        """Return the variable of a component of the local state."""

    @abstractmethod
    def is_empty(self, machine: int) -> Json:
        """Return the test for an empty queue beside a machine."""

    @abstractmethod
    def is_first(self, machine: int, message: int) -> Json:
        """Return the test for a message at the head of the queue beside a machine."""

    @abstractmethod
    def counts(self, machine: int) -> Iterable[Json]:
        """Return numbers whose sum is the number of events in the queue beside a machine."""

    # --- constants -------------------------------------------------------------------------------

    def value(self, machine: int, component: int, number: int) -> Json:
        """Return the constant of a value, or the value."""
        found = self.parts.components[machine][component]
        if found.plain:
            return number
        return f"{self.machines[machine]}__{self.fields[machine][component]}__{found.words[number]}"

    def constants(self, machine: int) -> Iterator[tuple[str, int, str]]:
        """Yield the constants of the values of components: name, number, and a note or nothing."""
        for part, component in enumerate(self.parts.components[machine]):
            for number in () if component.plain else component.texts:
                yield str(self.value(machine, part, number)), number, component.note(number)

    def message(self, machine: int, number: int) -> str:
        """Return the constant of a message."""
        arrival = self.network.automata[machine].arrivals[number]
        return f"to_{self.machines[machine]}__{arrival.name}"

    def becomes(self, machine: int, change: Change) -> dict[str, Json]:
        """Return the assignments of values to components."""
        return {
            self.component(machine, component): self.value(machine, component, number)
            for component, number in change.items()
        }

    # --- tests -----------------------------------------------------------------------------------

    def is_in(self, machine: int, locals_: Collection[int]) -> Json:
        """Return the test for one of some local states."""
        cubes = self.parts.cover(machine, locals_)
        if cubes is None:
            return True
        return disjunction(
            conjunction(self.has(machine, component, values) for component, values in cube.items())
            for cube in cubes
        )

    def has(self, machine: int, component: int, values: Collection[int]) -> Json:
        """Return the test for one of some existing values of a component."""
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
        """Return the test for an event that waits for the machine."""
        automaton = self.network.automata[machine]
        if automaton.queue:
            return negation(self.is_empty(machine))
        return self.is_in(machine, automaton.where(lambda local: local.waiting > 0))

    def formula(self, formula: Formula) -> Json:
        """Return a condition."""
        match formula:
            case Constant(value):
                return value
            case In(machine, locals_):
                return self.is_in(machine, locals_)
            case QueueEmpty(machine):
                return self.is_empty(machine)
            case Not(part):
                return negation(self.formula(part))
            case All(parts):
                return conjunction(map(self.formula, parts))
            case Any(parts):
                return disjunction(map(self.formula, parts))
            case _:
                assert_never(formula)

    # --- priorities ------------------------------------------------------------------------------

    def rules(self) -> dict[str, Json]:
        """Return the functions for priorities, and for few waiting events."""
        network = self.network
        return {
            MONITORS_WAIT: disjunction(map(self.waits, network.monitors)),
            PLANT_WAITS: disjunction(map(self.waits, network.plant)),
            CALM: conjunction((negation(call(MONITORS_WAIT)), negation(call(PLANT_WAITS)))),
            FEW_WAIT: binary("≤", total(self._waiting()), MAX_PENDING_BEFORE_INPUT),
        }

    def _waiting(self) -> Iterator[Json]:
        for machine, automaton in enumerate(self.network.automata):
            if automaton.queue:
                yield from self.counts(machine)
            for waiting, of in automaton.waiting():
                yield choice(self.is_in(machine, of), waiting, 0)

    def guard(self, machine: int, joint: Joint) -> Json:
        """Return the guard of moves that differ only in their local states."""
        move = joint.moves[0]
        parts = [self.is_in(machine, joint.sources), self._turn(machine, move)]
        if move.taken is not None:
            parts.append(self.is_first(machine, move.taken))
        elif move.needs_empty and self.network.automata[machine].queue:
            parts.append(self.is_empty(machine))
        if move.from_outside:
            parts.append(call(FEW_WAIT))
        return conjunction(parts)

    def _turn(self, machine: int, move: Move) -> Json:
        """Return whether the machine may move (see `rules`)."""
        automaton, takes = self.network.automata[machine], move.action is Action.TAKE
        waits = self.waits(machine)
        if automaton.is_monitor and waits is not False:
            return True if takes else disjunction((call(CALM), waits))
        if automaton.is_environment and waits is not False:
            answers = negation(call(MONITORS_WAIT))
            if takes:
                return answers
            if move.action is Action.EVENTLESS:
                return disjunction((call(CALM), conjunction((answers, waits))))
        return call(CALM)

    def time_passes(self) -> Json:
        """Return whether time passes: a timer is armed, and no work is left."""
        armed: list[Json] = []
        still: list[Json] = []
        for machine, automaton in enumerate(self.network.automata):
            armed.append(self.is_in(machine, automaton.where(lambda local: local.awaited)))
            still += [self.is_empty(machine)] if automaton.queue else []
            still.append(self.is_in(machine, automaton.where(lambda local: not local.has_work)))
        return conjunction((disjunction(armed), *still))
