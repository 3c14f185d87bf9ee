"""Visiting and changing of all parts of a document."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocState, Document
from fsmkit.language.relocation import field_getter

EXPRESSIONS = frozenset(
    [
        "array",
        "call",
        "condition",
        "content_expr",
        "delay_expr",
        "done_content",
        "event_expr",
        "guard",
        "id_expr",
        "id_location",
        "index",
        "init",
        "invariant",
        "item",
        "location",
        "name_list",
        "src_expr",
        "super_guards",
        "target_expr",
        "type_expr",
        "value",
        "values",
    ]
)
"""Fields of a document's parts that hold expressions; other texts are names."""
PLAIN = re.compile(
    r"(?:Text|Span|Source|str|int|bool|None|tuple|frozenset|Kind|Trigger|Origin|[][,.| ])+"
)
"""The type of a field that holds texts and words alone."""


def parts(whole: object) -> Iterator[object]:
    """Yield all parts of a document, in order; skip locations and invoked charts."""
    left: list[Any] = [whole]
    while left:
        part = left.pop()
        yield part
        if type(part) is tuple:
            left += part[::-1]
        elif (held := _reversed_children(part.__class__)) is not None and (
            part.__class__ is not Document or part is whole
        ):
            left += held(part)


def structure(whole: object) -> Iterator[object]:
    """Yield the parts that can contain other parts, in order; skip texts."""
    left: list[Any] = [whole]
    while left:
        part = left.pop()
        if type(part) is tuple:
            left += part[::-1]
        elif (held := _structural(part.__class__)) is not None and (
            part.__class__ is not Document or part is whole
        ):
            yield part
            left += filter(None, held(part))


def texts(whole: object) -> Iterator[Text]:
    """Yield all texts in a document, in order."""
    left: list[Any] = [whole]
    while left:
        part = left.pop()
        kind = part.__class__
        if kind is Text:
            yield part
        elif kind is tuple:
            left += part[::-1]
        elif (held := _reversed_children(kind)) is not None and (
            kind is not Document or part is whole
        ):
            left += filter(None, held(part))


def states(*roots: DocState) -> Iterator[DocState]:
    """Yield states and their descendants, in document order."""
    left = list(roots[::-1])
    while left:
        state = left.pop()
        yield state
        left += state.children[::-1]


def map_parts(part: Any, change: Callable[[object], object]) -> Any:
    """Return a part of a document in which each part is replaced by the result of ``change``.

    If that is None, the function visits the children of the part; if nothing changes, it returns
    the same part. A tuple replaces one part among others. Among the texts, ``change`` sees only
    expressions. Invoked charts stay unchanged.
    """
    made = change(part)
    if made is not None:
        return made
    kind = part.__class__
    if kind is tuple:
        return _map_tuple(part, change)
    names, held = _changeable(kind)
    new = {}
    for name, value in zip(names, held(part), strict=True):
        if value and value.__class__ is not Document:
            if name not in EXPRESSIONS and _is_text(value):
                continue
            found = map_parts(value, change)
            if found is not value:
                new[name] = found
    return replace(part, **new) if new else part


def _map_tuple(parts: tuple[Any, ...], change: Callable[[object], object]) -> tuple[Any, ...]:
    found: list[Any] = []
    for each in parts:
        new = each if each.__class__ is Document else map_parts(each, change)
        found += new if new.__class__ is tuple and each.__class__ is not tuple else (new,)
    same = len(found) == len(parts) and all(map(operator.is_, found, parts))
    return parts if same else tuple(found)


def _is_text(value: object) -> bool:
    return isinstance(value, Text) or (
        isinstance(value, tuple) and bool(value) and isinstance(value[0], Text)
    )


@cache
def _reversed_children(kind: type[Any]) -> Callable[[Any], tuple[Any, ...]] | None:
    """Return the function that reads the fields of a part in reverse order."""
    if kind is Text or not is_dataclass(kind):
        return None
    return field_getter(_field_names(kind)[::-1])


@cache
def _structural(kind: type[Any]) -> Callable[[Any], tuple[Any, ...]] | None:
    """Return the function that reads the fields of a part other than texts and words."""
    if kind is Text or not is_dataclass(kind):
        return None
    return field_getter(_not_plain(kind)[::-1])


@cache
def _changeable(kind: type[Any]) -> tuple[tuple[str, ...], Callable[[Any], tuple[Any, ...]]]:
    """Return the names of the fields with parts or expressions, and their getter."""
    names: tuple[str, ...] = ()
    if kind is not Text and is_dataclass(kind):
        pieces = _not_plain(kind)
        names = tuple(n for n in _field_names(kind) if n in EXPRESSIONS or n in pieces)
    return names, field_getter(names)


@cache
def _not_plain(kind: Any) -> tuple[str, ...]:
    types = {field.name: str(field.type) for field in fields(kind)}
    return tuple(n for n in _field_names(kind) if not PLAIN.fullmatch(types[n]))


@cache
def _field_names(kind: type[Any]) -> tuple[str, ...]:
    """Return the fields of a part, except locations and advice."""
    names = (known.name for known in fields(kind))
    return tuple(name for name in names if name not in ("span", "source", "advice"))
