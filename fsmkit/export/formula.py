"""Translate properties to formulas over global states of a network, with tests of local states."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from functools import reduce
from itertools import product
from typing import assert_never

from fsmkit.diagnostics import Findings, FsmkitError, fail
from fsmkit.emit import plain
from fsmkit.export.exporter import report_omitted
from fsmkit.export.network import Network
from fsmkit.language import Binary, BinaryOp, Expr, InState, Unary, UnaryOp, Variable
from fsmkit.language.walk import nodes
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.kinds import never
from fsmkit.system.properties.property import AtStates, Builtin, OverGraph, Property
from fsmkit.verify.engines.python.evaluate import evaluate_property

MOST_CASES = 1 << 14
"""Combinations of machines' values that are tried for one comparison."""


@dataclass(frozen=True, slots=True)
class Constant:
    """Always, or never."""

    value: bool


@dataclass(frozen=True, slots=True)
class In:
    """A machine is in one of these local states, by number."""

    machine: int
    locals: frozenset[int]


@dataclass(frozen=True, slots=True)
class QueueEmpty:
    """No event waits in the queue beside a machine."""

    machine: int


@dataclass(frozen=True, slots=True)
class Not:
    """The part does not hold."""

    part: Formula


@dataclass(frozen=True, slots=True)
class All:
    """All parts hold."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Any:
    """Some part holds."""

    parts: tuple[Formula, ...]


Formula = Constant | In | QueueEmpty | Not | All | Any


class Form(Enum):
    """The temporal form of a property."""

    NEVER = "its condition never holds"
    REACHED = "it can be reached"
    RECOVERABLE = "it can be reached from everywhere"
    LEADS_TO = "where it holds, the goal holds some time later"
    LIVELOCK = "machines are not busy for ever while no time passes"


@dataclass(frozen=True, slots=True)
class Claim:
    """A property as a formula over states; ``missing``: why a notation cannot express it."""

    property: Property
    form: Form | None = None
    condition: Formula = Constant(value=False)
    goal: Formula = Constant(value=False)
    missing: str = ""


def claims(
    network: Network, forms: Collection[Form], findings: Findings | None, kind_of: str
) -> Iterator[Claim]:
    """Yield the properties as claims; ``findings`` report those that are not of these ``forms``.

    ``kind_of``: the notation's term for them, such as "formula over states".
    """
    for property_ in network.closed.system.properties:
        form = form_of(property_)
        if form is None or form not in forms:
            found = Claim(property_, missing=f"`{plain(property_.kind.key)}` is no {kind_of}")
        else:
            try:
                found = _claim(network, property_, form)
            except FsmkitError as error:
                found = Claim(property_, missing=error.diagnostics[0].message)
        if found.missing:
            report_omitted(property_, found.missing, findings)
        yield found


def form_of(property_: Property) -> Form | None:
    """Return the form of a property; None for other kinds."""
    match property_.kind.decided:
        case Builtin.DEADLOCK:
            return Form.NEVER
        case Builtin.LIVELOCK:
            return Form.LIVELOCK
        case AtStates():
            return Form.REACHED if property_.is_existential else Form.NEVER
        case OverGraph(procedure="recoverable"):
            return Form.RECOVERABLE
        case OverGraph(procedure="leads-to"):
            return Form.LEADS_TO
        case _:
            return None


def _claim(network: Network, property_: Property, form: Form) -> Claim:
    if property_.kind.decided is Builtin.DEADLOCK:
        return Claim(property_, form, deadlock(network))
    if form is Form.LIVELOCK:
        return Claim(property_, form)
    condition = condition_of(network, property_)
    if form is not Form.LEADS_TO or property_.goal is None:
        return Claim(property_, form, Not(condition) if property_.is_negated else condition)
    goal, atoms = property_.goal.expression, property_.goal.atoms
    return Claim(
        property_,
        form,
        condition,
        condition_of(network, replace(property_, condition=goal, atoms=atoms)),
    )


def condition_of(network: Network, property_: Property) -> Formula:
    """Return the formula of a property's condition.

    Raises `FsmkitError` (``not-exported``) if it refers to events of a step, or compares too many
    values.
    """
    if property_.condition is None or property_.is_of_steps:
        raise fail(
            "not-exported",
            f"`{plain(property_.text)}` refers to events of a step",
            property_.span,
            help="watch the event by a monitor, and export that",
        )
    return simplify(_Reader(network, property_).formula(property_.condition))


class _Reader:
    """Splits a condition into parts that can be evaluated separately."""

    def __init__(self, network: Network, property_: Property) -> None:
        self._network = network
        self._property = property_
        self._atoms = dict(property_.atoms)

    def formula(self, expr: Expr) -> Formula:
        """Return the formula of an expression."""
        match expr:
            case Binary(BinaryOp.AND, left, right):
                return All((self.formula(left), self.formula(right)))
            case Binary(BinaryOp.OR, left, right):
                return Any((self.formula(left), self.formula(right)))
            case Unary(UnaryOp.NOT, operand):
                return Not(self.formula(operand))
            case _:
                return self._cases(expr)

    def _cases(self, expr: Expr) -> Formula:
        """Return the combinations of the machines' values for which an expression is true."""
        machines = sorted(self._machines(expr))
        groups = [self._shown(machine, expr) for machine in machines]
        count = reduce(lambda n, group: n * len(group), groups, 1)
        if count > MOST_CASES:
            raise fail(
                "not-exported",
                f"`{plain(self._property.text)}` compares {count:,} combinations of values",
                self._property.span,
                help="declare narrower ranges, or let a chart compare",
            )
        some = [automaton.locals[0].snapshot for automaton in self._network.automata]
        tested = replace(self._property, condition=expr, kind=never.KIND)
        found: list[Formula] = []
        for combination in product(*(group.values() for group in groups)):
            snapshots = list(some)
            for machine, locals_ in zip(machines, combination, strict=True):
                first = min(locals_)
                snapshots[machine] = self._network.automata[machine].locals[first].snapshot
            if evaluate_property(self._network.closed.charts, tested, tuple(snapshots)):
                parts = zip(machines, combination, strict=True)
                found.append(All(tuple(In(m, frozenset(locals_)) for m, locals_ in parts)))
        return Any(tuple(found))

    def _machines(self, expr: Expr) -> set[int]:
        if self._property.owner is not None:
            return {self._property.owner}
        names = (n.name for n in nodes(expr) if isinstance(n, Variable))
        return {self._atoms[name].machine for name in names}

    def _shown(self, machine: int, expr: Expr) -> dict[object, list[int]]:
        """Group the local states of a machine by the values that the expression reads."""
        groups: dict[object, list[int]] = {}
        for number, local in enumerate(self._network.automata[machine].locals):
            values = tuple(self._values(machine, number, expr))
            groups.setdefault((values, local.running), []).append(number)
        return groups

    def _values(self, machine: int, number: int, expr: Expr) -> Iterator[object]:
        snapshot = self._network.automata[machine].locals[number].snapshot
        chart = self._network.closed.charts[machine]
        for node in nodes(expr):
            if isinstance(node, InState):
                yield node.state in snapshot.configuration
            elif isinstance(node, Variable):
                atom = self._atoms.get(node.name, Atom(machine, variable=node.name))
                if atom.machine != machine:
                    continue
                if atom.state is not None:
                    yield atom.state in snapshot.configuration
                else:
                    slot = index_of(chart).slots[atom.variable]
                    yield snapshot.data[slot] if slot >= 0 else snapshot.inputs[-1 - slot]


def deadlock(network: Network) -> Formula:
    """Return the formula of a deadlock: nothing can happen and some machine is not at rest.

    VERIFICATION: no event waits, no timer is armed, no fair event is possible.
    """
    quiet: list[Formula] = []
    restless: list[Formula] = []
    for machine, automaton in enumerate(network.automata):
        if automaton.queue:
            quiet.append(QueueEmpty(machine))
        armed = set() if automaton.is_monitor else automaton.where(lambda local: local.awaited)
        still = automaton.where(lambda one: not (one.has_work or one.faulted or one.fair)) - armed
        quiet.append(In(machine, frozenset(still)))
        restless.append(In(machine, frozenset(automaton.where(lambda local: not local.at_rest))))
    parts = [_with_constants(network, part) for part in (*quiet, Any(tuple(restless)))]
    return simplify(All(tuple(parts)))


def _with_constants(network: Network, formula: Formula) -> Formula:
    """Return a formula in which constant tests are constants."""
    match formula:
        case In(machine, locals_):
            if not locals_:
                return Constant(value=False)
            if len(locals_) == len(network.automata[machine].locals):
                return Constant(value=True)
            return formula
        case Not(part):
            return Not(_with_constants(network, part))
        case All(parts):
            return All(tuple(_with_constants(network, part) for part in parts))
        case Any(parts):
            return Any(tuple(_with_constants(network, part) for part in parts))
        case Constant() | QueueEmpty():
            return formula
        case _:
            assert_never(formula)


def simplify(formula: Formula) -> Formula:
    """Return an equivalent formula without inner constants, with tests of one machine joined."""
    match formula:
        case Not(part):
            inner = simplify(part)
            return Constant(not inner.value) if isinstance(inner, Constant) else Not(inner)
        case All(parts) | Any(parts):
            return _join([simplify(part) for part in parts], is_all=isinstance(formula, All))
        case In(_, locals_) if not locals_:
            return Constant(value=False)
        case _:
            return formula


def _join(parts: Collection[Formula], *, is_all: bool) -> Formula:
    tests: dict[int, frozenset[int]] = {}
    others: list[Formula] = []
    for part in parts:
        match part:
            case Constant(value) if value is is_all:
                continue
            case Constant():
                return part
            case All(inner) if is_all:
                pending: tuple[Formula, ...] = inner
            case Any(inner) if not is_all:
                pending = inner
            case _:
                pending = (part,)
        for one in pending:
            if not isinstance(one, In):
                others.append(one)
            elif one.machine not in tests:
                tests[one.machine] = one.locals
            elif is_all:
                tests[one.machine] &= one.locals
            else:
                tests[one.machine] |= one.locals
    if is_all and not all(tests.values()):
        return Constant(value=False)
    found = [*(In(machine, locals_) for machine, locals_ in tests.items()), *others]
    if not found:
        return Constant(is_all)
    if len(found) == 1:
        return found[0]
    return All(tuple(found)) if is_all else Any(tuple(found))


def negation_normal_form(network: Network, formula: Formula, *, negated: bool = False) -> Formula:
    """Return an equivalent formula, or its negation, with `Not` only before `QueueEmpty`."""
    match formula:
        case Constant(value):
            return Constant(value is not negated)
        case In(machine, locals_):
            if not negated:
                return formula
            return In(machine, frozenset(range(len(network.automata[machine].locals))) - locals_)
        case Not(part):
            return negation_normal_form(network, part, negated=not negated)
        case All(parts):
            inner = tuple(negation_normal_form(network, part, negated=negated) for part in parts)
            return Any(inner) if negated else All(inner)
        case Any(parts):
            inner = tuple(negation_normal_form(network, part, negated=negated) for part in parts)
            return All(inner) if negated else Any(inner)
        case QueueEmpty():
            if negated:
                raise AssertionError("only formulas of idle machines test for empty queues")
            return formula
        case _:
            assert_never(formula)
