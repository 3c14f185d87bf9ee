"""Dotted names of variables and states in copies: ``axis[0].tries`` is ``axis.0.tries``."""

from __future__ import annotations

import re
from collections.abc import Mapping

from fsmkit.language.tree import Literal

INDEX = re.compile(r"\s*\[\s*(\w+)\s*\]")


def dotted(name: str, constants: Mapping[str, Literal]) -> str:
    """Return the name of a state with dots for indices, which are numbers or constants."""

    def number(match: re.Match[str]) -> str:
        word = match[1]
        value = constants[word].value if word in constants else word
        return f".{value}"

    return INDEX.sub(number, name) if "[" in name else name
