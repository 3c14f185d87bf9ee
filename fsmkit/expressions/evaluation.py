"""The meaning of expressions: the reference every target is compared with."""

from __future__ import annotations

from fsmkit.expressions.environment import Environment
from fsmkit.expressions.tree import Expr, Location
from fsmkit.expressions.types import Value


def evaluate(expr: Expr, env: Environment) -> Value:
    """Return the value of an expression."""
    raise NotImplementedError


def store(old_root_value: Value, location: Location, value: Value, env: Environment) -> Value:
    """Return the new value of the whole variable that a location is part of."""
    raise NotImplementedError


def fold(expr: Expr) -> Expr:
    """Return the expression with its constant parts computed."""
    raise NotImplementedError
