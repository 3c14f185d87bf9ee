"""Convert properties to events that occur in their violations, and to assertions on these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import assert_never

from fsmkit.diagnostics import Findings
from fsmkit.export.exporter import report_omitted
from fsmkit.export.formula import (
    All,
    Any,
    Claim,
    Constant,
    Form,
    Formula,
    In,
    Not,
    QueueEmpty,
    claims,
    negation_normal_form,
    simplify,
)
from fsmkit.export.identifiers import Names
from fsmkit.export.network import Network

FORMS = (Form.NEVER, Form.REACHED, Form.LIVELOCK)
MOST_CASES = 2048
"""Combinations in which one property can be violated; with more, it is not carried over."""


@dataclass(frozen=True, slots=True)
class Case:
    """A combination of local states, by machine, and the machines whose queues must be empty."""

    locals: tuple[tuple[int, frozenset[int]], ...]
    empty: frozenset[int]


@dataclass(frozen=True, slots=True)
class Assertion:
    """A property. ``name`` is that of its event; ``cases``: where that can occur."""

    name: str
    claim: Claim
    cases: tuple[Case, ...] = ()

    @property
    def is_carried(self) -> bool:
        """Whether its events are in the model; a livelock is asserted without events."""
        return not self.claim.missing and self.claim.form is not Form.LIVELOCK


def assertions_of(network: Network, names: Names, findings: Findings | None) -> Iterator[Assertion]:
    """Yield the assertions of the properties of a system."""
    for claim in claims(network, FORMS, findings, "set of traces"):
        found = Assertion(names.take(claim.property.name), claim)
        if not found.is_carried:
            yield found
            continue
        cases = _cases(simplify(negation_normal_form(network, claim.condition)))
        if cases is None:
            why = f"it has more than {MOST_CASES:,} cases"
            report_omitted(claim.property, why, findings)
            yield replace(found, claim=replace(claim, missing=why))
            continue
        if Case((), frozenset()) in cases:
            always = frozenset(range(len(network.automata[0].locals)))
            cases = (Case(((0, always),), frozenset()),)
        yield replace(found, cases=cases)


def _cases(formula: Formula) -> tuple[Case, ...] | None:
    """Return the possible cases of a formula (its DNF); None if there are too many."""
    match formula:
        case Constant(value):
            return (Case((), frozenset()),) if value else ()
        case In(machine, numbers):
            return (Case(((machine, numbers),), frozenset()),) if numbers else ()
        case QueueEmpty(machine):
            return (Case((), frozenset({machine})),)
        case Any(parts):
            return _joined(parts, lambda found, other: (*found, *other), ())
        case All(parts):
            return _joined(parts, _both, (Case((), frozenset()),))
        case Not():
            raise AssertionError("negations are within tests")
        case _:
            assert_never(formula)


def _joined(
    parts: tuple[Formula, ...],
    join: Callable[[tuple[Case, ...], tuple[Case, ...]], Iterable[Case]],
    found: tuple[Case, ...],
) -> tuple[Case, ...] | None:
    for part in parts:
        other = _cases(part)
        if other is None:
            return None
        found = tuple(dict.fromkeys(join(found, other)))
        if len(found) > MOST_CASES:
            return None
    return found


def _both(one: tuple[Case, ...], other: tuple[Case, ...]) -> Iterator[Case]:
    """Yield the possible combinations of two lists of cases."""
    for left, right in product(one, other):
        locals_ = dict(left.locals)
        for machine, numbers in right.locals:
            locals_[machine] = locals_.get(machine, numbers) & numbers
        if all(locals_.values()):
            yield Case(tuple(sorted(locals_.items())), left.empty | right.empty)
