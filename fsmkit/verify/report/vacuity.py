"""Detect vacuous properties: they hold because their condition is never true.

``leads_to: [P, Q]`` is vacuous if P never holds, ``never: P and R`` if P alone never does (Beer,
Ben-David, Eisner, Rodeh, *Efficient Detection of Vacuity in Temporal Model Checking*, 2001).
Whether a first condition holds somewhere is among the marks of an exploration. A part of a
condition is decided by the entered states, in three values: data are unknown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fsmkit.language import Binary, BinaryOp, Expr, Literal, Unary, UnaryOp, Variable
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import OverGraph, Property
from fsmkit.verify.statespace.exploration import Exploration


def vacuous(found: Exploration, number: int, property_: Property) -> str:
    """Return the source of the condition that never holds; empty without one.

    Args:
        found: A complete exploration.
        number: The number of the property in the system.
        property_: A property that holds.

    """
    if property_.condition is None or property_.owner is not None or property_.is_existential:
        return ""
    if isinstance(property_.kind.decided, OverGraph):
        if property_.goal is None or found.mark(1 + number) is not None:
            return ""
        return _written(property_.condition)
    atoms = dict(property_.atoms)
    for part, is_negated in _conjuncts(property_.condition, is_negated=property_.is_negated):
        if _value(part, atoms, found) is is_negated:
            return f"not ({_written(part)})" if is_negated else _written(part)
    return ""


def _conjuncts(condition: Expr, *, is_negated: bool) -> Iterator[tuple[Expr, bool]]:
    """Yield the parts that must hold together in a violation, if there are several.

    Each with whether its negation must hold.
    """
    parts = list(_split(condition, is_negated=is_negated))
    if len(parts) > 1:
        yield from parts


def _split(condition: Expr, *, is_negated: bool) -> Iterator[tuple[Expr, bool]]:
    match condition:
        case Unary(UnaryOp.NOT, operand):
            yield from _split(operand, is_negated=not is_negated)
        case Binary(operator, left, right) if operator is (
            BinaryOp.OR if is_negated else BinaryOp.AND
        ):
            yield from _split(left, is_negated=is_negated)
            yield from _split(right, is_negated=is_negated)
        case _:
            yield condition, is_negated


def _value(part: Expr, atoms: Mapping[str, Atom], found: Exploration) -> bool | None:
    """Return the value of a condition in every state; None if it may have both."""
    match part:
        case Literal(bool() as value):
            return value
        case Variable(name=name) if (atom := atoms.get(name)) is not None:
            never = bool(atom.state) and atom.state not in found.machines[atom.machine].states
            return False if never else None
        case Unary(UnaryOp.NOT, operand):
            inner = _value(operand, atoms, found)
            return None if inner is None else not inner
        case Binary(BinaryOp.AND | BinaryOp.OR as operator, left, right):
            values = {_value(side, atoms, found) for side in (left, right)}
            decisive = operator is BinaryOp.OR
            if decisive in values:
                return decisive
            return None if None in values else not decisive
        case _:
            return None


def _written(condition: Expr) -> str:
    span = condition.span
    return span.source.text[span.start : span.end]
