"""Forms: numbers that two nodes share just if they differ in nothing but their places.

Charts hold the same statements and guards at very many places. What follows from a node without
its places need be found but once for each form (`by_form`). Equality of nodes is not enough for
that: it also ignores names of constants, and 1 equals True and 0.0 equals -0.0.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, wraps
from itertools import count
from typing import Any, TypeVar

from fsmkit.diagnostics import Source, Span
from fsmkit.language.tree import FunctionBody
from fsmkit.language.types import Type

Result = TypeVar("Result")
PLAIN = re.compile(r"(?:str|int)(?: \| None)?")
"""The type of a field whose value is its own key."""
MEMBERS = frozenset({"UnaryOp", "BinaryOp", "Storage"})
"""Enumerations, whose members live as long as the program."""
MOST = 1 << 17
"""Nodes, and forms, that are kept."""
_numbers = count()
_forms: dict[Any, int] = {}
_known: dict[int, tuple[object, int]] = {}
"""Forms by identity of the node, with the node, which keeps the identity valid."""
_types: dict[int, tuple[Type, int]] = {}


def form(node: Any) -> int:
    """Return the form of a statement, an expression or a tuple of these; it is kept by identity.

    A number is never given anew, so that what is known of a form stays true of it.
    """
    known = _known.get(id(node))
    if known is not None:
        return known[1]
    key = _key(node.__class__)(node)
    if len(_known) >= MOST:
        for table in (_known, _forms, _types):
            table.clear()
        key = _key(node.__class__)(node)  # types have new numbers
    found = _forms.get(key)
    if found is None:
        found = _forms[key] = next(_numbers)
    _known[id(node)] = node, found
    return found


def by_form(function: Callable[[Any], Result]) -> Callable[[Any], Result]:
    """Call a function of a node once for each form; it must not depend on places."""
    results: dict[int, Result] = {}

    @wraps(function)
    def result(node: Any) -> Result:
        number = form(node)
        if number not in results:
            if len(results) >= MOST:
                results.clear()
            results[number] = function(node)
        return results[number]

    return result


@cache
def _key(kind: type[Any]) -> Callable[[Any], Any]:
    """Return how a value of a class is written as a key without places."""
    if issubclass(kind, str) or kind in (int, type(None)):
        return _same
    if issubclass(kind, tuple):
        return _of_tuple
    if issubclass(kind, Enum) or kind is FunctionBody:
        return _of_object
    if issubclass(kind, Type):
        return _of_type
    if kind in (Span, Source):
        return _nothing
    if not is_dataclass(kind):
        return _of_value
    parts = "".join(f", {_part(f.name, str(f.type))}" for f in fields(kind) if f.type != "Span")
    scope = {"key": _key, "kind": kind, "of_type": _of_type}
    # made of the fields, as a dataclass makes its own methods
    return eval(f"lambda node: (kind{parts})", scope)  # type: ignore[no-any-return]  # noqa: S307


def _part(name: str, type_: str) -> str:
    """Return the expression of a field; ``name`` is that of a field of a class."""
    if PLAIN.fullmatch(type_):
        return f"node.{name}"
    if type_ in MEMBERS:
        return f"id(node.{name})"
    return (
        f"of_type(node.{name})" if type_ == "Type" else f"key(node.{name}.__class__)(node.{name})"
    )


def _same(value: str | int | None) -> str | int | None:
    return value


def _nothing(_: object) -> None:
    return None


def _of_tuple(values: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple([_key(value.__class__)(value) for value in values])


def _of_object(value: object) -> tuple[type, int]:
    """Return the identity of a value that lives as long as a chart, such as a function."""
    return value.__class__, id(value)


def _of_value(value: object) -> tuple[type, str]:
    return value.__class__, repr(value)


def _of_type(type_: Type) -> int:
    known = _types.get(id(type_))
    if known is None:
        key = Type, type_
        number = _forms.get(key)
        if number is None:
            number = _forms[key] = next(_numbers)
        known = _types[id(type_)] = type_, number
    return known[1]
