"""Expressions as methods of a model spell them."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.codegen.python.expressions import Fragment, Printer
from fsmkit.codegen.transitions.names import ModelNames
from fsmkit.language import Call, Convert, EventField, EventName, Expr, InState, IntType, Overflow


@dataclass(frozen=True, slots=True)
class ModelPrinter(Printer):
    """Prints expressions; ``payload``: the position of each field among the event's arguments."""

    model: ModelNames | None = None

    def fragment(self, expr: Expr) -> Fragment:
        """Return an expression as text that can stand inside more text."""
        match expr:
            case EventField(name) if self.payload is not None:
                return Fragment(f"event.args[{self.payload[name]}]")
            case EventName():
                return Fragment("event.event.name")
            case InState(state) if self.model is not None:
                return Fragment(f"self.is_in({self.model.quoted(state)})")
            case Convert(operand, IntType(overflow=Overflow.SATURATE)):
                return self.fragment(operand)  # it lies within, or the chart is refused
            case Call(operation, arguments):
                passed = ", ".join(self.frozen(argument) for argument in arguments)
                return Fragment(f"self.{self.names.operations[operation]}({passed})")
            case _:
                return Printer.fragment(self, expr)
