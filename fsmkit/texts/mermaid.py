"""Texts in Mermaid: what it takes for its own is written as entities."""

from __future__ import annotations

import re

from fsmkit.texts.lines import one_line

STATES = re.compile(r'[#:;<>{}"%\\`&]|--')
SEQUENCES = re.compile(r"[#;<>&\"\\%{}\[\]`]")


def in_states(text: str) -> str:
    """Return a text in a diagram of states; white space at its start is kept."""
    clean = one_line(text)
    spaces = len(clean) - len(clean.lstrip(" "))
    return "#160;" * spaces + STATES.sub(_entities, clean[spaces:])


def in_sequence(text: str) -> str:
    """Return a text in a sequence diagram, where the word `end` would end a block."""
    return re.sub(r"\bend\b", "#101;nd", SEQUENCES.sub(_entities, one_line(text)))


def title(text: str) -> str:
    """Return a text in the head, which is YAML, in quotes."""
    return '"' + "".join(c for c in text if c.isprintable() and c not in '"\\') + '"'


def _entities(match: re.Match[str]) -> str:
    return "".join(f"#{ord(char)};" for char in match[0])
