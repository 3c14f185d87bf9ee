"""From text to the typed tree."""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Text
from fsmkit.expressions.scope import Scope
from fsmkit.expressions.tree import Call, Expr, Location
from fsmkit.expressions.types import Type


def type_expression(
    text: Text, scope: Scope, findings: Findings, expected: Type | None = None
) -> Expr | None:
    """Read and type an expression; with ``expected`` it is converted to exactly that type."""
    raise NotImplementedError


def type_location(text: Text, scope: Scope, findings: Findings) -> Location | None:
    """Read and type what an assignment writes."""
    raise NotImplementedError


def type_call(text: Text, scope: Scope, findings: Findings) -> Call | None:
    """Read and type a call of an operation for its effect."""
    raise NotImplementedError
