"""Texts in C."""

from __future__ import annotations

from fsmkit.texts.lines import one_line


def comment(text: str) -> str:
    """Return a text as it can stand in a comment: no name ends it, or begins a line."""
    return one_line(text).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")


def quoted(text: str) -> str:
    """Return a literal of a string."""
    return f'"{inside(text)}"'


def inside(text: str) -> str:
    """Return what stands between the quotes, with octal escapes, which no digit can lengthen."""
    return "".join(
        chr(byte) if 32 <= byte < 127 and byte not in b'"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )


def printed(text: str) -> str:
    """Return what stands between the quotes in a format of ``printf``."""
    return inside(text).replace("%", "%%")
