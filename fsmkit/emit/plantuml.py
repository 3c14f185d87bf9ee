"""Strings in PlantUML: special characters become numeric characters."""

from __future__ import annotations

import re

from fsmkit.emit.lines import one_line

CREOLE = re.compile(r'["\\<>{}~%|`]|([*/_#=.!\-\[\]])\1+|^[*#=]')
"""Characters of PlantUML's markup, macros and quotes."""


def escaped(text: str) -> str:
    """Return a text on one line; white space at its start is kept."""
    clean = one_line(text)
    spaces = len(clean) - len(clean.lstrip(" "))
    return "<U+00A0>" * spaces + CREOLE.sub(_numbers, clean[spaces:])


def _numbers(match: re.Match[str]) -> str:
    return "".join(f"<U+{ord(char):04X}>" for char in match[0])
