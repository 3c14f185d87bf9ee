"""Expressions of JANI, whose operators are written in mathematical signs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce

Json = dict[str, "Json"] | list["Json"] | str | int | bool | None
"""What a JSON document is made of."""


def binary(op: str, left: Json, right: Json) -> Json:
    """Return an expression of two parts."""
    return {"op": op, "left": left, "right": right}


def equal(left: Json, right: Json) -> Json:
    """Return whether two numbers are equal."""
    return binary("=", left, right)


def differ(left: Json, right: Json) -> Json:
    """Return whether two numbers differ."""
    return binary("≠", left, right)


def negated(part: Json) -> Json:
    """Return whether something does not hold."""
    return not part if isinstance(part, bool) else {"op": "¬", "exp": part}


def conjunction(parts: Iterable[Json]) -> Json:
    """Return whether all parts hold."""
    return _joined("∧", parts, neutral=True)


def disjunction(parts: Iterable[Json]) -> Json:
    """Return whether some part holds."""
    return _joined("\N{LOGICAL OR}", parts, neutral=False)


def _joined(op: str, parts: Iterable[Json], *, neutral: bool) -> Json:
    found = [part for part in parts if part is not neutral]
    if (not neutral) in (part for part in found if isinstance(part, bool)):
        return not neutral
    return _balanced(found, lambda left, right: binary(op, left, right)) if found else neutral


def total(parts: Iterable[Json]) -> Json:
    """Return the sum of some numbers."""
    found = list(parts)
    return _balanced(found, lambda left, right: binary("+", left, right)) if found else 0


def _balanced(parts: list[Json], join: Callable[[Json, Json], Json]) -> Json:
    """Join parts in their order; a tree, as readers are recursive and their stacks are limited."""
    while len(parts) > 1:
        pairs = [parts[n : n + 2] for n in range(0, len(parts), 2)]
        parts = [reduce(join, pair) for pair in pairs]
    return parts[0]


def choice(condition: Json, then: Json, otherwise: Json) -> Json:
    """Return one of two values."""
    return {"op": "ite", "if": condition, "then": then, "else": otherwise}


def call(function: str, *arguments: Json) -> Json:
    """Return the value of a function of the model."""
    return {"op": "call", "function": function, "args": list(arguments)}


def bounded(greatest: int) -> Json:
    """Return the type of the numbers from 0 on."""
    return {"kind": "bounded", "base": "int", "lower-bound": 0, "upper-bound": greatest}
