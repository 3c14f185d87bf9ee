"""Texts in XML that is written by hand; where a library writes it, that escapes."""

from __future__ import annotations

from html import escape

from fsmkit.emit.lines import one_line


def characters(text: str) -> str:
    """Return a text of such characters as a document may hold (XML 1.0, production 2)."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else " " for c in text)


def escaped(text: str) -> str:
    """Return a text for an element or an attribute in quotes, on one line."""
    return escape(one_line(text), quote=True)
