"""Pieces of C expressions: text, precedence and C type."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.diagnostics.fast_init import fast_init

CHOICE, OR, AND, BITS, COMPARE, SHIFT, SUM, PRODUCT, PREFIX, ATOM = range(1, 11)
COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
LEVEL = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "%": PRODUCT}


@fast_init
@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text, its precedence, its C type."""

    text: str
    ctype: str
    binds: int = ATOM
    name: str = ""
    """The macro whose expansion the text is, for a constant."""
    number: int | None = None
    """The value of a constant without a suffix, which C types as ``int`` if it fits."""

    def at(self, binds: int) -> str:
        """Return the text, in parentheses unless its precedence is at least ``binds``."""
        if self.name:
            return self.name
        return self.text if self.binds >= binds else f"({self.text})"


def apart(text: str) -> str:
    """Return an operand that does not join with a sign before it: ``--x`` is a decrement."""
    return f"({text})" if text.startswith("-") else text


def result_type(ctype: str) -> str:
    """Return the C type in which a library function returns its result for operands of a type."""
    return "int32_t" if ctype == "int" else ctype


def floating(value: float) -> str:
    """Format a double exactly; infinities and NaN as quotients."""
    if value != value:
        return "(0.0 / 0.0)"
    if value in (float("inf"), float("-inf")):
        return "(1.0 / 0.0)" if value > 0 else "(-1.0 / 0.0)"
    text = repr(value)
    return text if any(char in text for char in ".en") else f"{text}.0"
