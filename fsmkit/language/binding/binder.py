"""The interface between the parts of binding: a recursion that types the operands of a node."""

from __future__ import annotations

from typing import Protocol

from fsmkit.diagnostics import Span, Text
from fsmkit.language.names import Context
from fsmkit.language.syntax import Node
from fsmkit.language.tree import Expr
from fsmkit.language.types import Type


class Binder(Protocol):
    """Types the nodes of one expression. `fsmkit.language.binding.expressions` implements it."""

    @property
    def context(self) -> Context:
        """The scope for looking up names, and the findings."""
        ...

    @property
    def text(self) -> Text:
        """The source of the expression."""
        ...

    def span(self, node: Node) -> Span:
        """Return the location of a node."""
        ...

    def value(self, node: Node, hint: Type | None = None) -> Expr | None:
        """Type a node that must have a value; return None after reporting an error."""
        ...

    def quotient(self, node: Node) -> Expr | None:
        """Type ``a / b`` of integers as truncating division; return None for other nodes."""
        ...
