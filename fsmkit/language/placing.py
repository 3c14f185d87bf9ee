"""What was read of a text, at the places where the text stands.

Charts write the same statements and expressions again and again. Each is read once, at places in
the text itself (`detached`); for each place where it stands the tree is copied there (`placed`).
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
"""The type of a field that holds neither nodes nor places."""


def detached(value: str) -> Text:
    """Return a text whose places are offsets in it."""
    return Text(value, Span(Source("", value), 0, len(value)))


def placed(tree: Tree, at: Text) -> Tree:
    """Return a tree read of the `detached` value of a text at the places of the text itself."""
    copy: Tree = _placed(tree, at)
    return copy


def _placed(part: Any, at: Text) -> Any:
    kind = part.__class__
    if kind is Span:
        return at.span_of(part.start, part.end)
    if kind is tuple:
        return tuple([_placed(each, at) for each in part]) if part else part
    if kind is Text:
        return _placed_text(part, at)
    copy = _copying(kind)
    return part if copy is None else copy(part, at)


def _placed_text(part: Text, at: Text) -> Text:
    start, end = part.span.start, part.span.end
    if part.offsets is not None:
        places = at.offsets or range(at.span.start, at.span.end)
        return Text(part.value, at.span_of(start, end), tuple(places[i] for i in part.offsets))
    if part.value == at.value[start:end]:
        return at.part(start, end)
    return Text(part.value, at.span_of(start, end))


@cache
def _copying(kind: type[Any]) -> Callable[[Any, Text], Any] | None:
    """Return how to copy a node of a class to other places; None for what has none.

    It is made of the fields of the class, as a dataclass makes its own methods: this is the
    innermost loop of reading a chart.
    """
    if not is_dataclass(kind) or issubclass(kind, Type):
        return None
    values = ", ".join(_copied(field.name, str(field.type)) for field in fields(kind))
    scope = {"kind": kind, "placed": _placed}
    copy: Callable[[Any, Text], Any] = eval(f"lambda part, at: kind({values})", scope)  # noqa: S307
    return copy


def _copied(name: str, type_: str) -> str:
    """Return the expression of a field of a copy; ``name`` is that of a field of a class."""
    if type_ == "Span":
        return f"at.span_of(part.{name}.start, part.{name}.end)"
    return f"part.{name}" if BARE.fullmatch(type_) else f"placed(part.{name}, at)"


def values_of(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Return how to take the values of some fields of a node, fast."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda node: tuple(getattr(node, name) for name in names)
