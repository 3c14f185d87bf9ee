"""Local variables and loops of a block, typed the same in handlers and functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fsmkit.diagnostics import Findings, Text
from fsmkit.language import types
from fsmkit.language.binding.typing import type_expression, type_location
from fsmkit.language.constants import general_type
from fsmkit.language.conversion import default_value
from fsmkit.language.names import kinds_of_name
from fsmkit.language.notation import LONGEST_ARRAY, read_type
from fsmkit.language.scope import Scope
from fsmkit.language.statements.tree import ForEach, Local, WrittenStatement
from fsmkit.language.tree import Expr, Literal, Numbers, Storage, Variable


def with_local(scope: Scope, name: str, type_: types.Type, *, is_fixed: bool) -> Scope:
    """Return a scope with one more local name."""
    variables = {**scope.variables, name: (type_, Storage.LOCAL)}
    fixed = scope.fixed | {name} if is_fixed else scope.fixed - {name}
    return replace(scope, variables=variables, fixed=fixed)


def is_taken(name: Text, scope: Scope, findings: Findings) -> bool:
    """Report a local name that already has a meaning, which it would hide."""
    kind = kinds_of_name(scope).get(name.value)
    if kind is None or kind == "a state":
        return False
    findings.add(
        "duplicate-name",
        f"`{name}` is already {kind}",
        name,
        help="rename it: a local name must not hide another name",
    )
    return True


def variable_type(type_: types.Type) -> types.Type:
    """Return the type of a variable that can hold every value of a type unchanged."""
    if isinstance(type_, types.IntType) and type_.overflow is not types.Overflow.WRAP:
        return types.IntType(type_.lo, type_.hi)
    return type_


def type_local(
    written: Local[Text, Text], scope: Scope, findings: Findings
) -> tuple[Local[Variable, Expr] | None, Scope]:
    """Return ``let`` or ``var`` typed, and the scope after it."""
    name = written.place
    type_: types.Type | None = None
    if not name.value.isidentifier():
        findings.add(
            "statement-syntax",
            f"`{name}` is not a name",
            name,
            help="write `let x = value`, or `var n 0..9 = 0`",
        )
        return None, scope
    if written.type is not None:
        type_ = read_type(written.type, scope, findings)
        if type_ is None:
            return None, scope
    if written.value is None:
        if type_ is None:
            findings.add(
                "missing-type",
                f"`{name}` has neither a type nor a value",
                name,
                help=f"declare it, for instance `var {name} 0..255 = 0`",
            )
            return None, scope
        value: Expr | None = Literal(default_value(type_), type_, name.span)
    else:
        value = type_expression(written.value, scope, findings, type_)
    if value is None or value.type is None:
        return None, scope
    if type_ is None:
        type_ = (
            variable_type(value.type)
            if written.is_fixed
            else general_type(variable_type(value.type))
        )
        if not written.is_fixed:
            value = type_expression(written.value or name, scope, findings, type_)
    if isinstance(type_, types.ArrayType | types.RecordType):
        findings.add(
            "invalid-type",
            f"`{name}` is an array or a record, which a local variable cannot be",
            written.type or name,
            help="declare it under `data`, or name its parts one by one",
        )
        return None, scope
    is_new = not is_taken(name, scope, findings)
    if value is None or not is_new:
        return None, scope
    place = Variable(name.value, type_, Storage.LOCAL, name.span)
    inner = with_local(scope, name.value, type_, is_fixed=written.is_fixed)
    return Local(place, value, written.span, None, written.is_fixed), inner


@dataclass(frozen=True, slots=True)
class LoopHead:
    """The head of a loop: what it iterates over, its variables, and the scope of its body."""

    array: Variable | Numbers
    item: Variable
    index: Variable | None
    scope: Scope


def type_loop_head(
    written: ForEach[Text, Text, WrittenStatement], scope: Scope, findings: Findings
) -> LoopHead | None:
    """Type the head of a loop: over an array, ``lo..hi``, or the members of an enumeration."""
    array = _type_iterated(written.array, scope, findings)
    if array is None:
        return None
    element = array.type.element if isinstance(array.type, types.ArrayType) else array.type
    length = array.type.length if isinstance(array.type, types.ArrayType) else 0
    if isinstance(array, Numbers):
        length = len(array.numbers)
    inner = _declare_loop_variable(written.item, element, scope)
    if written.index is not None:
        inner = _declare_loop_variable(written.index, types.IntType(0, length - 1), inner)
    item = _variable(written.item, inner, scope, findings)
    index = None
    if written.index is not None:
        index = _variable(written.index, inner, scope, findings)
        if index is None:
            return None
    if item is None:
        return None
    _check_loop_variables(written, element, length, item, index, findings)
    return LoopHead(array, item, index, inner)


def _type_iterated(text: Text, scope: Scope, findings: Findings) -> Variable | Numbers | None:
    """Type the iterated expression of a loop: an array variable or numbers."""
    stripped = text.strip()
    if scope.dialect == "fsmkit":
        known = scope.types.get(stripped.value)
        if isinstance(known, types.EnumType):
            return Numbers(known.numbers, known, text.span, stripped.value)
        if ".." in stripped.value:
            type_ = read_type(stripped, scope, findings)
            if not isinstance(type_, types.IntType):
                return None
            if type_.hi - type_.lo >= LONGEST_ARRAY:
                findings.add(
                    "loop-too-long",
                    f"the loop has {type_.hi - type_.lo + 1} rounds",
                    text,
                    help=f"a loop has at most {LONGEST_ARRAY} rounds, as an array has elements",
                )
                return None
            numbers = range(type_.lo, type_.hi + 1)
            return Numbers(numbers, types.IntType(type_.lo, type_.hi), text.span, stripped.value)
    array = type_expression(text, scope, findings)
    if array is None:
        return None
    if isinstance(array, Variable) and isinstance(array.type, types.ArrayType):
        return array
    findings.add(
        "loop-variable-type",
        f"`{text}` is not an array but {array.type}",
        text,
        help="iterate over a variable of a type such as `uint8[4]`, `0..7`, or an enumeration",
    )
    return None


def _declare_loop_variable(name: Text, type_: types.Type, scope: Scope) -> Scope:
    """Return a scope in which a loop variable is known, as a local one unless it already was."""
    known: tuple[Mapping[str, object], ...] = (
        *(scope.variables, scope.constants, scope.operations, scope.functions, scope.types),
    )
    if any(name.value in names for names in known) or not name.value.isidentifier():
        return scope
    return with_local(scope, name.value, type_, is_fixed=True)


def _variable(text: Text, inner: Scope, outer: Scope, findings: Findings) -> Variable | None:
    """Return a loop variable, which must be of this block."""
    if text.value in inner.variables and text.value not in outer.variables:
        type_, storage = inner.variables[text.value]
        return Variable(text.value, type_, storage, text.span)
    if outer.variables.get(text.value, (None, None))[1] is Storage.LOCAL:
        is_taken(text, outer, findings)
        return None
    location = type_location(text, inner, findings)
    if location is None or isinstance(location, Variable):
        return location
    findings.add(
        "not-a-variable",
        f"`{text}` is part of a variable; a loop needs a whole variable",
        text,
        help="name a variable",
    )
    return None


def _check_loop_variables(
    written: ForEach[Text, Text, WrittenStatement],
    element: types.Type,
    length: int,
    item: Variable,
    index: Variable | None,
    findings: Findings,
) -> None:
    """Report a loop variable whose type does not hold each element or each position."""
    is_range = isinstance(element, types.IntType) and ".." in written.array.value
    holds = item.type == element
    if is_range and isinstance(item.type, types.IntType) and isinstance(element, types.IntType):
        holds = item.type.lo <= element.lo and element.hi <= item.type.hi
    if not holds:
        findings.add(
            "loop-variable-type",
            f"`{item.name}` is {item.type} and the elements are {element}",
            written.item,
            help=f"declare `{item.name}` as {element}",
        )
    last = length - 1
    if index is not None and not (
        isinstance(index.type, types.IntType) and 0 in index.type and last in index.type
    ):
        findings.add(
            "loop-variable-type",
            f"`{index.name}` is {index.type} and does not hold the positions 0..{last}",
            written.index,
            help=f"declare `{index.name}` as 0..{last}",
        )
