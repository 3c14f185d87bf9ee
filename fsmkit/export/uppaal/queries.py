"""Properties as queries; those that UPPAAL cannot be asked are told as remarks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fsmkit.diagnostics import FsmkitError
from fsmkit.export.uppaal.automaton import is_silent
from fsmkit.export.uppaal.entries import Key
from fsmkit.export.uppaal.machine import Builder
from fsmkit.export.uppaal.network import Query
from fsmkit.export.uppaal.printing import Printer
from fsmkit.export.uppaal.space import Space
from fsmkit.export.uppaal.terms import both, denied, safety
from fsmkit.language import Expr, Fragment, InState, Variable
from fsmkit.system.properties.property import (
    Atom,
    AtStates,
    Builtin,
    Condition,
    OverGraph,
    Property,
)
from fsmkit.system.readiness import resting

MANY = 6
"""A state that is active in more locations is asked for by a variable of its own."""
UNFAIR = (
    "UPPAAL knows no fairness: what it proves holds, but what it refutes may hold in all fair runs"
)
UNASKED = {
    "livelock_free": "UPPAAL cannot be asked for cycles in which no time passes",
    "recoverable": "UPPAAL does not nest path quantifiers (AG EF)",
    "within": "it needs a clock that runs from one condition to the other: write a monitor",
}


@dataclass(slots=True)
class Queries:
    """Makes the queries of a network."""

    space: Space
    builders: list[Builder]
    has_steps: bool
    """Whether states between two steps exist, which are not judged."""

    def made(self) -> Iterator[Query]:
        """Yield the queries of all properties, and one for each queue."""
        for property_ in self.space.closed.system.properties:
            yield self._of(property_)
        for queue in self.space.queues.values():
            yield Query(f"A[] !{queue.overflow}", f"the queue of {queue.machine} is long enough")

    def _of(self, property_: Property) -> Query:
        name = property_.name
        if property_.is_of_steps:
            return Query("", f"{name}: not asked: `occurs` is judged at steps, not at states")
        try:
            return self._asked(property_) or Query(
                "", f"{name} ({property_.text}): not asked: {_unasked(property_)}"
            )
        except FsmkitError as error:
            return Query("", f"{name}: not asked: {error.diagnostics[0].message}")

    def _asked(self, property_: Property) -> Query | None:
        """Return the query of a property; None where UPPAAL has none of its kind."""
        comment = f"{property_.name}: {property_.text}"
        if property_.kind.decided is Builtin.DEADLOCK:
            if self.space.closed.is_open:
                return Query("", f"{property_.name}: not asked: traps of one chart are no states")
            if any(builder.owes_by_payload for builder in self.builders):
                why = "what is owed depends on what an event carries"
                return Query("", f"{property_.name}: not asked: {why}")
            return Query(f"A[] !({self.deadlock()})", comment)
        if property_.condition is None:
            return None
        condition = Condition(property_.condition, property_.atoms)
        match property_.kind.decided:
            case AtStates(negated=True):
                return Query(f"A[] {self._unless(self.text(condition, property_))}", comment)
            case AtStates(wanted=True):
                return Query(f"E<> {self._stable(self.text(condition, property_))}", comment)
            case AtStates():
                text = self.text(condition, property_)
                return Query(f"A[] !({self._stable(text)})", comment)
            case OverGraph(procedure="leads-to") if property_.goal is not None:
                left = self._stable(self.text(condition, property_))
                right = self._stable(self.text(property_.goal, property_))
                return Query(f"({left}) --> ({right})", f"{comment}. {UNFAIR}")
            case _:
                return None

    def _stable(self, text: str) -> str:
        return f"{self.space.stable} && ({text})" if self.has_steps else f"({text})"

    def _unless(self, text: str) -> str:
        return f"(!{self.space.stable} || ({text}))" if self.has_steps else f"({text})"

    # --- conditions ------------------------------------------------------------------------------

    def text(self, condition: Condition, property_: Property) -> str:
        """Return a condition; one that cannot be evaluated is false (as in the oracle)."""
        atoms = dict(condition.atoms)
        owner = property_.owner

        def access(path: str, variable: Variable) -> Fragment:
            if owner is not None:
                return self._variable(owner, path, variable)
            base = path if path in atoms else path.split(".", maxsplit=1)[0]
            found = next((a for n, a in atoms.items() if path == n), atoms.get(base))
            if found is None:
                base = max((n for n in atoms if path.startswith(n)), key=len)
                found = atoms[base]
            return self._atom(found, path[len(base) :], variable)

        printer = Printer(
            access,
            self.space.constant,
            self.space.symbol,
            lambda test: self._state(owner or 0, test),
        )
        whole = both(safety(condition.expression), condition.expression)
        assert whole is not None  # noqa: S101  (there is a condition)
        return printer.print(whole)

    def _atom(self, atom: Atom, rest: str, variable: Variable) -> Fragment:
        if atom.state is not None:
            return self.in_state(atom.machine, atom.state)
        return self._variable(atom.machine, atom.variable + rest, variable)

    def _variable(self, machine: int, path: str, variable: Variable) -> Fragment:
        data = self.builders[machine].data
        instance = self.space.instances[machine]
        if path in data.variables:
            return Fragment(f"{instance}.{data.variables[path]}")
        known = self.space.known_inputs(machine).get(path)
        if known is not None:
            return data.printer.literal(known)
        del variable
        return Fragment(data.name(path))

    def _state(self, machine: int, test: InState) -> Fragment:
        return self.in_state(machine, test.state)

    def in_state(self, machine: int, state: int) -> Fragment:
        """Return whether a state of a machine is active."""
        builder = self.builders[machine]
        instance = self.space.instances[machine]
        if state in builder.data.flags:
            return Fragment(f"{instance}.{builder.data.flags[state]}")
        found = [
            f"{instance}.{location.name}"
            for key, location in builder.locations.items()
            if state in key.configuration
        ]
        if not found:
            return Fragment("false")
        return Fragment(" || ".join(found), 2 if len(found) > 1 else 100)

    # --- deadlock --------------------------------------------------------------------------------

    def deadlock(self) -> str:
        """Return when nothing is left to happen and some machine is not at rest (VERIFICATION)."""
        parts = [self.space.stable] if self.has_steps else []
        parts += [f"{queue.length} == 0" for queue in self.space.queues.values()]
        restless = []
        for machine, builder in enumerate(self.builders):
            instance = self.space.instances[machine]
            calm, moving = [], []
            for key, location in builder.locations.items():
                if key.fault:
                    continue
                text = self._calm(builder, machine, key, f"{instance}.{location.name}")
                if text is None:
                    moving.append(f"{instance}.{location.name}")
                else:
                    calm.append(text)
                    if not self._rests(builder, machine, key):
                        restless.append(f"{instance}.{location.name}")
            faulted = [
                f"!{instance}.{location.name}"
                for key, location in builder.locations.items()
                if key.fault
            ]
            if all(text.startswith(instance) and " " not in text for text in calm) and len(
                moving
            ) + len(faulted) < len(calm):
                parts += [*faulted, *(f"!{text}" for text in moving)]
            else:
                parts.append(f"({' || '.join(calm) or 'false'})")
        parts.append(f"({' || '.join(restless) or 'false'})")
        return " && ".join(parts)

    def _rests(self, builder: Builder, machine: int, key: Key) -> bool:
        if not key.running:
            return True
        chart = builder.automaton.paths.chart
        rests = resting(chart, self.space.closed.system.machines[machine])
        return all(s in rests for s in key.configuration if chart.states[s].is_leaf)

    def _calm(self, builder: Builder, machine: int, key: Key, here: str) -> str | None:
        """Return when nothing is enabled, armed or owed in a location; None: never."""
        is_monitor = self.space.closed.system.machines[machine].is_monitor
        closed = self.space.closed
        if not is_monitor and any(not is_silent(closed, machine, t) for t in key.timers):
            return None
        still = builder.still.get(key, ())
        if still is None:
            return None
        tests_of_still = (self._test(machine, t.condition, holds=t.holds) for t in still)
        conditions = list(dict.fromkeys((here, *tests_of_still)))
        for remembered, tests in builder.owed.get(key, []):
            parts = [self._remembered(machine, text) for text in remembered]
            parts += [self._test(machine, t.condition, holds=t.holds) for t in tests]
            if not parts:
                return None
            conditions.append(f"!({' && '.join(parts)})")
        return conditions[0] if len(conditions) == 1 else f"({' && '.join(conditions)})"

    def _remembered(self, machine: int, text: str) -> str:
        instance = self.space.instances[machine]
        names = self.builders[machine].data.histories.values()
        for name in names:
            text = re.sub(rf"\b{name}\b", f"{instance}.{name}", text)
        return text

    def _test(self, machine: int, condition: Expr, *, holds: bool) -> str:
        printer = Printer(
            lambda path, variable: self._variable(machine, path, variable),
            self.space.constant,
            self.space.symbol,
        )
        return printer.fragment(condition if holds else denied(condition)).at_least(4)


def _unasked(property_: Property) -> str:
    key = property_.kind.key
    return UNASKED.get(key, f"UPPAAL has no query for `{key}`: use `fsmkit check`")
