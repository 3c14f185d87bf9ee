"""Operators in C on printed operands: C types, and no undefined behaviour.

Where C has no operator of that meaning, a helper is called. A failure sets ``m->fsm.failed``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import fsmkit.language as lang
from fsmkit.chart.analysis.effects import is_never_zero
from fsmkit.codegen.c.expressions.fragments import (
    BITS,
    COMPARE,
    COMPARISONS,
    LEVEL,
    PREFIX,
    PRODUCT,
    SHIFT,
    Fragment,
    result_type,
)
from fsmkit.codegen.c.expressions.types import (
    COMPUTED,
    SUFFIX,
    UNSIGNED,
    computed,
    integer,
    interval,
    wrapping,
)
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.emit.identifiers import legal
from fsmkit.plan.values import Bounding

QUOTIENTS = {lang.BinaryOp.DIV: "div", lang.BinaryOp.REM: "rem"}


@dataclass
class Operators:
    """Prints operators; collects the temporaries they need.

    ``events``: those that can be current; ``is_sound``: no printed operator can fail.
    """

    names: Names
    events: tuple[int, ...] = ()
    temporaries: list[tuple[str, str]] = field(default_factory=list)
    is_sound: bool = False
    locals: dict[str, str] = field(default_factory=dict)
    """C names of the local variables in scope."""
    reads_machine: bool = False
    """Whether the printed text refers to the machine."""

    @property
    def machine(self) -> str:
        """The expression for the machine."""
        self.reads_machine = True
        return "m"

    def failure(self) -> str:
        """Return the address at which a failing operator notes it."""
        return self.names.failure()

    def cast(self, fragment: Fragment, ctype: str) -> str:
        """Return a fragment cast to another C type; its values are known to fit."""
        if fragment.ctype == ctype or ctype == "bool":
            return fragment.text
        value = fragment.number
        if value is not None and ctype != "double":
            if fragment.name:
                return f"({ctype}){fragment.name}" if ctype in COMPUTED else fragment.name
            if ctype in COMPUTED:
                return integer(value, ctype)
            return fragment.text + ("u" if ctype.startswith("u") else "")
        return f"({ctype}){fragment.at(PREFIX)}"

    def temporary(self, fragment: Fragment) -> Fragment:
        """Return a new variable of the type of a fragment."""
        name = f"t{len(self.temporaries)}"
        self.temporaries.append((fragment.ctype, name))
        return Fragment(name, fragment.ctype)

    def local(self, variable: lang.Variable) -> str:
        """Declare a local variable; return its C name."""
        taken = {name for _, name in self.temporaries}
        name = wanted = f"let_{legal(variable.name)}"
        number = 1
        while name in taken:
            number += 1
            name = f"{wanted}_{number}"
        self.temporaries.append((storage(variable.type, self.names.records).text, name))
        self.locals[variable.name] = name
        return name

    def operator(self, expr: lang.Binary, left: Fragment, right: Fragment) -> Fragment:
        """Print a binary operator that evaluates both operands."""
        op = expr.op.value
        if isinstance(expr.left.type, lang.FloatType):
            a, b = left.at(PREFIX), right.at(PREFIX)
            if op in COMPARISONS:
                return Fragment(f"{a} {op} {b}", "bool", COMPARE)
            return Fragment(f"{a} {op} {b}", "double", LEVEL[op])
        if op in COMPARISONS:
            return self._compare(expr, left, right)
        assert isinstance(expr.type, lang.IntType)  # noqa: S101
        if expr.type.overflow is lang.Overflow.WRAP:
            return self._wrapping(expr, left, right, expr.type)
        return self._exact(expr, left, right, expr.type)

    def _compare(self, expr: lang.Binary, left: Fragment, right: Fragment) -> Fragment:
        if isinstance(expr.left.type, lang.BoolType):
            return Fragment(f"{left.at(SHIFT)} {expr.op.value} {right.at(SHIFT)}", "bool", COMPARE)
        spans = interval(expr.left.type), interval(expr.right.type)
        if computed(*spans) is None:
            return self._compare_widest(expr.op, left, right)
        ctype = self.common(*spans)
        if all(side.ctype == "uint16_t" or _is_constant(side) for side in (left, right)) and all(
            span.lo >= 0 for span in spans
        ):
            a, b = left.at(SHIFT), right.at(SHIFT)
        else:
            a, b = self.as_type(left, ctype, SHIFT), self.as_type(right, ctype, SHIFT)
        if _is_complement(expr.left) or _is_complement(expr.right):
            # gcc looks through casts, and warns where the complement is of a shorter type
            first, second = (self.temporary(Fragment("", ctype)).text for _ in range(2))
            test = f"{first} {expr.op.value} {second}"
            return Fragment(f"({first} = {a}, {second} = {b}, {test})", "bool")
        return Fragment(f"{a} {expr.op.value} {b}", "bool", COMPARE)

    def _compare_widest(self, op: lang.BinaryOp, left: Fragment, right: Fragment) -> Fragment:
        """Compare a uint64_t with a value that may be negative, for which C has no common type."""
        signed = self.temporary(Fragment("", "int64_t"))
        if left.ctype == "uint64_t":
            before = f"{signed.text} = {self.cast(right, 'int64_t')}"
            is_so = op in (lang.BinaryOp.GT, lang.BinaryOp.GE, lang.BinaryOp.NE)
            test = f"{left.at(SHIFT)} {op.value} (uint64_t){signed.text}"
        else:
            before = f"{signed.text} = {self.cast(left, 'int64_t')}"
            is_so = op in (lang.BinaryOp.LT, lang.BinaryOp.LE, lang.BinaryOp.NE)
            test = f"(uint64_t){signed.text} {op.value} {right.at(SHIFT)}"
        negative = f"{signed.text} < 0 || " if is_so else f"{signed.text} >= 0 && "
        return Fragment(f"({before}, {negative}{test})", "bool")

    def _exact(
        self, expr: lang.Binary, left: Fragment, right: Fragment, type_: lang.IntType
    ) -> Fragment:
        op = expr.op
        ctype = self.common(type_, interval(expr.left.type), interval(expr.right.type))
        a, b = self.as_type(left, ctype), self.as_type(right, ctype)
        if op in QUOTIENTS:
            if is_never_zero(expr.right) and -1 not in interval(expr.right.type):
                return Fragment(f"{a} {op.value} {b}", ctype, PRODUCT)
            return self._quotient(op, a, b, ctype)
        if op is lang.BinaryOp.SHIFT_LEFT:
            unsigned = UNSIGNED[ctype]
            shifted = f"({unsigned}){a} << {self.as_type(right, 'uint32_t')}"
            return Fragment(f"({ctype})({shifted})", ctype, PREFIX)
        if op is lang.BinaryOp.SHIFT_RIGHT:
            return self._shift_right(a, self.as_type(right, "uint32_t"), ctype)
        if op in (lang.BinaryOp.BIT_AND, lang.BinaryOp.BIT_OR, lang.BinaryOp.BIT_XOR):
            if ctype == "int":
                ctype = "int32_t"  # bits beyond the 16 that every int has
                a, b = self.as_type(left, ctype), self.as_type(right, ctype)
            return Fragment(f"{a} {op.value} {b}", ctype, BITS)
        return Fragment(f"{a} {op.value} {b}", ctype, LEVEL[op.value])

    def _wrapping(
        self, expr: lang.Binary, left: Fragment, right: Fragment, type_: lang.IntType
    ) -> Fragment:
        op = expr.op
        ctype = wrapping(type_)
        unsigned = UNSIGNED[ctype]
        if op in QUOTIENTS:
            return self._quotient(op, self.as_type(left, ctype), self.as_type(right, ctype), ctype)
        if op in (lang.BinaryOp.SHIFT_LEFT, lang.BinaryOp.SHIFT_RIGHT):
            mask = 31 if unsigned == "uint32_t" else 63
            wide = UNSIGNED.get(right.ctype, "uint32_t")
            count = f"((uint32_t){self.as_type(right, wide)} & {mask}u)"
            if op is lang.BinaryOp.SHIFT_RIGHT:
                return self._shift_right(self.as_type(left, ctype), count, ctype)
            shifted = self.as_type(left, unsigned)
            if _is_constant(left):  # `1u` may have 16 bits, all of which a shift moves out
                shifted = f"({unsigned}){shifted}"
            return self.recast(Fragment(f"{shifted} << {count}", unsigned, SHIFT), ctype)
        a, b = self.as_type(left, unsigned), self.as_type(right, unsigned)
        binds = LEVEL.get(op.value, BITS)
        return self.recast(Fragment(f"{a} {op.value} {b}", unsigned, binds), ctype)

    def _quotient(self, op: lang.BinaryOp, a: str, b: str, ctype: str) -> Fragment:
        name = f"fsm_{QUOTIENTS[op]}_{SUFFIX[ctype]}"
        return Fragment(f"{name}({self.failure()}, {a}, {b})", result_type(ctype))

    def _shift_right(self, a: str, count: str, ctype: str) -> Fragment:
        if ctype.startswith("u"):
            return Fragment(f"{a} >> {count}", ctype, SHIFT)
        return Fragment(f"fsm_asr_{SUFFIX[ctype]}({a}, {count})", result_type(ctype))

    def recast(self, fragment: Fragment, ctype: str) -> Fragment:
        """Return a value in another C type that holds it."""
        if fragment.ctype == ctype:
            return fragment
        return Fragment(f"({ctype}){fragment.at(PREFIX)}", ctype, PREFIX)

    def common(self, *types: lang.IntType) -> str:
        """Return the C type to compute in."""
        return computed(*types) or "int64_t"

    def as_type(self, fragment: Fragment, ctype: str, binds: int = PREFIX) -> str:
        """Return an operand in another C type, in parentheses if its precedence is too low."""
        if fragment.ctype == ctype:
            return fragment.at(binds)
        text = self.cast(fragment, ctype)
        return text if text.lstrip("(").startswith(ctype) or text[-1:].isalnum() else f"({text})"

    def as_double(self, fragment: Fragment) -> str:
        """Return an operand as a double."""
        return (
            fragment.at(PREFIX) if fragment.ctype == "double" else f"(double){fragment.at(PREFIX)}"
        )

    def bounded(self, fragment: Fragment, how: Bounding) -> Fragment:
        """Return a value brought into its bounds, by the given method."""
        lo, hi, overflow = how.lo, how.hi, how.overflow
        ctype = computed(lang.IntType(lo, hi)) or "int64_t"
        if how.truncates:
            is_silent = overflow is lang.Overflow.NEAREST
            call = "fsm_whole(" if is_silent else self._bounding(overflow, "_f")
            low, high = integer(lo, "int64_t"), integer(min(hi, 2**63 - 1), "int64_t")
            return Fragment(f"({ctype}){call}{fragment.at(PREFIX)}, {low}, {high})", ctype, PREFIX)
        if overflow is lang.Overflow.WRAP:
            unsigned = {8: "uint8_t", 16: "uint16_t", 32: "uint32_t", 64: "uint64_t"}
            bits = (hi - lo + 1).bit_length() - 1
            if hi - lo + 1 == 1 << bits and bits in unsigned and lo in (0, -(1 << (bits - 1))):
                narrow = unsigned[bits] if lo == 0 else unsigned[bits][1:]
                # to 64 bits at once: a negative int as uint32_t would lose its sign
                wide = unsigned[64] if bits == 64 else UNSIGNED.get(fragment.ctype, "uint32_t")
                inner = self.as_type(fragment, wide)
                inner = inner if wide == unsigned[bits] else f"({unsigned[bits]}){inner}"
                text = inner if narrow == unsigned[bits] else f"({narrow}){inner}"
                return self.recast(Fragment(text, narrow, PREFIX), ctype)
            if fragment.ctype == "uint64_t":  # what lies beyond int64_t would change its remainder
                rest = f"{fragment.at(PRODUCT)} % {integer(hi - lo + 1, 'uint64_t')}"
                fragment = Fragment(rest, "uint64_t", PRODUCT)
            text = (
                f"fsm_wrap({self.cast(fragment, 'int64_t')}, "
                f"{integer(lo, 'int64_t')}, {integer(hi, 'int64_t')})"
            )
            return Fragment(f"({ctype}){text}", ctype, PREFIX)
        if fragment.ctype == "uint64_t" or hi > 2**63 - 1:
            unsigned_value = self.cast(fragment, "uint64_t")
            below = f"{fragment.at(COMPARE)} < 0" if fragment.ctype != "uint64_t" else "false"
            text = (
                f"{self._bounding(overflow, '_u')}{below}, {unsigned_value}, "
                f"{integer(max(lo, 0), 'uint64_t')}, {integer(hi, 'uint64_t')})"
            )
            return Fragment(f"({ctype}){text}", ctype, PREFIX)
        text = (
            f"{self._bounding(overflow)}{self.cast(fragment, 'int64_t')}, "
            f"{integer(lo, 'int64_t')}, {integer(hi, 'int64_t')})"
        )
        return Fragment(f"({ctype}){text}", ctype, PREFIX)

    def _bounding(self, overflow: lang.Overflow, suffix: str = "") -> str:
        """Return the start of a call that brings a value into a range."""
        if overflow is lang.Overflow.NEAREST:
            return f"fsm_nearest{suffix}("
        if overflow is lang.Overflow.FAULT:
            return f"fsm_within{suffix}({self.failure()}, "
        self.names.used.add(f"clamp{suffix}")
        return f"{self.names.own}_clamp{suffix}({self.machine}, "


def _is_constant(fragment: Fragment) -> bool:
    """Whether a fragment is a literal without a sign, which a cast cannot change."""
    return fragment.number is not None and fragment.number >= 0


def _is_complement(expr: lang.Expr) -> bool:
    """Whether an operand is a bitwise complement, possibly converted."""
    while isinstance(expr, lang.Convert):
        expr = expr.operand
    return isinstance(expr, lang.Unary) and expr.op is lang.UnaryOp.INVERT
