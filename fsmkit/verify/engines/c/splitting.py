"""Split conditions into parts that a diagram evaluates separately: each reads few machines.

The whole condition marks a state exactly if some part marks it. A condition that must hold is split
at conjunctions: the first part that is false, or fails, makes the whole false. A condition that is
searched for is split at disjunctions whose terms cannot fail: after a failure the other terms do
not count.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import fsmkit.language as lang
from fsmkit.language.walk import nodes
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import Property

NEVER_FAIL = (lang.Binary, lang.InState, lang.Literal, lang.Unary, lang.Variable)
MAY_FAIL = {lang.BinaryOp.DIV, lang.BinaryOp.REM}


def parts_of(property_: Property) -> tuple[Property, ...]:
    """Return the two or more parts of a property; empty if it has only one."""
    condition = property_.condition
    if condition is None or property_.owner is not None or property_.is_of_steps:
        return ()
    op = lang.BinaryOp.AND if property_.is_negated else lang.BinaryOp.OR
    if op is lang.BinaryOp.OR and not all(map(_never_fails, nodes(condition))):
        return ()
    parts = tuple(_parts(condition, op))
    atoms = dict(property_.atoms)
    return tuple(_part(property_, atoms, part) for part in parts) if len(parts) > 1 else ()


def _parts(expr: lang.Expr, op: lang.BinaryOp) -> Iterator[lang.Expr]:
    match expr:
        case lang.Binary(found, left, right) if found is op:
            yield from _parts(left, op)
            yield from _parts(right, op)
        case lang.Unary(lang.UnaryOp.NOT, operand):
            other = lang.BinaryOp.OR if op is lang.BinaryOp.AND else lang.BinaryOp.AND
            for part in _parts(operand, other):
                yield lang.Unary(lang.UnaryOp.NOT, part, lang.BOOL, part.span)
        case _:
            yield expr


def _part(property_: Property, atoms: Mapping[str, Atom], condition: lang.Expr) -> Property:
    """Return the property with that part of its condition and the atoms that the part reads."""
    read = (node.name for node in nodes(condition) if isinstance(node, lang.Variable))
    own = {name: atoms[name] for name in read if name in atoms}
    return replace(property_, condition=condition, atoms=tuple(own.items()))


def _never_fails(node: object) -> bool:
    return isinstance(node, NEVER_FAIL) and getattr(node, "op", None) not in MAY_FAIL
