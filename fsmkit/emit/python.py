"""Texts in Python."""

from __future__ import annotations

from fsmkit.emit.lines import one_line

ESCAPES = {'"': '\\"', "\\": "\\\\"}


def quoted(text: str) -> str:
    """Return a string literal on one line."""
    return f'"{inside(text)}"'


def inside(text: str) -> str:
    """Return the content of a literal in double quotes."""
    return "".join(ESCAPES.get(c, c if c.isprintable() else repr(c)[1:-1]) for c in text)


def docstring(text: str) -> str:
    """Return a string for a docstring in three double quotes, on one line."""
    plain = one_line(text).replace("\\", "\\\\").replace('"""', "'''")
    return f"{plain[:-1]}'" if plain.endswith('"') else plain


def source_name(path: str) -> str:
    """Return the last part of a path of any system, for a docstring."""
    return docstring(path.replace("\\", "/").rpartition("/")[2])


def paragraph(text: str) -> str:
    """Return the same with the lines that it has."""
    return "\n".join(map(docstring, text.strip().splitlines()))
