"""Pieces of C expressions: how they are written, how tightly they bind, which C type they have."""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.diagnostics.fast_init import fast_init

CHOICE, OR, AND, BITS, COMPARE, SHIFT, SUM, PRODUCT, PREFIX, ATOM = range(1, 11)
COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
LEVEL = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "%": PRODUCT}


@fast_init
@dataclass(frozen=True, slots=True)
class Fragment:
    """Printed text, how tightly it binds, its C type."""

    text: str
    ctype: str
    binds: int = ATOM
    name: str = ""
    """Of a constant: the macro that stands for the text."""
    number: int | None = None
    """The value of a constant without a suffix: of type ``int`` if it fits, whatever is meant."""

    def at(self, binds: int) -> str:
        """Return the text, in parentheses unless it binds that tightly."""
        if self.name:
            return self.name
        return self.text if self.binds >= binds else f"({self.text})"


def apart(text: str) -> str:
    """Return an operand that does not melt into a sign before it: ``--x`` counts down."""
    return f"({text})" if text.startswith("-") else text


def result_type(ctype: str) -> str:
    """Return the C type that a function of the library gives for operands of a C type."""
    return "int32_t" if ctype == "int" else ctype


def floating(value: float) -> str:
    """Spell a double, exactly; infinities and NaN as quotients."""
    if value != value:
        return "(0.0 / 0.0)"
    if value in (float("inf"), float("-inf")):
        return "(1.0 / 0.0)" if value > 0 else "(-1.0 / 0.0)"
    text = repr(value)
    return text if any(char in text for char in ".en") else f"{text}.0"
