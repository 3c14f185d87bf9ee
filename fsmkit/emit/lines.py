"""Texts on a line of their own: comments that end with it, titles, labels; JSON on a terminal."""

from __future__ import annotations

import json
import re

from fsmkit.emit.written import plain


def one_line(text: str) -> str:
    """Return a string as one printable line, without line ends and marks of text direction.

    For comments after ``//``, ``--`` or ``#``.
    """
    clean = plain(text)
    if clean.isprintable():
        return clean
    return "".join(char if char.isprintable() else " " for char in text)


_UNSAFE = re.compile(
    "[\\x7f-\\x9f\\u00ad\\u061c\\u200b-\\u200f\\u2028-\\u202e\\u2060-\\u206f\\ufeff\\ud800-\\udfff]"
)
"""Characters that JSON allows raw, but terminals interpret or UTF-8 cannot encode."""


def json_text(document: object) -> str:
    """Return JSON that is safe to print: control characters and marks of direction are escaped."""
    text = json.dumps(document, indent=2, ensure_ascii=False)
    return _UNSAFE.sub(lambda found: f"\\u{ord(found[0]):04x}", text) + "\n"
