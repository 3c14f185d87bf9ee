"""Values of the chart as objects of Python: functions in C for each type that is passed."""

from __future__ import annotations

from typing import assert_never

from fsmkit.codegen.c.expressions.types import interval, storage
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
from fsmkit.texts.c import comment

UNSIGNED_FROM = 2**63


class Values:
    """Prints, for one machine, each function that is asked for, once, before what calls it.

    ``take`` reads an object of Python into a C variable and tells what is wrong with it; ``give``
    makes a new reference. Arrays and records are tuples, enumerations integers.
    """

    def __init__(self, out: Emitter, names: Names, wrapper: str) -> None:
        """Print to ``out``."""
        self._out = out
        self._names = names
        self._wrapper = f"{wrapper}_{names.prefix}"
        self._takers: dict[Type, str] = {}
        self._givers: dict[Type, str] = {}

    def give(self, type_: Type, text: str) -> str:
        """Return an expression for the object of a value in C; NULL with an exception."""
        return f"{self._giver(type_)}(o, {_ref(type_, text)})"

    def take(self, type_: Type, source: str, what: str, target: str) -> str:
        """Return a condition that is false, with an exception, if a value cannot be read."""
        return f"{self._taker(type_)}(o, {source}, {what}, {_ref(type_, target)})"

    def _pointer(self, type_: Type) -> str:
        return storage(type_, self._names.records).text

    def _taker(self, type_: Type) -> str:
        if type_ not in self._takers:
            self._takers[type_] = f"{self._wrapper}_take_{len(self._takers)}"
            self._print_taker(type_, self._takers[type_])
        return self._takers[type_]

    def _giver(self, type_: Type) -> str:
        if type_ not in self._givers:
            self._givers[type_] = f"{self._wrapper}_give_{len(self._givers)}"
            self._print_giver(type_, self._givers[type_])
        return self._givers[type_]

    def _print_taker(self, type_: Type, name: str) -> None:
        body = Emitter()
        self._taking(body, type_)
        out = self._out
        out.line(f"/* {comment(str(type_))} */")
        out.line(f"static bool {name}(")
        out.line(
            f"    fsm_object *o, PyObject *value, const char *what, {self._pointer(type_)} *out)"
        )
        with out.block("{"):
            if not isinstance(type_, SymbolType | ArrayType | RecordType):
                out.line("(void)o;")
            out.lines(body.finish().rstrip("\n").split("\n"))
        out.line()

    def _taking(self, out: Emitter, type_: Type) -> None:
        match type_:
            case BoolType():
                out.line("return fsm_py_bool(value, what, out);")
            case SymbolType():
                out.line("return fsm_py_symbol(o, value, what, out);")
            case FloatType(bits):
                out.lines(["double taken = 0.0;", "if (!fsm_py_double(value, what, &taken))"])
                out.lines(["    return false;", f"*out = {'(float)' * (bits == 32)}taken;"])
                out.line("return true;")
            case IntType() | EnumType() | DurationType():
                self._integer(out, type_)
            case ArrayType(element, length):
                out.line(f"if (!fsm_py_parts(value, what, {length}))")
                out.line("    return false;")
                with out.block(f"for (Py_ssize_t i = 0; i < {length}; i++) {{"):
                    self._part(out, element, "i", "out[i]")
                out.line("return true;")
            case RecordType(_, fields):
                out.line(f"if (!fsm_py_parts(value, what, {len(fields)}))")
                out.line("    return false;")
                for number, part in enumerate(fields):
                    with out.block("{"):
                        place = f"out->{self._names.field(part.name)}"
                        self._part(out, part.type, str(number), place)
                out.line("return true;")
            case _:
                assert_never(type_)

    def _integer(self, out: Emitter, type_: Type) -> None:
        span = interval(type_)
        sign = "unsigned" if span.hi >= UNSIGNED_FROM else "signed"
        wide = "uint64_t" if span.hi >= UNSIGNED_FROM else "int64_t"
        bounds = f"{_bound(span.lo, sign)}, {_bound(span.hi, sign)}"
        out.line(f"{wide} taken = 0;")
        call = f'fsm_py_{sign}(value, what, "{span.lo}..{span.hi}", {bounds}, &taken)'
        out.lines([f"if (!{call})", "    return false;"])
        out.lines([f"*out = ({self._pointer(type_)})taken;", "return true;"])

    def _part(self, out: Emitter, type_: Type, number: str, place: str) -> None:
        """Print how a part of a sequence is read."""
        out.line(f"PyObject *part = PySequence_GetItem(value, {number});")
        taken = self.take(type_, "part", "what", place)
        out.line(f"bool is_taken = part != NULL && {taken};")
        out.lines(["Py_XDECREF(part);", "if (!is_taken)", "    return false;"])

    def _print_giver(self, type_: Type, name: str) -> None:
        body = Emitter()
        self._giving(body, type_)
        out = self._out
        out.line(f"/* {comment(str(type_))} */")
        out.line(f"static PyObject *{name}(fsm_object *o, const {self._pointer(type_)} *value)")
        with out.block("{"):
            if not isinstance(type_, SymbolType):
                out.line("(void)o;")
            out.lines(body.finish().rstrip("\n").split("\n"))
        out.line()

    def _giving(self, out: Emitter, type_: Type) -> None:
        match type_:
            case BoolType():
                out.line("return fsm_py_bool_of(*value);")
            case SymbolType():
                out.line("return fsm_py_string(o, *value);")
            case FloatType():
                out.line("return PyFloat_FromDouble((double)*value);")
            case IntType() | EnumType() | DurationType():
                is_wide = interval(type_).hi >= UNSIGNED_FROM
                maker = "PyLong_FromUnsignedLongLong" if is_wide else "PyLong_FromLongLong"
                out.line(f"return {maker}(*value);")
            case ArrayType(element, length):
                out.line(f"PyObject *parts = PyTuple_New({length});")
                with out.block(f"for (Py_ssize_t i = 0; i < {length}; i++) {{"):
                    self._put(out, element, "i", "value[i]")
                out.line("return parts;")
            case RecordType(_, fields):
                out.line(f"PyObject *parts = PyTuple_New({len(fields)});")
                for number, part in enumerate(fields):
                    place = f"value->{self._names.field(part.name)}"
                    self._put(out, part.type, str(number), place)
                out.line("return parts;")
            case _:
                assert_never(type_)

    def _put(self, out: Emitter, type_: Type, number: str, place: str) -> None:
        out.line(f"if (!fsm_py_put(&parts, {number}, {self.give(type_, place)}))")
        out.line("    return NULL;")


def _ref(type_: Type, text: str) -> str:
    """Return a pointer to a variable; an array is one."""
    return text if isinstance(type_, ArrayType) else f"&{text}"


def _bound(value: int, sign: str) -> str:
    """Spell a bound of a range."""
    if sign == "unsigned":
        return f"UINT64_C({value})"
    return "INT64_MIN" if value == -(2**63) else f"INT64_C({value})"
