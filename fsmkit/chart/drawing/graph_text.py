"""Read the text of a graph for Graphviz: its statements, and where their attributes are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

TOKEN = re.compile(
    r'"(?:[^"\\]|\\.)*"|->|[{}\[\];,=]|<(?:[^<>]|<[^<>]*>)*>|[^\s{}\[\];,=<"]+', re.DOTALL
)
"""A token; a label in markup is one, whose tags have no others in them."""


class Attribute(NamedTuple):
    """A value of an attribute, and its place in a text."""

    value: str
    start: int
    end: int


class Statement(NamedTuple):
    """A graph, a node or an arrow with its attributes.

    ``owner``: what it is, and its name; the id of an arrow. ``head``: the words before the
    attributes. ``cluster``: the cluster around it. ``start`` and ``inside``: where the statement
    starts, and where its first attribute does.
    """

    owner: tuple[str, str]
    attributes: Mapping[str, Attribute]
    head: tuple[str, ...]
    cluster: str
    start: int
    inside: int


def statements(text: str) -> Iterator[Statement]:
    """Yield the graphs, nodes and arrows of a text."""
    stack: list[str] = []
    head: list[str] = []
    start = 0
    tokens = _tokens(text)
    for word, at, end in tokens:
        if word == "{":
            stack.append(head[-1] if head else "")
            head = []
        elif word == "}":
            stack.pop()
            head = []
        elif word == ";":
            head = []
        elif word == "[":
            found = _attributes(tokens)
            outer = stack[:-1] if head == ["graph"] else stack
            around = next((name for name in reversed(outer) if name.startswith("cluster")), "")
            place = (tuple(head), around, start, end)
            if "->" in head:
                yield Statement(("edge", _value(found, "id")), found, *place)
            elif head == ["graph"]:
                yield Statement(("graph", stack[-1]), found, *place)
            elif head not in (["node"], ["edge"]):
                yield Statement(("node", head[0]), found, *place)
        else:
            if not head:
                start = at
            head.append(_plain(word))


def _value(attributes: Mapping[str, Attribute], key: str) -> str:
    return attributes[key].value if key in attributes else ""


def _attributes(tokens: Iterator[tuple[str, int, int]]) -> dict[str, Attribute]:
    found: dict[str, Attribute] = {}
    key = ""
    for word, start, end in tokens:
        if word == "]":
            break
        if word in ",;":
            key = ""
        elif word != "=":
            if key:
                found[key] = Attribute(_plain(word), start, end)
            else:
                key = _plain(word)
    return found


def _tokens(text: str) -> Iterator[tuple[str, int, int]]:
    """Yield the tokens of a text with their places."""
    for found in TOKEN.finditer(text):
        yield found[0], found.start(), found.end()


def _plain(token: str) -> str:
    """Return a token without quotes, and without the breaks of a long one."""
    return token[1:-1].replace("\\\n", "") if token.startswith('"') else token
