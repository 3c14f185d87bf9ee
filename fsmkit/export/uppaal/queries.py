"""Translate properties to queries, or to a remark if UPPAAL has no such query."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fsmkit.diagnostics import FsmkitError
from fsmkit.export.formula import Form, form_of
from fsmkit.export.uppaal.automaton import is_silent
from fsmkit.export.uppaal.entries import Key
from fsmkit.export.uppaal.machine import Builder
from fsmkit.export.uppaal.network import Query
from fsmkit.export.uppaal.printing import Access, Printer
from fsmkit.export.uppaal.space import Space
from fsmkit.export.uppaal.terms import both, safety, unsupported
from fsmkit.language import Expr, Fragment, Variable
from fsmkit.system.properties.condition import Condition
from fsmkit.system.properties.property import Builtin, Property
from fsmkit.system.shared import resting_states

MANY = 6
"""A state that is active in more locations has a variable of its own."""
UNFAIR = (
    "UPPAAL has no fairness: its proofs are valid, but a refuted property may hold in all fair runs"
)
MISSING = {
    "livelock_free": "UPPAAL has no query for cycles in which no time passes",
    "recoverable": "UPPAAL does not nest path quantifiers (AG EF)",
    "within": "it needs a clock that runs from one condition to the other: write a monitor",
}


@dataclass(slots=True)
class Queries:
    """Creates the queries of a network."""

    space: Space
    builders: list[Builder]
    has_steps: bool
    """Whether states between two steps exist, at which nothing is evaluated."""

    def all_queries(self) -> Iterator[Query]:
        """Yield the queries of all properties, and one for each queue."""
        for property_ in self.space.closed.system.properties:
            yield self._of(property_)
        for queue in self.space.queues.values():
            yield Query(f"A[] !{queue.overflow}", f"the queue of {queue.machine} is long enough")

    def _of(self, property_: Property) -> Query:
        comment = f"{property_.name}: {property_.text}"
        try:
            found = Query(self._formula(property_), comment)
        except FsmkitError as error:
            why = error.diagnostics[0].message
            return Query("", f"{comment}: not carried over: {why}", why)
        is_unfair = form_of(property_) is Form.LEADS_TO
        return replace(found, comment=f"{comment}. {UNFAIR}") if is_unfair else found

    def _formula(self, property_: Property) -> str:
        """Return a property as a formula; rejected if UPPAAL has none of its kind."""
        if property_.is_of_steps:
            raise _unsupported(property_, "`occurs` is decided at steps, not at states")
        if property_.kind.decided is Builtin.DEADLOCK:
            if self.space.closed.is_open:
                raise _unsupported(property_, "traps of one chart are not states")
            if any(builder.owes_by_payload for builder in self.builders):
                raise _unsupported(property_, "the required events depend on a payload")
            return f"A[] !({self.deadlock()})"
        form, key = form_of(property_), property_.kind.key
        if property_.condition is None or form not in (Form.NEVER, Form.REACHED, Form.LEADS_TO):
            otherwise = f"UPPAAL has no query for `{key}`: use `fsmkit check`"
            raise _unsupported(property_, MISSING.get(key, otherwise))
        text = self.text(Condition(property_.condition, property_.atoms), property_)
        if form is Form.LEADS_TO and property_.goal is not None:
            goal = self._stable(self.text(property_.goal, property_))
            return f"({self._stable(text)}) --> ({goal})"
        if form is Form.REACHED:
            return f"E<> {self._stable(text)}"
        if property_.is_negated:
            return f"A[] {self._unless(text)}"
        return f"A[] !({self._stable(text)})"

    def _stable(self, text: str) -> str:
        return f"{self.space.stable} && ({text})" if self.has_steps else f"({text})"

    def _unless(self, text: str) -> str:
        return f"(!{self.space.stable} || ({text}))" if self.has_steps else f"({text})"

    # --- conditions ------------------------------------------------------------------------------

    def text(self, condition: Condition, property_: Property) -> str:
        """Return a condition; one that cannot be evaluated is false (as in the oracle)."""
        atoms, owner = dict(condition.atoms), property_.owner

        def access(path: str, _: Variable) -> Fragment:
            if owner is not None:
                return self._variable(owner, path)
            base = max((name for name in atoms if path.startswith(name)), key=len)
            atom = atoms[base]
            if atom.state is not None:
                return self.in_state(atom.machine, atom.state)
            return self._variable(atom.machine, atom.variable + path[len(base) :])

        whole = both(safety(condition.expression), condition.expression)
        assert whole is not None  # noqa: S101  (there is a condition)
        return self._printer(access, owner or 0).print(whole)

    def _printer(self, access: Access, machine: int) -> Printer:
        space = self.space
        return Printer(
            access,
            space.constant,
            space.symbol,
            lambda test: self.in_state(machine, test.state),
        )

    def _variable(self, machine: int, path: str) -> Fragment:
        data = self.builders[machine].data
        if path in data.variables:
            return Fragment(f"{self.space.instances[machine]}.{data.variables[path]}")
        known = self.space.known_inputs(machine).get(path)
        return Fragment(data.name(path)) if known is None else data.printer.literal(known)

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
        """Return the formula of a deadlock (VERIFICATION).

        Nothing can happen, and some machine is not at rest.
        """
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
        rests = resting_states(chart, self.space.closed.system.machines[machine])
        return all(s in rests for s in key.configuration if chart.states[s].is_leaf)

    def _calm(self, builder: Builder, machine: int, key: Key, here: str) -> str | None:
        """Return when nothing is enabled, armed or fair in a location; None: never."""
        is_monitor = self.space.closed.system.machines[machine].is_monitor
        closed = self.space.closed
        if not is_monitor and any(not is_silent(closed, machine, t) for t in key.timers):
            return None
        still = builder.still.get(key, ())
        if still is None:
            return None
        tests_of_still = (self._test(machine, t.condition, holds=t.holds) for t in still)
        conditions = list(dict.fromkeys((here, *tests_of_still)))
        for remembered, tests in builder.fair.get(key, []):
            parts = builder.remembers(remembered, f"{self.space.instances[machine]}.")
            parts += [self._test(machine, t.condition, holds=t.holds) for t in tests]
            if not parts:
                return None
            conditions.append(f"!({' && '.join(parts)})")
        return conditions[0] if len(conditions) == 1 else f"({' && '.join(conditions)})"

    def _test(self, machine: int, condition: Expr, *, holds: bool) -> str:
        printer = self._printer(lambda path, _: self._variable(machine, path), machine)
        return printer.condition(condition, holds=holds)


def _unsupported(property_: Property, why: str) -> Exception:
    return unsupported(why, property_.span, "use `fsmkit check`")
