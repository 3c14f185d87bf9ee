"""Strings in Mermaid: special characters become entities."""

from __future__ import annotations

import re

from fsmkit.emit.lines import one_line

STATES = re.compile(r'[#:;<>{}"%\\`&]|--')
IN_HEAD = re.compile(r'["\\%<>]')
"""Ends of quoted strings, and marks of directives and tags, which Mermaid finds in all lines."""
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
    """Return a text in the head, which is YAML: quoted, with escapes (YAML 1.2, 5.7)."""
    return '"' + IN_HEAD.sub(_escapes, one_line(text)) + '"'


def _escapes(match: re.Match[str]) -> str:
    return f"\\x{ord(match[0]):02x}"


def _entities(match: re.Match[str]) -> str:
    return "".join(f"#{ord(char)};" for char in match[0])
