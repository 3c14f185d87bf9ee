"""Values passed between a machine and the host's C: tested, copied, converted.

The same functions contain names of the host, so the local variables start with ``fsm_``.
"""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field as dataclass_field

import fsmkit.language as lang
from fsmkit.codegen.c.binding.equality import literal
from fsmkit.codegen.c.expressions.types import parameter_type
from fsmkit.codegen.c.names import Names
from fsmkit.codegen.c.storage import storage
from fsmkit.codegen.existing_c.model import BoundType
from fsmkit.emit import Emitter, plain
from fsmkit.language.conversion import integer_bounds

GREATEST_SIGNED = 2**63 - 1
WIDEST = ((-GREATEST_SIGNED - 1, GREATEST_SIGNED), (0, 2 * GREATEST_SIGNED + 1))
"""Ranges that contain every value of a signed and of an unsigned integer."""
WITHIN = """
/* The nearest value of a range; a value outside of it is counted. */
static int64_t fsm_bind_within(int64_t value, int64_t least, int64_t most, uint16_t *rejected)
{
    if (value < least || value > most) {
        fsm_count(rejected);
        return value < least ? least : most;
    }
    return value;
}
"""
WITHIN_UNSIGNED = WITHIN.replace("fsm_bind_within", "fsm_bind_within_unsigned").replace(
    "int64_t", "uint64_t"
)
HELPERS = {"within": WITHIN, "within_unsigned": WITHIN_UNSIGNED}


@dataclass
class Values:
    """Prints the transfer of values in both directions. ``used``: the helpers that this needs."""

    names: Names
    used: set[str] = dataclass_field(default_factory=set)

    def bound(self, type_: lang.Type) -> BoundType | None:
        """Return the host's type for a type of the chart."""
        binding = self.names.options.binding
        if binding is None or not isinstance(type_, lang.EnumType | lang.RecordType):
            return None
        return binding.types.get(plain(type_.name))

    def value_type(self, type_: lang.Type) -> str:
        """Return the C type that the host's expressions have for a value."""
        found = self.bound(type_)
        if isinstance(type_, lang.RecordType) and found is not None:
            return found.type
        return parameter_type(type_, self.names)

    def take(
        self,
        out: Emitter,
        type_: lang.Type,
        text: str,
        target: str,
        rejected: str,
        *,
        trusted: bool,
    ) -> None:
        """Print the store of an expression's value; ``rejected``: the counter's address."""
        match type_:
            case lang.BoolType():
                self.require_whole(out, text)
                out.line(f"{target} = {text};")
            case lang.EnumType():
                self._take_member(out, type_, text, target, rejected, trusted=trusted)
            case lang.FloatType():
                self._take_float(out, type_, text, target, rejected, trusted=trusted)
            case lang.ArrayType(element, length):
                with out.block(f"for (uint32_t fsm_i = 0u; fsm_i < {length}u; fsm_i++) {{"):
                    each, stored = f"{text}[fsm_i]", f"{target}[fsm_i]"
                    self.take(out, element, each, stored, rejected, trusted=trusted)
            case lang.RecordType():
                with out.block("{"):
                    out.line(f"const {self.value_type(type_)} fsm_given = {text};")
                    for part, member in self.members(type_):
                        stored = f"{target}.{self.names.field(part.name)}"
                        given = f"fsm_given.{member}"
                        self.take(out, part.type, given, stored, rejected, trusted=trusted)
            case _:
                given = text if trusted else self.within(type_, text, rejected)
                out.line(f"{target} = {given};")

    def require_whole(self, out: Emitter, text: str) -> None:
        """Print a declaration that compiles only for whole numbers and evaluates nothing.

        Compilers silently convert pointers to `bool`, and gcc converts a fraction to an
        enumeration.
        """
        out.line(f"(void)sizeof({text} % 2); /* a whole number */")

    def within(self, type_: lang.Type, text: str, rejected: str) -> str:
        """Return the call that keeps a number within the range of its type."""
        interval = integer_bounds(type_)
        assert interval is not None  # noqa: S101  (a number)
        lo, hi = interval
        if interval in WIDEST:
            return text
        helper = "within" if hi <= GREATEST_SIGNED else "within_unsigned"
        self.used.add(helper)
        stored = storage(type_, self.names.records).text
        return f"({stored})fsm_bind_{helper}({text}, {literal(lo)}, {literal(hi)}, {rejected})"

    def _take_member(
        self,
        out: Emitter,
        type_: lang.EnumType,
        text: str,
        target: str,
        rejected: str,
        *,
        trusted: bool,
    ) -> None:
        """Print the store of an enumeration member; an unknown value leaves the old one."""
        names = self.names
        stored = storage(type_, names.records).text
        with out.block("{"):
            self.require_whole(out, text)
            out.line(f"const {names.enumerations[type_.name]} fsm_value = {text};")
            if trusted:
                out.line(f"{target} = ({stored})fsm_value;")
                return
            out.line("switch ((int)fsm_value) {")
            out.lines(f"case (int){member}:" for member in names.members[type_.name])
            out.lines([f"    {target} = ({stored})fsm_value;", "    break;", "default:"])
            out.lines([f"    fsm_count({rejected});", "    break;", "}"])

    def _take_float(
        self,
        out: Emitter,
        type_: lang.FloatType,
        text: str,
        target: str,
        rejected: str,
        *,
        trusted: bool,
    ) -> None:
        """Print the store of a floating-point number; infinities and NaN are rejected."""
        if trusted:
            out.line(f"{target} = {text};")
            return
        ctype, zero = ("float", "0.0f") if type_.bits == 32 else ("double", "0.0")
        with out.block("{"):
            out.line(f"const {ctype} fsm_value = {text};")
            out.line(f"const {ctype} fsm_none = fsm_value - fsm_value;")
            with out.block(f"if (fsm_none >= {zero}) {{"):
                out.line(f"{target} = fsm_value;")
                out.turn("} else {")
                out.line(f"fsm_count({rejected});")

    def members(self, type_: lang.RecordType) -> list[tuple[lang.Field, str]]:
        """Return the fields of a record, each with its member in the host's type."""
        found = self.bound(type_)
        if found is None:
            return [(part, self.names.field(part.name)) for part in type_.fields]
        return [(part, found.fields[plain(part.name)].member.value) for part in type_.fields]

    def give(self, out: Emitter, type_: lang.Type, stored: str, target: str) -> None:
        """Print the assignment of a machine's value to a variable of the host."""
        match type_:
            case lang.ArrayType(element, length):
                with out.block(f"for (uint32_t fsm_i = 0u; fsm_i < {length}u; fsm_i++) {{"):
                    self.give(out, element, f"{stored}[fsm_i]", f"{target}[fsm_i]")
            case lang.RecordType():
                with out.block("{"):
                    self.converted(out, type_, stored, "fsm_value")
                    out.line(f"{target} = fsm_value;")
            case _:
                out.line(f"{target} = {self.given(type_, stored)};")

    def given(self, type_: lang.Type, stored: str) -> str:
        """Return a number of the machine as the host's type."""
        cast = (
            f"({self.names.enumerations[type_.name]})" if isinstance(type_, lang.EnumType) else ""
        )
        return f"{cast}{stored}"

    def converted(self, out: Emitter, type_: lang.RecordType, stored: str, name: str) -> None:
        """Print a variable of the host's type with the fields of a record."""
        if self.bound(type_) is None:
            out.line(f"const {self.value_type(type_)} {name} = {stored};")
            return
        out.line(f"{self.value_type(type_)} {name};")
        out.line(f"fsm_clear(&{name}, sizeof {name});")
        for part, member in self.members(type_):
            own = f"{stored}.{self.names.field(part.name)}"
            if isinstance(part.type, lang.ArrayType):
                self.give(out, part.type, own, f"{name}.{member}")
            else:
                out.line(f"{name}.{member} = {self._masked(part.type, own)};")

    def _masked(self, type_: lang.Type, stored: str) -> str:
        """Return a field's value in a form that a compiler accepts for a bit-field."""
        if not isinstance(type_, lang.IntType) or type_.lo < 0 or type_.hi > 0x7FFFFFFF:
            return self.given(type_, stored)
        width = type_.hi.bit_length()
        stores = storage(type_, {}).size * 8
        return stored if width == stores else f"{stored} & 0x{(1 << width) - 1:X}u"
