"""Texts on a line of their own: comments that end with it, titles, labels."""

from __future__ import annotations

from fsmkit.texts.written import plain


def one_line(text: str) -> str:
    """Return a text on one line, of what can be printed: no line end, no mark of direction.

    For comments after ``//``, ``--`` or ``#``; nothing in them is more than text.
    """
    clean = plain(text)
    if clean.isprintable():
        return clean
    return "".join(char if char.isprintable() else " " for char in text)
