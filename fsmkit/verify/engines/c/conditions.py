"""Conditions of properties in C, printed as the machine itself prints its expressions.

What cannot be evaluated notes so in ``failed``, and a value that leaves its range is brought back
silently: a condition has no machine that could report it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import fsmkit.language as lang
from fsmkit.codegen.c.expressions.expressions import Printer
from fsmkit.codegen.c.expressions.fragments import Fragment
from fsmkit.plan.values import Bounding
from fsmkit.verify.engines.c.condition_functions import Helpers


@dataclass(kw_only=True)
class ConditionPrinter(Printer):
    """Prints conditions; ``access`` returns variables, ``test`` whether a state is active."""

    access: Callable[[lang.Variable], str]
    test: Callable[[int], str]
    helpers: Helpers

    def inside(self, names: Mapping[str, str]) -> ConditionPrinter:
        """Return a printer for the body of a function, which has names of its own."""

        def access(variable: lang.Variable) -> str:
            return names.get(variable.name) or self.access(variable)

        return ConditionPrinter(self.names, access=access, test=self.test, helpers=self.helpers)

    def failure(self) -> str:
        """Return the address at which a failing operator notes it."""
        return "&failed"

    def place(self, expr: lang.Expr) -> str:
        """Return the C text of a variable or of a part of one."""
        return self.access(expr) if isinstance(expr, lang.Variable) else super().place(expr)

    def literal(self, expr: lang.Literal) -> Fragment:
        """Print a constant by its number: names of constants and members belong to one machine."""
        if isinstance(expr.type, lang.EnumType) and isinstance(expr.value, int):
            return self.constant(expr.value, lang.IntType(expr.value, expr.value))
        return self.constant(expr.value, expr.type)

    def in_state(self, expr: lang.InState) -> Fragment:
        """Print a state test."""
        return Fragment(self.test(expr.state), "bool")

    def call_function(self, expr: lang.CallFunction) -> Fragment:
        """Print a call of a function of the chart."""
        return self.loaded(self.helpers.call(expr, self), expr.type)

    def call(self, expr: lang.Call) -> Fragment:  # noqa: ARG002
        """Print a failure: no condition calls the host."""
        return Fragment("fsm_fails(&failed)", "bool")

    def bounded(self, fragment: Fragment, how: Bounding) -> Fragment:
        """Bring a value into bounds, without a report."""
        if how.overflow is lang.Overflow.SATURATE:
            how = replace(how, overflow=lang.Overflow.NEAREST)
        return super().bounded(fragment, how)
