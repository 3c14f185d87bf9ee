"""Text that came from a file, and the rule that no printer of a language takes it raw.

Every name, doc, label and string of a chart is `Written`. While a function marked `printing` runs,
such text can be put into other text only by the functions of a language (`fsmkit.emit.c` and its
like, and what makes identifiers): an f-string with it raises `RawText`, and what ``+`` makes
of it is guarded as well. So a name is never code, even where a printer is wrong: it fails closed.

Two ways lead past the guard, and the grid of hostile names tests them: ``str.join``, and what
takes a text apart, which gives plain ``str``.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from contextvars import ContextVar
from functools import wraps
from typing import ParamSpec, Self, TypeVar, cast

Given = ParamSpec("Given")
Made = TypeVar("Made")

_IS_PRINTING = ContextVar("is printing", default=False)
HARMLESS = re.compile(r"[A-Za-z0-9_.-]*")
"""Text that ends no comment, string or line in any language."""
is_strict = False
"""Whether harmless text is refused, too, as it is in tests: each forgotten place is found there."""

guards_notations = bool(os.environ.get("FSMKIT_GUARD_NOTATIONS"))
"""Whether raw text is refused in drawings and models, too (`notating`)."""


class RawText(TypeError):  # noqa: N818 - a mistake of a printer, not of who uses it
    """A printer put text of a file into what it prints without a function of the language."""


class Written(str):
    """A text of a file, or one made of such (`telling`)."""

    __slots__ = ()

    def __format__(self, spec: str) -> str:
        found = plain(self)
        if _IS_PRINTING.get() and (is_strict or not HARMLESS.fullmatch(found)):
            raise RawText(f"raw text in what is printed: {found!r}")
        return format(found, spec)

    def __str__(self) -> str:
        return self

    def __add__(self, other: str) -> Written:
        return Written(str.__add__(self, other))

    def __radd__(self, other: str) -> Written:
        return Written(str.__add__(other, self))

    def lower(self) -> Self:
        """Return the text in lower case, guarded."""
        return type(self)(plain(self).lower())

    def upper(self) -> Self:
        """Return the text in upper case, guarded."""
        return type(self)(plain(self).upper())


class Identifier(str):
    """An identifier of some language, made of a name: every character of it is chosen."""

    __slots__ = ()

    def __new__(cls, text: str) -> Self:
        """Take a text that is one; `RawText` if it is not."""
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text):
            raise RawText(f"no identifier: {text!r}")
        return super().__new__(cls, text)


def plain(text: str) -> str:
    """Return a text without its guard: for the functions of a language, and nobody else."""
    return str.__str__(text)


UNGUARDED = frozenset({str, tuple})
"""Types of what may have to be guarded; a text that is guarded has a type of its own."""


def guard(instance: object, *names: str) -> None:
    """Make texts of a frozen instance guarded, and those in tuples; None stays."""
    for name in names:
        value = getattr(instance, name)
        if type(value) in (str, tuple):
            object.__setattr__(instance, name, guarded(value))


def guarded(value: object) -> object:
    """Return a value in which every text is guarded: the same where none was not."""
    if isinstance(value, tuple):
        if UNGUARDED.isdisjoint(map(type, value)):  # such as thousands of flags
            return value
        return tuple(map(guarded, value))
    return Written(plain(value)) if type(value) is str else value


def printing(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Mark a function that prints text of another language: while it runs, raw text is refused."""
    return _within(function, is_printing=True)


def notating(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Mark a function that prints a notation which nothing executes: a drawing, a model.

    Raw text is refused only where `guards_notations`, as in tests: in use, a forgotten place
    spoils one picture, and must not end the command.
    """
    return _within(function, is_printing=None)


def telling(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Mark a function that makes text for people of names: its result is guarded in their place.

    The result is a text, or a tuple of texts.
    """
    inside = _within(function, is_printing=False)

    @wraps(function)
    def guarding(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        return cast("Made", guarded(inside(*args, **kwargs)))

    return guarding


def _within(function: Callable[Given, Made], *, is_printing: bool | None) -> Callable[Given, Made]:
    @wraps(function)
    def inside(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        token = _IS_PRINTING.set(guards_notations if is_printing is None else is_printing)
        try:
            return function(*args, **kwargs)
        finally:
            _IS_PRINTING.reset(token)

    return inside
