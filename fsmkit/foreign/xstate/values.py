"""The configuration of a machine as values with locations: JSON, or JavaScript as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from fsmkit.diagnostics import Source, Span, Text


class Program(Protocol):
    """The program that an expression is in; nodes are those of its syntax tree."""

    source: Source

    def text(self, node: Any) -> str:
        """Return the source text of a node."""
        ...

    def span(self, node: Any) -> Span:
        """Return the location of a node."""
        ...

    def value(self, node: Any, depth: int = 0) -> Value:
        """Return the value of an expression, with constants of the file in their place."""
        ...

    def resolve(self, node: Any, depth: int = 0) -> Any:
        """Return the initial value of a constant, or of a member of one; else the node itself."""
        ...


@dataclass(frozen=True, slots=True)
class String:
    """A string."""

    text: Text

    @property
    def span(self) -> Span:
        """The location."""
        return self.text.span


@dataclass(frozen=True, slots=True)
class Number:
    """A finite number."""

    value: int | float
    span: Span


@dataclass(frozen=True, slots=True)
class Constant:
    """``true``, ``false``, ``null`` or ``undefined``; the last two are None."""

    value: bool | None
    span: Span


@dataclass(frozen=True, slots=True)
class Array:
    """A list of values."""

    items: tuple[Value, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Record:
    """An object: keys with their locations, in the order of `in_order`."""

    fields: tuple[tuple[Text, Value], ...]
    span: Span

    def get(self, name: str) -> Value | None:
        """Return the value of a key; None if it is absent or ``undefined``."""
        for key, value in self.fields:
            if key.value == name:
                return None if is_absent(value) else value
        return None

    def key(self, name: str) -> Text | None:
        """Return a key with its location."""
        return next((key for key, _ in self.fields if key.value == name), None)


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a function by its name, such as ``assign({...})``."""

    name: str
    arguments: tuple[Value, ...]
    code: Code

    @property
    def span(self) -> Span:
        """The location of the whole call."""
        return self.code.span


@dataclass(frozen=True, slots=True)
class Code:
    """Any other expression, such as a function: a node of the tree of its program."""

    span: Span
    script: Program
    node: Any

    @property
    def text(self) -> str:
        """The source text, on one line."""
        source = self.span.source.text[self.span.start : self.span.end]
        return " ".join(source.split())


def in_order(fields: Iterable[tuple[Text, Value]]) -> tuple[tuple[Text, Value], ...]:
    """Return fields in the order of an object of JavaScript: keys that are indices come first.

    A repeated key keeps its first place and takes the last value.
    """
    found: dict[str, tuple[Text, Value]] = {}
    for key, value in fields:
        found[key.value] = (found[key.value][0] if key.value in found else key, value)
    indices = [key for key in found if INDEX.fullmatch(key)]
    others = [key for key in found if not INDEX.fullmatch(key)]
    return tuple(found[key] for key in (*sorted(indices, key=int), *others))


INDEX = re.compile(r"0|[1-9][0-9]{0,8}")
Value = String | Number | Constant | Array | Record | Call | Code


def is_absent(value: Value | None) -> bool:
    """Return whether a value is missing, ``null`` or ``undefined``."""
    return value is None or (isinstance(value, Constant) and value.value is None)


def items(value: Value | None) -> Iterator[Value]:
    """Yield the values of a key that accepts one value or a list."""
    match value:
        case None:
            return
        case Array(found):
            yield from (item for item in found if not is_absent(item))
        case _ if not is_absent(value):
            yield value
