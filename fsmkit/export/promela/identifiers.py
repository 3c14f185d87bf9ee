"""Spellings: variables, constants and tests of local states in Promela.

Constants hold a double underscore, which no other name does; what is made from machines ends in
``_at``, ``_queue`` and the like, so that no name is a reserved word.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import assert_never

from fsmkit.codegen.c.reserved import KEYWORDS
from fsmkit.export.components import Component
from fsmkit.export.cubes import Cube
from fsmkit.export.formula import All, Any, Constant, Formula, In, Not, QueueEmpty
from fsmkit.export.local_states import word
from fsmkit.export.names import identifiers
from fsmkit.export.network import Network
from fsmkit.export.parts import Parts
from fsmkit.system.properties.property import Property

WORDS = KEYWORDS | {
    *("active", "always", "assert", "atomic", "bit", "bool", "byte", "chan", "d_proctype"),
    *("d_step", "empty", "enabled", "eval", "eventually", "false", "fi", "full", "get_priority"),
    *("hidden", "implies", "init", "inline", "len", "local", "ltl", "mtype", "nempty", "never"),
    *("nfull", "notrace", "np_", "od", "of", "pc_value", "pid", "printf", "printm", "priority"),
    *("proctype", "provided", "run", "select", "set_priority", "show", "skip", "stronguntil"),
    *("timeout", "trace", "true", "typedef", "unless", "until", "weakuntil", "xr", "xs"),
}
"""What no field is called: words of Promela, and of C, in which SPIN writes its verifier."""
MACROS = (
    *("CALM", "FAULT", "FEW_WAIT", "MONITORS_WAIT", "NO_ROOM", "PLANT_WAITS", "QUEUES"),
    *("bad_", "begins_", "goal_"),
)
"""How names of macros begin, which would stand for something else in a field."""


OWN = ("_at", "_local", "_machine", "_queue")
"""How names end that are made from machines."""


def claims(properties: Iterable[Property]) -> tuple[str, ...]:
    """Return for each property the name of its claim, by which SPIN is asked for it."""

    def claim(name: str) -> str:
        base = word(name)
        is_taken = base in WORDS or base == "started"
        is_taken = is_taken or base.startswith(MACROS) or base.endswith(OWN)
        return f"{base}_holds" if is_taken else base

    return identifiers(claim(property_.name) for property_ in properties)


class Spelling:
    """The names of a network."""

    def __init__(self, network: Network) -> None:
        """Take local states apart, and choose names."""
        self.network = network
        self.machines = identifiers(automaton.name for automaton in network.automata)
        self.parts = Parts(network)
        self._fields = tuple(identifiers(map(_field, c)) for c in self.parts.components)

    def at(self, machine: int) -> str:
        """Return the variable that holds the local state."""
        return f"{self.machines[machine]}_at"

    def field(self, machine: int, component: int) -> str:
        """Return the name of a component in the type of local states."""
        return self._fields[machine][component]

    def component(self, machine: int, component: int) -> str:
        """Return the variable that holds a component of the local state."""
        return f"{self.at(machine)}.{self.field(machine, component)}"

    def value(self, machine: int, component: int, number: int) -> str:
        """Return the constant of a value, or the value."""
        what = self.parts.components[machine][component]
        if what.plain:
            return what.words[number]
        field = self.field(machine, component)
        return f"{self.machines[machine]}__{field}__{what.words[number]}"

    def becomes(self, machine: int, change: Mapping[int, int]) -> Iterator[str]:
        """Yield the assignments that give components their values."""
        for component, number in change.items():
            name = self.component(machine, component)
            yield f"{name} = {self.value(machine, component, number)}"

    def queue(self, machine: int) -> str:
        """Return the channel."""
        return f"{self.machines[machine]}_queue"

    def message(self, machine: int, number: int) -> str:
        """Return the constant of a message, or the name of what a value does."""
        return (
            f"to_{self.machines[machine]}__{self.network.automata[machine].arrivals[number].name}"
        )

    def is_in(self, machine: int, locals_: Collection[int]) -> str:
        """Return whether the machine is in one of some local states."""
        cubes = self.parts.cover(machine, locals_)
        if cubes is None:
            return "true"
        return f"({' || '.join(self._cube(machine, cube) for cube in cubes)})" if cubes else "false"

    def _cube(self, machine: int, cube: Cube) -> str:
        tests = (self.has(machine, component, values) for component, values in cube.items())
        return _joined(list(tests), "&&")

    def has(self, machine: int, component: int, values: Collection[int]) -> str:
        """Return whether a component has one of some values; of those that there are."""
        name = self.component(machine, component)
        if self.parts.components[machine][component].is_truth:
            return name if 1 in values else f"!{name}"
        excluded = self.parts.excluded(machine, component, values)
        if excluded is not None:
            return f"{name} != {self.value(machine, component, excluded)}"
        tests = []
        for run in self.parts.runs(machine, component, values):
            first, last = (self.value(machine, component, number) for number in run)
            alone = run[0] == run[1]
            tests.append(
                f"{name} == {first}" if alone else f"({first} <= {name} && {name} <= {last})"
            )
        return _joined(tests, "||")

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


def _field(component: Component) -> str:
    name = word(component.name)
    return f"{name}_value" if name in WORDS or name.startswith(MACROS) else name


def _joined(tests: list[str], operator: str) -> str:
    """Join tests by an operator, in parentheses if there are several."""
    return tests[0] if len(tests) == 1 else f"({f' {operator} '.join(tests)})"
