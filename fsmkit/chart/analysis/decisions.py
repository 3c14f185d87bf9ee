"""Guards as decisions of conditions.

A condition is an operand of ``and``, ``or``, ``not`` without such an operator in it. The paths
through a decision are numbered as by T. Ball and J. R. Larus (Efficient Path Profiling, MICRO
1996). A false condition adds the number of paths that continue where it is true. The sum over a
path is its number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fsmkit.language import Binary, BinaryOp, Expr, Unary, UnaryOp

MOST_CONDITIONS = 8
"""The most conditions of a decision with recorded vectors; above, each condition counts alone."""


@dataclass(frozen=True, slots=True)
class Node:
    """``and``, ``or`` or ``not`` over conditions, which are numbered from left to right."""

    op: Literal["and", "or", "not"]
    operands: tuple[Shape, ...]


Shape = Node | int
Outcomes = tuple[bool | None, ...]
"""The value of each condition; None: it was not evaluated."""
NAMES: dict[BinaryOp, Literal["and", "or"]] = {BinaryOp.AND: "and", BinaryOp.OR: "or"}


def shape_of(guard: Expr) -> tuple[Shape, tuple[Expr, ...]]:
    """Return a guard as a shape, and its conditions."""
    conditions: list[Expr] = []

    def shape(expr: Expr) -> Shape:
        match expr:
            case Binary(op, left, right) if op in NAMES:
                return Node(NAMES[op], (shape(left), shape(right)))
            case Unary(UnaryOp.NOT, operand):
                return Node("not", (shape(operand),))
            case _:
                conditions.append(expr)
                return len(conditions) - 1

    return shape(guard), tuple(conditions)


@dataclass(frozen=True, slots=True)
class DecisionPaths:
    """The paths that an evaluation can take through a decision."""

    missed: tuple[int, ...]
    """By condition, the number that it adds to the path number if it is false."""
    outcomes: tuple[Outcomes, ...]
    """The values of the conditions, by path number."""
    results: tuple[bool, ...] = ()
    """The value of the decision, by path number."""


def decision_paths(shape: Shape, count: int) -> DecisionPaths:
    """Return the paths through a decision of ``count`` conditions, at most `MOST_CONDITIONS`."""
    missed = [0] * count
    end: tuple[Outcomes, ...] = ((None,) * count,)

    def through(
        part: Shape, true: tuple[Outcomes, ...], false: tuple[Outcomes, ...]
    ) -> tuple[Outcomes, ...]:
        """Return the paths from a part on; those after it are `true` or `false`, by its value."""
        if isinstance(part, int):
            missed[part] = len(true)
            return (*_with(true, part, value=True), *_with(false, part, value=False))
        if part.op == "not":
            return through(part.operands[0], false, true)
        left, right = part.operands
        after = through(right, true, false)
        return through(left, after, false) if part.op == "and" else through(left, true, after)

    outcomes = through(shape, end, end)
    return DecisionPaths(tuple(missed), outcomes, tuple(_value(shape, path) for path in outcomes))


def _value(part: Shape, outcomes: Outcomes) -> bool:
    """Return the value of a decision whose conditions have the values `outcomes`."""
    if isinstance(part, int):
        return bool(outcomes[part])
    values = (_value(operand, outcomes) for operand in part.operands)
    if part.op == "not":
        return not next(values)
    return all(values) if part.op == "and" else any(values)


def _with(paths: tuple[Outcomes, ...], place: int, *, value: bool) -> tuple[Outcomes, ...]:
    return tuple((*path[:place], value, *path[place + 1 :]) for path in paths)
