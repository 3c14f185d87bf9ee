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
NOWHERE = Source("", "")
BARE = re.compile(
    r"(?:str|int|bool|float|None|tuple|Type|Value|UnaryOp|BinaryOp|Storage|[][,.| ])+"
)
"""The type of a field that holds neither nodes nor places."""


def detached(value: str) -> Text:
    """Return a text whose places are offsets in it."""
    return Text(value, Span(NOWHERE, 0, len(value)))


def placed(tree: Tree, at: Text) -> Tree:
    """Return a tree read of the `detached` value of a text at the places of the text itself."""
    copy: Tree = _placed(tree, at)
    return copy


def _placed(part: Any, at: Text) -> Any:
    kind = part.__class__
    if kind is Span:
        return at.span_of(part.start, part.end)
    if kind is tuple:
        return tuple([_placed(each, at) for each in part])
    if kind is Text:
        return _placed_text(part, at)
    held = _held(kind)
    if held is None:
        return part
    have_places, values = held
    pairs = zip(have_places, values(part), strict=True)
    return kind(*[_placed(value, at) if has_places else value for has_places, value in pairs])


def _placed_text(part: Text, at: Text) -> Text:
    start, end = part.span.start, part.span.end
    if part.offsets is not None:
        places = at.offsets or range(at.span.start, at.span.end)
        return Text(part.value, at.span_of(start, end), tuple(places[i] for i in part.offsets))
    if part.value == at.value[start:end]:
        return at.part(start, end)
    return Text(part.value, at.span_of(start, end))


@cache
def _held(kind: type[Any]) -> tuple[tuple[bool, ...], Callable[[Any], tuple[Any, ...]]] | None:
    """Return which fields of a node have places in them, and how to take them all."""
    if not is_dataclass(kind) or issubclass(kind, Type):
        return None
    have_places = tuple(not BARE.fullmatch(str(field.type)) for field in fields(kind))
    return have_places, values_of(tuple(field.name for field in fields(kind)))


def values_of(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Return how to take the values of some fields of a node, fast."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda node: tuple(getattr(node, name) for name in names)
