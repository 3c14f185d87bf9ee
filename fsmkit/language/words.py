"""Words of this language that ECMAScript leaves free: there they may be names."""

from __future__ import annotations

import re
from collections.abc import Set as AbstractSet
from dataclasses import replace

from fsmkit.language.syntax import MemberNode, NameNode, Node, changed, parse

OWN_WORDS = frozenset({"and", "or", "not", "True", "False"})
"""Words of this language that are names in ECMAScript."""
OWN_WORD = re.compile(
    r"""("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|(?<![\w$])(?:and|or|not|True|False)(?![\w$]))"""
)
"""Such a word, or a string, in which none stands."""
MASKED = {word: "".join(chr(0xFEE0 + ord(letter)) for letter in word) for word in OWN_WORDS}
"""Names, as long, that the grammar takes for names everywhere: in letters of full width."""
UNMASKED = {masked: word for word, masked in MASKED.items()}


def parse_with_names(text: str, names: AbstractSet[str]) -> Node:
    """Read an expression in which some of `OWN_WORDS` are names, as in ECMAScript they may be."""
    own = names & OWN_WORDS
    pieces = OWN_WORD.split(text) if own else [text]
    masked = "".join(MASKED[piece] if piece in own else piece for piece in pieces)
    return parse(text) if masked == text else changed(parse(masked), _unmasked)


def _unmasked(node: Node) -> Node:
    if isinstance(node, NameNode | MemberNode):
        return replace(node, name=UNMASKED.get(node.name, node.name))
    return node
