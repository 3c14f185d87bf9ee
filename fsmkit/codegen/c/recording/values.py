"""Values of a machine as bytes, and back: the C of what `plan.image` says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import assert_never

from fsmkit.codegen.c.expressions.types import integer, storage
from fsmkit.codegen.c.names import Names
from fsmkit.emit import Emitter
from fsmkit.language import (
    ArrayType,
    BoolType,
    DurationType,
    EnumType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
)
from fsmkit.plan.image import code, size_of

Leaf = Callable[[Type, str], str]
Each = Callable[[Emitter, Type, str], None]


@dataclass(frozen=True, slots=True)
class Values:
    """Prints how values of a machine are written (``w``) and read (``r``)."""

    names: Names
    table: str
    """Of the symbols, and how many there are."""

    def put(self, out: Emitter, type_: Type, place: str) -> None:
        """Print how what is at a place is written."""
        self._each(out, type_, place, self._written)

    def get(self, out: Emitter, type_: Type, place: str) -> None:
        """Print how a place gets what is read."""
        self._each(out, type_, place, lambda of, text: f"{text} = {self._read(of)};")

    def payloads(self, out: Emitter, names: Names, each: Each) -> None:
        """Print how the fields of the event ``e`` are written or read, whichever it is."""
        with out.block("switch (e->event) {"):
            for event in names.chart.events:
                if event.fields:
                    out.line(f"case {names.events[event.index]}:")
                    with out.indented():
                        for part in event.fields:
                            payload = names.payloads[event.index]
                            each(out, part.type, f"e->of.{payload}.{names.field(part.name)}")
                        out.line("break;")
            out.line("default:")
            with out.indented():
                out.line("break;")

    def _each(self, out: Emitter, type_: Type, place: str, leaf: Leaf, depth: int = 0) -> None:
        match type_:
            case ArrayType(element, length):
                at = f"k{depth}"
                with out.block(f"for (uint32_t {at} = 0u; {at} < {length}u; {at}++) {{"):
                    self._each(out, element, f"{place}[{at}]", leaf, depth + 1)
            case RecordType(_, fields):
                for part in fields:
                    text = f"{place}.{self.names.field(part.name)}"
                    self._each(out, part.type, text, leaf, depth)
            case _:
                out.line(leaf(type_, place))

    def _written(self, type_: Type, place: str) -> str:
        match type_:
            case BoolType():
                return f"fsm_put(w, {place} ? 1u : 0u, 1u);"
            case FloatType(bits):
                return f"fsm_put_{'float' if bits == 32 else 'double'}(w, {place});"
            case SymbolType():
                return f"fsm_put_symbol(w, {self.table}, {place});"
            case _:
                size = size_of(code(type_))
                if size == 8:
                    return f"fsm_put_wide(w, (uint64_t){place});"
                return f"fsm_put(w, (uint32_t){place}, {size}u);"

    def _read(self, type_: Type) -> str:
        match type_:
            case BoolType():
                return "fsm_take(r, 1u, 0u, 1u) != 0u"
            case FloatType(bits):
                return f"fsm_take_{'float' if bits == 32 else 'double'}(r)"
            case SymbolType():
                return f"fsm_take_symbol(r, {self.table})"
            case IntType(lo, hi):
                return self._integer(type_, lo, hi)
            case EnumType(_, members):
                return self._integer(type_, 0, len(members) - 1)
            case DurationType():
                return self._integer(type_, 0, 2**31 - 1)
            case ArrayType() | RecordType():
                raise AssertionError(type_)
            case _:
                assert_never(type_)

    def _integer(self, type_: Type, lo: int, hi: int) -> str:
        size = size_of(code(type_))
        stored = storage(type_, self.names.records).text
        sign = "_signed" if lo < 0 else ""
        if size == 8:
            ctype = "int64_t" if lo < 0 else "uint64_t"
            return f"fsm_take_wide{sign}(r, {integer(lo, ctype)}, {integer(hi, ctype)})"
        ctype = "int32_t" if lo < 0 else "uint32_t"
        bounds = f"{integer(lo, ctype)}, {integer(hi, ctype)}"
        return f"({stored})fsm_take{sign}(r, {size}u, {bounds})"
