"""Visit or change the parts of a tree: of expressions, of statements, of a Chart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any, get_args

from fsmkit.diagnostics import Source, Span
from fsmkit.language.placing import BARE, values_of
from fsmkit.language.tree import Call, Element, Expr, Member, Variable

EXPRESSIONS = frozenset(get_args(Expr))


def nodes(node: object) -> Iterator[object]:
    """Yield a node and all below it: dataclasses and tuples, in order.

    Places and the types of expressions are left out.
    """
    left: list[Any] = [node]
    while left:
        part = left.pop()
        if type(part) is tuple:
            left += part[::-1]
        elif (take := held(part.__class__)) is not None:
            yield part
            left += take(part)[::-1]


def children(node: Any) -> tuple[object, ...]:
    """Return the fields of a node that may hold nodes, in order."""
    take = held(node.__class__)
    return () if take is None else take(node)


@cache
def held(kind: Any) -> Callable[[Any], tuple[Any, ...]] | None:
    """Return how to take what a node may hold of nodes; None for what is none."""
    names = _names(kind)
    return None if names is None else values_of(names)


@cache
def fields_held(kind: Any) -> tuple[str, ...]:
    """Return the fields in which a node of a class may hold others; none of what is a leaf."""
    return _names(kind) or ()


def may_hold(kind: Any) -> bool:
    """Whether a node of a class may hold others."""
    return bool(_names(kind))


@cache
def _names(kind: Any) -> tuple[str, ...] | None:
    if not is_dataclass(kind) or kind in (Span, Source):
        return None
    holding = (field for field in fields(kind) if not BARE.fullmatch(str(field.type)))
    return tuple(field.name for field in holding if field.name not in ("span", "type"))


def parts(node: Any) -> tuple[Expr, ...]:
    """Return the direct parts of an expression, or the expressions that a statement holds."""
    found: tuple[Any, ...] = ()
    for part in children(node):
        for each in part if part.__class__ is tuple else (part,):
            if each.__class__ in EXPRESSIONS:
                found += (each,)
    return found


def subexpressions(expr: Expr) -> Iterator[Expr]:
    """Return an expression and all its parts."""
    yield expr
    for part in parts(expr):
        yield from subexpressions(part)


def calls(expr: Expr) -> bool:
    """Whether evaluating calls an operation of the host."""
    return any(isinstance(part, Call) for part in subexpressions(expr))


def root(location: Expr) -> Variable:
    """Return the variable that a location is, or is a part of."""
    while not isinstance(location, Variable):
        assert isinstance(location, Element | Member)  # noqa: S101
        location = location.array if isinstance(location, Element) else location.record
    return location


def with_parts(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return an expression each direct part of which is changed; arrays stay the variables.

    Where nothing changes it is the same expression.
    """
    new: dict[str, Any] = {}
    kind: Any = expr.__class__
    for name in _names(kind) or ():
        value = getattr(expr, name)
        if isinstance(value, tuple):
            parts = tuple(map(change, value))
            if any(part is not old for part, old in zip(parts, value, strict=True)):
                new[name] = parts
        elif value.__class__ in EXPRESSIONS and name != "array":
            part = change(value)
            if part is not value:
                new[name] = part
    return replace(expr, **new) if new else expr


def rebuilt(expr: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """Return an expression in which what ``change`` gives stands for the nodes it gives it for."""
    changed = change(expr)
    if changed is not None:
        return changed
    return with_parts(expr, lambda part: rebuilt(part, change))
