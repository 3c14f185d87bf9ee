"""Visit or change every part of a document, of whatever kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any

from fsmkit.diagnostics import Text
from fsmkit.model.document import Document


def parts(whole: object) -> Iterator[object]:
    """Return everything in a document, in order; places and invoked charts are left aside."""
    left = [whole]
    while left:
        part = left.pop()
        yield part
        if isinstance(part, tuple):
            left.extend(reversed(part))
        elif isinstance(part, Document) and part is not whole:
            continue
        elif is_dataclass(part) and not isinstance(part, Text | type):
            left.extend(getattr(part, name) for name in reversed(_field_names(type(part))))


def mapped(part: Any, change: Callable[[object], object]) -> Any:
    """Return a part of a document in which each part is what ``change`` makes of it.

    Where that is None, the parts of the part are looked at. A tuple takes the place of a statement
    among others. Invoked charts are left as they are.
    """
    made = change(part)
    if made is not None:
        return made
    if isinstance(part, tuple):
        found: list[Any] = []
        for each in part:
            new = mapped(each, change)
            found += new if isinstance(new, tuple) and not isinstance(each, tuple) else (new,)
        return tuple(found)
    if not is_dataclass(part) or isinstance(part, Text | type):
        return part
    values = {name: getattr(part, name) for name in _field_names(type(part))}
    return replace(
        part,
        **{
            name: mapped(value, change)
            for name, value in values.items()
            if not isinstance(value, Document)
        },
    )


@cache
def _field_names(kind: type[Any]) -> tuple[str, ...]:
    """Return what a piece of a document holds, but for the places."""
    names = (known.name for known in fields(kind))
    return tuple(name for name in names if name not in ("span", "source"))
