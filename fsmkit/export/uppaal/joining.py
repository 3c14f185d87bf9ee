"""Parallel edges that one edge says as well: the same moves, with less to read."""

from __future__ import annotations

import re
from dataclasses import replace

from fsmkit.export.uppaal.network import Declared, Edge, Network, Sort, Template

FALLIBLE = re.compile(r"[\[/%]|<<|>>|\w\(")
"""What an expression that can go wrong holds: dropping it could lose an error."""
HEAD = re.compile(r"\w+\[0\] == \w+")


def joined(network: Network) -> Network:
    """Return a network without edges that another does as well."""
    return replace(network, templates=tuple(map(_template, network.templates)))


def _template(template: Template) -> Template:
    clocks = {
        one.name
        for one in template.declarations
        if isinstance(one, Declared) and one.sort is Sort.CLOCK
    }
    found: list[Edge] = []
    for edge in template.edges:
        one, place = edge, len(found)
        while True:
            pairs = ((n, _join(other, one, clocks)) for n, other in enumerate(found))
            better = next(((n, both) for n, both in pairs if both is not None), None)
            if better is None:
                break
            place, one = better
            del found[place]
        found.insert(place, one)
    return replace(template, edges=tuple(found))


def _join(one: Edge, other: Edge, clocks: set[str]) -> Edge | None:
    """Return the edge that does what either does, if there is one.

    The guards are the same but for one part each. Those are a test and its opposite: neither is
    needed. Or they test the first event of a queue: then a disjunction tests both.
    """
    alike = (one.source, one.target, one.select, one.sync, one.update)
    if alike != (other.source, other.target, other.select, other.sync, other.update):
        return None
    left = [part for part in one.guard if part not in other.guard]
    right = [part for part in other.guard if part not in one.guard]
    if not left and not right:
        return replace(one, comment=_comment(one, other))
    if len(left) != 1 or len(right) != 1:
        return None
    (mine,), (theirs,) = left, right
    if one.comment == other.comment and _opposite(mine, theirs, clocks):
        return _needing(replace(one, guard=tuple(p for p in one.guard if p != mine)))
    heads = _heads(mine), _heads(theirs)
    if heads[0] and heads[1]:
        both = f"({' || '.join(dict.fromkeys([*heads[0], *heads[1]]))})"
        guard = tuple(both if part == mine else part for part in one.guard)
        return replace(one, guard=guard, comment=_comment(one, other))
    return None


def _needing(edge: Edge) -> Edge:
    """Return an edge that selects only what it names."""
    used = set(re.findall(r"\w+", " ".join((*edge.guard, *edge.update))))
    return replace(edge, select=tuple(one for one in edge.select if one[0] in used))


def _comment(one: Edge, other: Edge) -> str:
    return ", ".join(dict.fromkeys(c for c in (one.comment, other.comment) if c))


def _opposite(one: str, other: str, clocks: set[str]) -> bool:
    if FALLIBLE.search(one) or clocks & set(re.findall(r"\w+", one)):
        return False
    return any(_is_whole(a) and b == f"!{a}" for a, b in ((one, other), (other, one)))


def _is_whole(text: str) -> bool:
    """Whether a negation before a text negates all of it."""
    if re.fullmatch(r"\w+", text):
        return True
    depth = 0
    for at, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return text[0] == "(" and at == len(text) - 1
    return False


def _heads(text: str) -> list[str]:
    """Return the tests of the first event that a part of a guard is made of."""
    if text[0] == "(" and _is_whole(text):
        text = text[1:-1]
    parts = text.split(" || ")
    return parts if all(HEAD.fullmatch(part) for part in parts) else []
