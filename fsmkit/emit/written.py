"""Guard strings from files, so that no printer of a language inserts them raw.

Every name, doc, label and string of a chart is `Written`. While a function marked `printing` runs,
only the functions of a language (`fsmkit.emit.c` and so on, and those that build identifiers) can
insert such a string. An f-string with it raises `RawText`, and the result of ``+`` is guarded,
too. So a name is never code: a wrong printer fails.

The guard has two gaps, which the tests with hostile names cover: ``str.join``, and functions that
split a string, which return plain ``str``.
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
"""Whether harmless strings are rejected, too, so that tests find each omission."""

guards_notations = bool(os.environ.get("FSMKIT_GUARD_NOTATIONS"))
"""Whether raw strings are rejected in drawings and models, too (`notating`)."""


class RawText(TypeError):  # noqa: N818 - a bug of a printer, not of its user
    """A printer inserted a string of a file without a function of the language."""


class Written(str):
    """A string of a file, or built from such strings (`telling`)."""

    __slots__ = ()

    def __format__(self, spec: str) -> str:
        found = plain(self)
        if _IS_PRINTING.get() and (is_strict or not HARMLESS.fullmatch(found)):
            raise RawText(f"raw string in printed source: {found!r}")
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
    """An identifier of some language, built from a name with checked characters."""

    __slots__ = ()

    def __new__(cls, text: str) -> Self:
        """Take a text that is one; `RawText` if it is not."""
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text):
            raise RawText(f"no identifier: {text!r}")
        return super().__new__(cls, text)


def plain(text: str) -> str:
    """Return a string without its guard; only for the functions of a language."""
    return str.__str__(text)


UNGUARDED = frozenset({str, tuple})
"""Types that may need the guard; a guarded string has its own type."""


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
    """Mark a function that prints another language: while it runs, raw strings are rejected."""
    return _within(function, is_printing=True)


def notating(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Mark a function that prints a notation which nothing executes: a drawing, a model.

    Raw strings are rejected only if `guards_notations` is set, as in tests. In use, an omission
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
