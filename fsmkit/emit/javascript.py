"""Texts in JavaScript (ECMA-262)."""

from __future__ import annotations

import json
import re

from fsmkit.emit.lines import one_line
from fsmkit.emit.written import plain


def quoted(text: str) -> str:
    """Return a literal of a string, of ASCII alone; nothing in it ends a script of a page."""
    return json.dumps(plain(text)).replace("<", "\\u003c")


def member(name: str) -> str:
    """Return the access to a property: ``.speed`` or ``["top speed"]``."""
    found = plain(name)
    return f".{found}" if re.fullmatch(r"[A-Za-z_$][A-Za-z0-9_$]*", found) else f"[{quoted(name)}]"


def comment(text: str) -> str:
    """Return a text for a comment that ends with its line."""
    return one_line(text).replace("</", "< /")
