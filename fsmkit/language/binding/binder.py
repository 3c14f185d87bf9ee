"""What the parts of binding need of the whole: a recursion that types the operands of a node."""

from __future__ import annotations

from typing import Protocol

from fsmkit.diagnostics import Span, Text
from fsmkit.language.names import Context
from fsmkit.language.syntax import Node
from fsmkit.language.tree import Expr
from fsmkit.language.types import Type


class Binder(Protocol):
    """Types the nodes of one text. `fsmkit.language.binding.expressions` implements it."""

    @property
    def context(self) -> Context:
        """The scope in which names are looked up, and the findings."""
        ...

    @property
    def text(self) -> Text:
        """The text that is read."""
        ...

    def span(self, node: Node) -> Span:
        """Return the location of a node."""
        ...

    def value(self, node: Node, hint: Type | None = None) -> Expr | None:
        """Type a node that must have a value; None after reporting an error."""
        ...

    def quotient(self, node: Node) -> Expr | None:
        """Type ``a / b`` of integers as their truncating division; None for other nodes."""
        ...
