"""Guards as decisions, and the conditions that tests have shown to decide (masking MC/DC).

A condition is an operand of ``and``, ``or``, ``not`` without these operators. The criterion is
that of J. J. Chilenski, An Investigation of Three Forms of the Modified Condition Decision
Coverage (MCDC) Criterion, DOT/FAA/AR-01/18. A condition is covered if it was observed true and
false, each time unmasked: with the other operands such that the decision would change with it.
Operands skipped by short-circuit evaluation mask nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from fsmkit.chart.analysis.decisions import MOST_CONDITIONS, Outcomes, Shape
from fsmkit.language import Environment, Expr, evaluate


def observe(
    shape: Shape, conditions: tuple[Expr, ...], environment: Environment
) -> tuple[bool, Outcomes]:
    """Evaluate a guard, its parts in the order of `evaluate`; its errors go through."""
    seen: list[bool | None] = [None] * len(conditions)

    def see(number: int) -> bool:
        value = bool(evaluate(conditions[number], environment))
        seen[number] = value
        return value

    value = decided(shape, see)
    return value, tuple(seen)


def decided(shape: Shape, value: Callable[[int], bool]) -> bool:
    """Return the decision where conditions have these values; none is looked at needlessly."""
    if isinstance(shape, int):
        return value(shape)
    parts = (decided(operand, value) for operand in shape.operands)
    return not next(parts) if shape.op == "not" else all(parts) if shape.op == "and" else any(parts)


def deciding_conditions(shape: Shape, outcomes: Outcomes) -> frozenset[int]:
    """Return the conditions that alone would change the decision of these outcomes."""
    return frozenset(_unmasked(shape, outcomes))


def _unmasked(shape: Shape, outcomes: Outcomes) -> Iterator[int]:
    if isinstance(shape, int):
        if outcomes[shape] is not None:
            yield shape
        return
    decides = shape.op == "or"  # the value of an operand with which the other one decides nothing
    values = [_value(operand, outcomes) for operand in shape.operands]
    for place, operand in enumerate(shape.operands):
        others = values[:place] + values[place + 1 :]
        if all(other is not decides for other in others):
            yield from _unmasked(operand, outcomes)


def _value(shape: Shape, outcomes: Outcomes) -> bool | None:
    """Return the value of a part; None if it was not evaluated."""
    if isinstance(shape, int):
        return outcomes[shape]
    values = [_value(operand, outcomes) for operand in shape.operands]
    if shape.op == "not":
        return None if values[0] is None else not values[0]
    decides = shape.op == "or"
    return decides if decides in values else values[0] if values[0] is None else values[-1]


def covered_conditions(shape: Shape, count: int, seen: Iterable[Outcomes]) -> tuple[bool, ...]:
    """Return for each condition whether it was shown to decide; of many, if it had both values."""
    found: set[tuple[int, bool | None]] = set()
    for outcomes in seen:
        shown = range(count) if count > MOST_CONDITIONS else deciding_conditions(shape, outcomes)
        found |= {(number, outcomes[number]) for number in shown}
    return tuple({(n, True), (n, False)} <= found for n in range(count))


def stored_outcomes(outcomes: Outcomes) -> Iterator[Outcomes]:
    """Yield the stored outcomes of a decision: itself, or with many conditions each value alone."""
    if len(outcomes) <= MOST_CONDITIONS:
        yield outcomes
        return
    for number, value in enumerate(outcomes):
        if value is not None:
            yield tuple(value if n == number else None for n in range(len(outcomes)))


def numbers(shape: Shape) -> Iterator[int]:
    """Yield the conditions of a shape, from left to right."""
    if isinstance(shape, int):
        yield shape
        return
    for operand in shape.operands:
        yield from numbers(operand)


def is_whole(shape: Shape) -> bool:
    """Whether each operator has as many operands as it takes."""
    if isinstance(shape, int):
        return True
    return len(shape.operands) == (1 if shape.op == "not" else 2) and all(
        map(is_whole, shape.operands)
    )
