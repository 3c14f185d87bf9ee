"""Values brought into types."""

from __future__ import annotations

from fsmkit.expressions.tree import Expr
from fsmkit.expressions.types import Type, Value


def convert(expr: Expr, type_: Type) -> Expr:
    """Wrap an expression in `Convert` unless it provably fits the type."""
    raise NotImplementedError


def default_value(type_: Type) -> Value:
    """Return the start value of a variable that declares none."""
    raise NotImplementedError
