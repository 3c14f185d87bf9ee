"""Reading of types and durations."""

# mypy: disable-error-code="func-returns-value"
# (`return context.report(...)` reports and returns None)

from __future__ import annotations

import re

from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.fixes import replace_text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.language import types
from fsmkit.language.arithmetic import representable
from fsmkit.language.binding.typing import type_expression
from fsmkit.language.durations import WRITTEN, duration_of
from fsmkit.language.folding import fold
from fsmkit.language.names import Context
from fsmkit.language.scope import Scope
from fsmkit.language.tree import Literal

NAMED: dict[str, types.Type] = {
    "bool": types.BOOL,
    "float32": types.FLOAT32,
    "float64": types.FLOAT64,
    "symbol": types.SYMBOL,
    "duration": types.DURATION,
    **types.MACHINE_INTEGERS,
}
FOREIGN = {
    "int": "int32",
    "integer": "int32",
    "uint": "uint32",
    "long": "int64",
    "short": "int16",
    "char": "int8",
    "byte": "uint8",
    "boolean": "bool",
    "float": "float64",
    "double": "float64",
    "number": "float64",
    "string": "symbol",
    "text": "symbol",
    "str": "symbol",
    "time": "duration",
}
DASHED = re.compile(r"(-?\d+)\s*(?:-|to|\.\.\.|:)\s*(\d+)")
SUFFIX = re.compile(r"\s+(saturate|wrap|fault)\s*$")
LONGEST_ARRAY = 65536


def read_type(text: Text, scope: Scope, findings: Findings) -> types.Type | None:
    """Read a type: a name, a range ``lo..hi`` with ``wrap`` or ``fault``, an array ``T[n]``.

    Bounds and lengths are constant expressions.
    """
    context, text = Context(scope, findings), text.strip()
    if not text.value:
        return context.report("invalid-type", "a type is missing", text, "write such as `0..100`")
    if text.value.endswith("]") and "[" in text.value:
        return _array(context, text)
    suffix = SUFFIX.search(text.value)
    body = text.part(0, suffix.start()) if suffix else text
    if ".." in body.value and not DASHED.fullmatch(body.value):
        return _range(
            context, body, types.Overflow(suffix[1]) if suffix else types.Overflow.SATURATE
        )
    if suffix:
        message = f"only a range can be marked `{suffix[1]}`"
        return context.report("invalid-type", message, text, "write such as `0..3 wrap`")
    name = text.value
    found = NAMED.get(name) or scope.types.get(name)
    if found is not None:
        return found
    help_ = suggest(name, (*NAMED, *scope.types), "declare it under `types`")
    fixes = replace_text(text, FOREIGN[name]) if name in FOREIGN else ()
    if (range_ := DASHED.fullmatch(name)) is not None:
        help_ = f"write `{range_[1]}..{range_[2]}`"
        fixes = replace_text(text, f"{range_[1]}..{range_[2]}")
    elif name in scope.constants or name.isdigit() or name in ("true", "false"):
        help_ = f"a type comes before the start value: `0..255 = {name}`, `bool = true`"
    if name in FOREIGN:
        help_ = f"write `{FOREIGN[name]}`"
    return context.report("unknown-name", f"unknown type `{name}`", text, help_, fixes=fixes)


def _array(context: Context, text: Text) -> types.Type | None:
    opening = text.value.rindex("[")
    if not text.value[opening + 1 : -1].strip():
        advice = f"write how many: `{text.value[:opening]}[4]`"
        return context.report("invalid-type", "an array has no length", text, advice)
    inner = text.part(0, opening).strip()
    if inner.value.endswith("]"):
        message = "the elements of an array must be scalars, not arrays"
        return context.report("invalid-type", message, text, "declare several arrays")
    element = read_type(inner, context.scope, context.findings)
    size = text.part(opening + 1, len(text.value) - 1)
    length = _constant(context, size)
    if element is None or length is None:
        return None
    if isinstance(element, types.RecordType):
        message = f"the elements of an array must be scalars, not `{element}`"
        return context.report("invalid-type", message, text, "declare several arrays")
    if not 1 <= length <= LONGEST_ARRAY:
        message = f"an array has 1 to {LONGEST_ARRAY} elements, not {length}"
        return context.report("invalid-type", message, size)
    return types.ArrayType(element, length)


def _range(context: Context, text: Text, overflow: types.Overflow) -> types.Type | None:
    middle = text.value.index("..")
    lo = _constant(context, text.part(0, middle))
    hi = _constant(context, text.part(middle + 2, len(text.value)))
    if lo is None or hi is None:
        return None
    type_ = types.IntType(lo, hi, overflow)
    if lo > hi:
        message = f"the range {lo}..{hi} is empty"
        fixes = replace_text(text, f"{hi}..{lo}")
        return context.report("invalid-type", message, text, f"write `{hi}..{lo}`", fixes=fixes)
    if not representable(type_):
        message = f"the range {lo}..{hi} does not fit 64 bits"
        return context.report("invalid-type", message, text, "narrow it")
    return type_


def _constant(context: Context, text: Text) -> int | None:
    expr = type_expression(text.strip(), context.scope, context.findings)
    if expr is None:
        return None
    folded = fold(expr)
    if isinstance(folded, Literal) and isinstance(folded.type, types.IntType):
        assert isinstance(folded.value, int)  # noqa: S101
        return folded.value
    return context.report(
        "not-known-when-compiling",
        f"`{text.value.strip()}` is not a whole number known at compile time",
        text,
        "write a number, or the name of a constant",
    )


def read_duration(text: Text, scope: Scope, findings: Findings) -> int | None:
    """Read a duration literal or a constant expression of type duration, in ticks."""
    context, text = Context(scope, findings), text.strip()
    if WRITTEN.fullmatch(text.value):
        return duration_of(context, text.value, text)
    expr = type_expression(text, scope, findings, types.DURATION)
    if expr is None:
        return None
    folded = fold(expr)
    if isinstance(folded, Literal):
        assert isinstance(folded.value, int)  # noqa: S101
        return folded.value
    return context.report(
        "not-known-when-compiling",
        f"`{text.value}` is not a duration known at compile time",
        text,
        "write such as `500ms`, or the name of a constant",
    )
