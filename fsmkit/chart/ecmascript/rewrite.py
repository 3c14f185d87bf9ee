"""Change a piece of an expression that is still text."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from fsmkit.diagnostics import Text
from fsmkit.language.syntax import NameNode, Node, SyntaxFault, children, parse

Change = Callable[[Node], str | None]
"""The replacement of a node; None: visit its parts."""


class Unsuited(Exception):  # noqa: N818  (never leaves the passes)
    """A use of a variable that a rewrite does not support."""


def parsed(text: Text) -> Node | None:
    """Return the parsed expression, or None if the text is not an expression."""
    try:
        return parse(text.value)
    except SyntaxFault:
        return None


def rewrite_text(text: Text, name: str, change: Change) -> Text:
    """Return an expression with its changes; `Unsuited` if it has the name but cannot be read."""
    if name not in text.value:
        return text
    node = parsed(text)
    if node is None:
        if mentions(name, text.value):
            raise Unsuited
        return text
    value = rewrite_node(node, text.value, change)
    return text if value == text.value else text.with_value(value)


def rewrite_node(node: Node, text: str, change: Change) -> str:
    """Return the source of a node in which ``change`` replaced nodes."""
    changed = change(node)
    if changed is not None:
        return changed
    found, end = "", node.start
    for child in sorted(children(node), key=lambda child: child.start):
        found += text[end : child.start] + rewrite_node(child, text, change)
        end = child.end
    return found + text[end : node.end]


def mentions(name: str, text: str) -> int:
    """Return how often a name occurs in a text."""
    return len(re.findall(rf"(?<![\w$]){re.escape(name)}(?![\w$])", text))


def names(node: Node | None) -> set[str]:
    """Return the names in an expression."""
    return {each.name for each in nodes(node) if isinstance(each, NameNode)}


def nodes(node: Node | None) -> Iterator[Node]:
    """Yield a node and all below it."""
    if node is not None:
        yield node
        for child in children(node):
            yield from nodes(child)
