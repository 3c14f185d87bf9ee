"""Relocation: trees that were read from a text, copied to each location of that text.

Charts repeat the same statements and expressions. Each is read once, with offsets in the text
itself as locations (`detach`). For each occurrence, `relocate` copies the tree to its location.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar

from fsmkit.diagnostics import Source, Span, Text
from fsmkit.language.types import Type

Tree = TypeVar("Tree")
BARE = re.compile(
    r"(?:str|int|bool|float|None|tuple|range|FunctionBody|Type|Value|UnaryOp|BinaryOp|Storage"
    r"|[][,.| ])+"
)
"""Types of fields that hold neither nodes nor locations."""


def detach(value: str) -> Text:
    """Return a text whose locations are offsets in the text itself."""
    return Text(value, Span(Source("", value), 0, len(value)))


def relocate(tree: Tree, at: Text) -> Tree:
    """Return a tree, read from a `detach`ed text, with the locations of `at`."""
    copy: Tree = _relocate(tree, at)
    return copy


def _relocate(part: Any, at: Text) -> Any:
    kind = part.__class__
    if kind is Span:
        return at.span_of(part.start, part.end)
    if kind is tuple:
        return tuple([_relocate(each, at) for each in part]) if part else part
    if kind is Text:
        return _relocate_text(part, at)
    copy = _relocator(kind)
    return part if copy is None else copy(part, at)


def _relocate_text(part: Text, at: Text) -> Text:
    start, end = part.span.start, part.span.end
    if part.offsets is not None:
        places = at.offsets or range(at.span.start, at.span.end)
        return Text(part.value, at.span_of(start, end), tuple(places[i] for i in part.offsets))
    if part.value == at.value[start:end]:
        return at.part(start, end)
    return Text(part.value, at.span_of(start, end))


@cache
def _relocator(kind: type[Any]) -> Callable[[Any, Text], Any] | None:
    """Return the function that copies nodes of a class elsewhere; None for other classes.

    It is generated from the fields of the class: this is the innermost loop of reading a chart.
    """
    if not is_dataclass(kind) or issubclass(kind, Type):
        return None
    values = ", ".join(_field_expression(field.name, str(field.type)) for field in fields(kind))
    scope = {"kind": kind, "placed": _relocate}
    copy: Callable[[Any, Text], Any] = eval(f"lambda part, at: kind({values})", scope)  # noqa: S307
    return copy


def _field_expression(name: str, type_: str) -> str:
    """Return the expression that copies a field; ``name`` is the name of the field."""
    if type_ == "Span":
        return f"at.span_of(part.{name}.start, part.{name}.end)"
    return f"part.{name}" if BARE.fullmatch(type_) else f"placed(part.{name}, at)"


def field_getter(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a fast function that reads some fields of a node."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda node: tuple(getattr(node, name) for name in names)
