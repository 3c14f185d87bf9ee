"""Expressions in methods of a model."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.codegen.python.expressions import Printer
from fsmkit.codegen.transitions.names import ModelNames
from fsmkit.language import Call, Convert, EventField, EventName, InState, Overflow
from fsmkit.language.printing import Fragment
from fsmkit.plan.values import bounding


@dataclass(frozen=True, slots=True)
class ModelPrinter(Printer):
    """Prints expressions; ``payload``: the position of each field among the event's arguments."""

    model: ModelNames | None = None

    def event_field(self, expr: EventField) -> Fragment:
        """Print an argument of the current event."""
        if self.payload is None:
            return Printer.event_field(self, expr)
        return Fragment(f"event.args[{self.payload[expr.name]}]")

    def event_name(self, expr: EventName) -> Fragment:  # noqa: ARG002
        """Print the name of the current event."""
        return Fragment("event.event.name")

    def in_state(self, expr: InState) -> Fragment:
        """Print a state test."""
        if self.model is None:
            return Printer.in_state(self, expr)
        return Fragment(f"self.is_in({self.model.quoted(expr.state)})")

    def convert(self, expr: Convert) -> Fragment:
        """Print a converted value; saturation cannot occur, since such charts are rejected."""
        how = bounding(expr)
        is_within = how is not None and how.overflow is Overflow.SATURATE
        return self.fragment(expr.operand) if is_within else Printer.convert(self, expr)

    def call(self, expr: Call) -> Fragment:
        """Print a call of an operation."""
        passed = ", ".join(map(self.frozen, expr.arguments))
        return Fragment(f"self.{self.names.operations[expr.operation]}({passed})")
