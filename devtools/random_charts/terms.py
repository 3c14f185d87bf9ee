"""Random expressions of the action language as source, typed by construction.

The interval of each integer term is at least as wide as the inferred one, and far from the bounds
of int64, so that no term is rejected for leaving them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import fsmkit.language as lang
from devtools.random_charts.choices import Choices
from devtools.random_charts.vocabulary import (
    ATOM,
    COMPARE,
    PRODUCT,
    SUM,
    UNARY,
    Names,
    Operation,
    Term,
    common,
    exact,
    hull,
    is_machine,
    literal,
    near,
)
from fsmkit.language.arithmetic import interval

ARITHMETIC = {op.value: op for op in (lang.BinaryOp.ADD, lang.BinaryOp.SUB, lang.BinaryOp.MUL)}
LEVEL = lang.EnumType("Level", ("low", "mid", "high"), (-3, 2, 40))
"""An enumeration whose numbers do not count from 0, of charts with functions."""
BITS = {
    op.value: op
    for op in (
        lang.BinaryOp.BIT_AND,
        lang.BinaryOp.BIT_OR,
        lang.BinaryOp.BIT_XOR,
        lang.BinaryOp.SHIFT_LEFT,
        lang.BinaryOp.SHIFT_RIGHT,
    )
}


@dataclass(frozen=True)
class Terms:
    """Makes random expressions over some names."""

    choices: Choices
    names: Names = field(default_factory=Names)

    def value(self, type_: lang.Type, depth: int = 2) -> str:
        """Return an expression that can be stored in a type."""
        match type_:
            case lang.BoolType():
                return self.boolean(depth)
            case lang.IntType():
                return self.stored_integer(type_, depth)
            case lang.FloatType():
                return self.floating(depth)
            case lang.EnumType() | lang.SymbolType():
                if type_ == LEVEL and self.choices.chance(50):
                    whole = [v for v in self.names.of(lang.IntType) if v.is_exact]
                    if whole and self.choices.chance(40):  # perhaps the number of no member
                        return f"Level({self.choices.pick(whole).name})"
                    other = f"Level.{self.choices.pick(LEVEL.members)}"
                    return f"Level({self.plain.integer(min(depth, 1)).text}, {other})"
                same = self.same(type_)
                if same and self.choices.chance(40):
                    return self.choices.pick(same)
                return literal(self.choices, type_)
            case lang.DurationType():
                return self.duration()
            case lang.ArrayType() | lang.RecordType():  # a variable of it is declared
                return self.choices.pick(self.same(type_))

    @property
    def plain(self) -> Terms:
        """Return a generator of expressions without function calls, so that they end."""
        return Terms(self.choices, replace(self.names, functions=()))

    def duration(self) -> str:
        """Return a span of time, never 0."""
        known = self.same(lang.DurationType())
        if not known or self.choices.chance(40):
            return literal(self.choices, lang.DurationType())
        chosen = self.choices.pick(known)
        return f"{chosen} + 5ms" if self.choices.chance(30) else chosen

    def parts(self, type_: lang.Type) -> tuple[str, ...]:
        """Return the parts of records that have exactly that type."""
        return tuple(name for name, part in self._all_parts() if part == type_)

    def _all_parts(self) -> Iterator[tuple[str, lang.Type]]:
        """Yield each part of a record with its type: of variables, and of the current event."""
        records = [(v.name, v.type) for v in self.names.variables]
        records += [(f"event.{f.name}", f.type) for f in self.names.fields]
        for name, type_ in records:
            if isinstance(type_, lang.RecordType):
                yield from ((f"{name}.{part.name}", part.type) for part in type_.fields)

    def same(self, type_: lang.Type) -> tuple[str, ...]:
        """Return the terms of exactly that type."""
        own = tuple(v.name for v in self.names.variables if v.type == type_) + self.parts(type_)
        return own + tuple(f"event.{f.name}" for f in self.names.fields if f.type == type_)

    def stored_integer(self, type_: lang.IntType, depth: int) -> str:
        """Return an integer expression some of whose values lie within the type."""
        term = self.integer(depth)
        if self.names.of(lang.FloatType) and self.choices.chance(4):
            return self.floating(1)
        overlaps = term.type.lo <= type_.hi and type_.lo <= term.type.hi
        return term.text if overlaps else literal(self.choices, type_)

    # --- integers ---------------------------------------------------------------------------

    def integer(self, depth: int) -> Term:
        """Return an integer expression."""
        kind = self.choices.integer(0, 15) if depth > 0 else 0
        if kind <= 5:
            return self.integer_leaf()
        left = self.integer(depth - 1)
        if kind == 6:
            return self._negate(left)
        right = self.integer(depth - 1)
        match kind:
            case 7 | 8:
                return self._arithmetic(left, "+", right, SUM)
            case 9:
                return self._arithmetic(left, "-", right, SUM)
            case 10:
                return self._arithmetic(left, "*", right, PRODUCT)
            case 11 | 12:
                return self._divide(left, self.choices.pick(("/", "%")))
            case 13:
                return self._chosen(left, right, depth)
            case 14:
                return self._least(left, right)
            case _:
                return self._bits(left, right)

    def integer_leaf(self) -> Term:
        """Return a constant, a variable, an element or a field of the event."""
        if self.names.functions and self.choices.chance(30):
            return self._converted()
        leaves = [
            Term(v.name, v.type) for v in self.names.variables if isinstance(v.type, lang.IntType)
        ]
        leaves += [
            Term(f"event.{f.name}", f.type)
            for f in self.names.fields
            if isinstance(f.type, lang.IntType)
            for _ in range(2)
        ]
        leaves += [Term(name, exact(value, value)) for name, value in self.names.constants]
        leaves += [Term(n, part) for n, part in self._all_parts() if isinstance(part, lang.IntType)]
        leaves += [
            Term(f"len({v.name})", exact(v.type.length, v.type.length))
            for v in self.names.of(lang.ArrayType)
            if isinstance(v.type, lang.ArrayType)
        ]
        elements = [
            v
            for v in self.names.of(lang.ArrayType)
            if isinstance(v.type, lang.ArrayType) and isinstance(v.type.element, lang.IntType)
        ]
        kind = self.choices.integer(0, 9)
        if elements and kind == 9:
            array = self.choices.pick(elements)
            assert isinstance(array.type, lang.ArrayType)  # noqa: S101
            assert isinstance(array.type.element, lang.IntType)  # noqa: S101
            return Term(f"{array.name}[{self.index(array.type.length)}]", array.type.element)
        if not leaves or kind < 3:
            value = self.choices.integer(0, 12)
            return Term(str(value), exact(value, value))
        return self.choices.pick(leaves)

    def _converted(self) -> Term:
        """Return a call of a function, or a conversion."""
        levels, flags = self.same(LEVEL), self.same(lang.BoolType())
        spans, reals = self.same(lang.DurationType()), self.same(lang.FloatType())
        whole = [f for f in self.names.functions if isinstance(f.result, lang.IntType)]
        kind = self.choices.integer(0, 5)
        if kind == 1 and levels:
            return Term(f"int({self.choices.pick(levels)})", exact(*LEVEL.bounds))
        if kind == 2 and flags:
            return Term(f"int({self.choices.pick(flags)})", exact(0, 1))
        if kind == 3 and spans:
            name = self.choices.pick(("ms", "int"))
            return Term(f"{name}({self.choices.pick(spans)})", exact(0, lang.LONGEST_DURATION))
        if kind == 4 and reals:
            return Term(f"int({self.choices.pick(reals)})", lang.MACHINE_INTEGERS["int64"])
        numbers = self.names.of(lang.IntType)
        if not whole and not numbers:
            return self.plain.integer_leaf()
        if numbers and (kind == 5 or not whole):
            return Term(f"Percent({self.choices.pick(numbers).name})", exact(0, 100))
        function = self.choices.pick(whole)
        assert isinstance(function.result, lang.IntType)  # noqa: S101
        return Term(self.called(function), function.result)

    def index(self, length: int) -> str:
        """Return a position in an array: a constant within it, or a variable that may not be."""
        positions = [
            v.name
            for v in self.names.variables
            if isinstance(v.type, lang.IntType) and v.type.lo < length and v.type.hi >= 0
            if v.is_exact
        ]
        if positions and self.choices.chance(60):
            return self.choices.pick(positions)
        return str(self.choices.integer(0, length - 1))

    def _negate(self, term: Term) -> Term:
        sign = self.choices.pick(("-", "-", "~"))
        result: lang.IntType | None = exact(~term.type.hi, ~term.type.lo)
        if is_machine(term):
            result = common(term.type, term.type)
        elif sign == "-":
            result = exact(-term.type.hi, -term.type.lo)
        return term if result is None else Term(f"{sign}{term.at(ATOM)}", result, UNARY)

    def _arithmetic(self, left: Term, op: str, right: Term, binds: int) -> Term:
        if is_machine(left) or is_machine(right):
            result = common(left.type, right.type)
        else:
            result = interval(ARITHMETIC[op], left.type, right.type)
            result = result if result is not None and near(result) else None
        if result is None:
            return left
        return Term(f"{left.at(binds)} {op} {right.at(binds + 1)}", result, binds)

    def _divide(self, left: Term, op: str) -> Term:
        # a divisor that is always zero may be rejected: so it is a variable, or not zero
        divisors = [
            Term(v.name, v.type)
            for v in self.names.variables
            if isinstance(v.type, lang.IntType) and v.type.lo < v.type.hi and v.is_exact
        ]
        right = Term(str(n := self.choices.integer(1, 7)), exact(n, n))
        if divisors and self.choices.chance(50):
            right = self.choices.pick(divisors)
        if is_machine(left) or is_machine(right):
            result = common(left.type, right.type)
        else:
            # |a / b| <= |a| and |a % b| <= |a|
            most = max(abs(left.type.lo), abs(left.type.hi))
            result = exact(-most, most)
        if result is None:
            return left
        return Term(f"{left.at(PRODUCT)} {op} {right.at(ATOM)}", result, PRODUCT)

    def _chosen(self, left: Term, right: Term, depth: int) -> Term:
        if is_machine(left) or is_machine(right):
            result = common(left.type, right.type)
        else:
            result = hull(left.type, right.type)
        if result is None:
            return left
        test = self.boolean(depth - 1)
        if self.choices.chance(50):
            return Term(f"({left.at(COMPARE)} if ({test}) else {right.at(COMPARE)})", result)
        return Term(f"(({test}) ? {left.at(COMPARE)} : {right.at(COMPARE)})", result)

    def _least(self, left: Term, right: Term) -> Term:
        function = self.choices.pick(("min", "max", "abs"))
        if is_machine(left) or is_machine(right):
            return left
        if function == "abs":
            most = max(abs(left.type.lo), abs(left.type.hi))
            return Term(f"abs({left.text})", exact(0, most))
        return Term(f"{function}({left.text}, {right.text})", hull(left.type, right.type))

    def _bits(self, left: Term, right: Term) -> Term:
        op = self.choices.pick(tuple(BITS))
        if op in {"<<", ">>"}:
            count = self.choices.integer(0, 7)
            right = Term(str(count), exact(count, count))
        if is_machine(left) or is_machine(right):
            result = common(left.type, left.type if op in {"<<", ">>"} else right.type)
        else:
            result = interval(BITS[op], left.type, right.type)
        if result is None or not (is_machine(left) or near(result)):
            return left
        return Term(f"({left.at(ATOM)} {op} {right.at(ATOM)})", result)

    # --- booleans and floats ----------------------------------------------------------------

    def boolean(self, depth: int) -> str:
        """Return a condition."""
        asked = [f for f in self.names.functions if f.result == lang.BoolType()]
        if asked and self.choices.chance(15):
            return self.called(self.choices.pick(asked))
        kind = self.choices.integer(0, 11) if depth > 0 else self.choices.integer(0, 3)
        match kind:
            case 0:
                flags = self.same(lang.BoolType())
                return self.choices.pick(flags) if flags else "true"
            case 1 | 2 | 4 | 5:
                return self._comparison(depth)
            case 3:
                if self.names.states:
                    return f"In({self.choices.pick(self.names.states)})"
                return "false"
            case 6:
                return f"{self.choices.pick(('!', 'not '))}({self.boolean(depth - 1)})"
            case 7 | 8:
                op = self.choices.pick(("and", "&&"))
                return f"({self.boolean(depth - 1)}) {op} ({self.boolean(depth - 1)})"
            case 9 | 10:
                op = self.choices.pick(("or", "||"))
                return f"({self.boolean(depth - 1)}) {op} ({self.boolean(depth - 1)})"
            case _:
                return self._equality()

    def called(self, operation: Operation) -> str:
        """Return a call of an operation."""
        within = self.plain if operation in self.names.functions else self
        arguments = ", ".join(within.value(p.type, 1) for p in operation.parameters)
        return f"{operation.name}({arguments})"

    def test(self, depth: int = 2) -> str:
        """Return a condition that may ask the host."""
        asked = [o for o in self.names.operations if o.result == lang.BoolType()]
        if asked and self.choices.chance(15):
            return self.called(self.choices.pick(asked))
        return self.boolean(depth)

    def _comparison(self, depth: int) -> str:
        op = self.choices.pick(("<", "<=", "==", "!=", ">", ">="))
        if self.names.of(lang.FloatType) and self.choices.chance(10):
            return f"{self.floating(1)} {op} {self.integer_leaf().at(SUM)}"
        left = self.integer(max(0, depth - 1))
        return f"{left.at(SUM)} {op} {self.integer_leaf().at(SUM)}"

    def _equality(self) -> str:
        kinds = [
            (v.name, v.type)
            for v in self.names.variables
            if isinstance(v.type, lang.EnumType | lang.SymbolType)
        ]
        kinds += [
            (f"event.{f.name}", f.type)
            for f in self.names.fields
            if isinstance(f.type, lang.EnumType | lang.SymbolType)
        ]
        spans = self.names.of(lang.DurationType)
        if spans and self.choices.chance(30):
            return f"{self.choices.pick(spans).name} > {self.duration()}"
        if not kinds:
            return self.boolean(0)
        name, type_ = self.choices.pick(kinds)
        op = self.choices.pick(("==", "!="))
        return f"{name} {op} {self.value(type_)}"

    def floating(self, depth: int) -> str:
        """Return a floating-point expression."""
        leaves = self.same(lang.FloatType())
        kind = self.choices.integer(0, 5) if depth > 0 else self.choices.integer(0, 1)
        if kind == 0 or not leaves:
            return literal(self.choices, lang.FloatType())
        if kind <= 2:
            return self.choices.pick(leaves)
        op = self.choices.pick(("+", "-", "*"))
        right = self.integer_leaf().at(UNARY) if kind == 5 else self.floating(depth - 1)
        return f"({self.choices.pick(leaves)} {op} {right})"
