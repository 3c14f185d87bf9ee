"""Conditions and numbers of models as trees: JANI's own objects, which `infix` prints.

https://jani-spec.org: ``op`` is a mathematical sign; a string is a name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce

Json = dict[str, "Json"] | list["Json"] | str | int | bool | None
"""A value of a JSON document."""
SIGNS = {
    "∨": ("||", 1),  # noqa: RUF001  (JANI's sign)
    "∧": ("&&", 1),
    "=": ("==", 2),
    "≠": ("!=", 2),
    "≤": ("<=", 2),
    "+": ("+", 3),
    "¬": ("!", 4),
}
"""How a language like C writes an operator, and how tightly it binds."""


def binary(op: str, left: Json, right: Json) -> Json:
    """Return an expression of two parts."""
    return {"op": op, "left": left, "right": right}


def equal(left: Json, right: Json) -> Json:
    """Return the comparison of two numbers for equality."""
    return binary("=", left, right)


def differ(left: Json, right: Json) -> Json:
    """Return the comparison of two numbers for inequality."""
    return binary("≠", left, right)


def negation(part: Json) -> Json:
    """Return the negation."""
    match part:
        case bool():
            return not part
        case {"op": "=", "left": left, "right": right}:
            return differ(left, right)
        case _:
            return {"op": "¬", "exp": part}


def conjunction(parts: Iterable[Json]) -> Json:
    """Return the conjunction of all parts."""
    return _join("∧", parts, neutral=True)


def disjunction(parts: Iterable[Json]) -> Json:
    """Return the disjunction of all parts."""
    return _join("∨", parts, neutral=False)  # noqa: RUF001  (JANI's sign)


def _join(op: str, parts: Iterable[Json], *, neutral: bool) -> Json:
    found = [part for part in parts if part is not neutral]
    if (not neutral) in (part for part in found if isinstance(part, bool)):
        return not neutral
    return _balanced_tree(found, lambda left, right: binary(op, left, right)) if found else neutral


def total(parts: Iterable[Json]) -> Json:
    """Return the sum of some numbers."""
    found = list(parts)
    return _balanced_tree(found, lambda left, right: binary("+", left, right)) if found else 0


def _balanced_tree(parts: list[Json], join: Callable[[Json, Json], Json]) -> Json:
    """Join parts in their order as a balanced tree: readers are recursive, with limited stacks."""
    while len(parts) > 1:
        pairs = [parts[n : n + 2] for n in range(0, len(parts), 2)]
        parts = [reduce(join, pair) for pair in pairs]
    return parts[0]


def choice(condition: Json, then: Json, otherwise: Json) -> Json:
    """Return one of two values."""
    return {"op": "ite", "if": condition, "then": then, "else": otherwise}


def call(function: str) -> Json:
    """Return the value of a function of the model."""
    return {"op": "call", "function": function, "args": []}


def infix(term: Json, outer: str = "") -> str:
    """Return an expression in Promela; functions are macros, in capital letters.

    ``outer``: the operator of which it is an operand.
    """
    match term:
        case {"op": "ite", "if": test, "then": then, "else": otherwise}:
            return f"({infix(test)} -> {infix(then)} : {infix(otherwise)})"
        case {"op": "call", "function": str(name)}:
            return name.upper()
        case {"op": "¬", "exp": part}:
            return f"!{infix(part, '¬')}"
        case {"op": str(op), "left": left, "right": right}:
            sign, binds = SIGNS[op]
            text = f"{infix(left, op)} {sign} {infix(right, op)}"
            is_loose = outer not in ("", op) and binds <= SIGNS[outer][1]
            return f"({text})" if is_loose else text
        case bool():
            return "true" if term else "false"
        case _:
            return str(term)
