"""Visiting and rewriting of trees: expressions, statements, a Chart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any, get_args

from fsmkit.diagnostics import Source, Span
from fsmkit.language.relocation import BARE, field_getter
from fsmkit.language.tree import Call, Element, Expr, Member, Variable

EXPRESSIONS = frozenset(get_args(Expr))


def nodes(node: object) -> Iterator[object]:
    """Yield a node and its descendants: dataclasses and tuples, in order.

    Locations and the types of expressions are skipped.
    """
    left: list[Any] = [node]
    while left:
        part = left.pop()
        if type(part) is tuple:
            left += part[::-1]
        elif (take := child_getter(part.__class__)) is not None:
            yield part
            left += take(part)[::-1]


def children(node: Any) -> tuple[object, ...]:
    """Return the fields of a node that may contain nodes, in order."""
    take = child_getter(node.__class__)
    return () if take is None else take(node)


@cache
def child_getter(kind: Any) -> Callable[[Any], tuple[Any, ...]] | None:
    """Return the function that reads the child fields of a class; None for a leaf."""
    names = _names(kind)
    return None if names is None else field_getter(names)


@cache
def child_fields(kind: Any) -> tuple[str, ...]:
    """Return the fields of a class that may contain nodes; empty for a leaf."""
    return _names(kind) or ()


def can_have_children(kind: Any) -> bool:
    """Return whether a node of a class can have children."""
    return bool(_names(kind))


@cache
def _names(kind: Any) -> tuple[str, ...] | None:
    if not is_dataclass(kind) or kind in (Span, Source):
        return None
    holding = (field for field in fields(kind) if not BARE.fullmatch(str(field.type)))
    return tuple(field.name for field in holding if field.name not in ("span", "type"))


def parts(node: Any) -> tuple[Expr, ...]:
    """Return the direct parts of an expression, or the expressions of a statement."""
    found: tuple[Any, ...] = ()
    for part in children(node):
        for each in part if part.__class__ is tuple else (part,):
            if each.__class__ in EXPRESSIONS:
                found += (each,)
    return found


def subexpressions(expr: Expr) -> Iterator[Expr]:
    """Yield an expression and its parts, at every depth."""
    yield expr
    for part in parts(expr):
        yield from subexpressions(part)


def calls(expr: Expr) -> bool:
    """Return whether evaluating an expression calls an operation of the host."""
    return any(isinstance(part, Call) for part in subexpressions(expr))


def root(location: Expr) -> Variable:
    """Return the variable that a location is, or belongs to."""
    while not isinstance(location, Variable):
        assert isinstance(location, Element | Member)  # noqa: S101
        location = location.array if isinstance(location, Element) else location.record
    return location


def map_parts(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return an expression whose direct parts are replaced by `change`; arrays stay variables.

    If nothing changes, return the same expression.
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


def rewrite(expr: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """Return an expression whose nodes are replaced by ``change``, where it is not None."""
    changed = change(expr)
    if changed is not None:
        return changed
    return map_parts(expr, lambda part: rewrite(part, change))
