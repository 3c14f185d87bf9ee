"""Print the flat form in the expressions of TChecker (`program.yy` of TChecker, 0.8).

A guard there is a conjunction nested to the right, ``a && (b && c)``. Each part is a number, a
comparison of numbers, or a negation of such. There is no disjunction, and a comparison is not a
number. So ``a || b`` becomes ``(a ? 1 : (b ? 1 : 0)) > 0``, which evaluates ``b`` only where ``||``
does, and a stored truth value becomes ``a == b ? true : false``. The importer (uppaal-to-tchecker)
does not change parentheses and choices.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from fsmkit.export.uppaal.network import Edge, Location, Template

TOKEN = re.compile(r"\s*(\d+|[A-Za-z_][\w.]*|\|\||&&|==|!=|<=|>=|[-+*/%<>!?:()\[\]])")
LEVELS = (("||",), ("&&",), ("==", "!="), ("<", "<=", ">", ">="), ("+", "-"), ("*", "/", "%"))
"""Operators of two operands, the loosest first."""
KEPT = 1 << 14
"""Expressions that are kept: the edges of a large template repeat them."""
LOGICAL = frozenset({"||", "&&", "!", *LEVELS[2], *LEVELS[3]})
"""Operators whose result is a truth value."""


@dataclass(frozen=True, slots=True)
class Node:
    """An expression: an operator and its operands, or a word without operands.

    The operator of a choice is ``?``, that of an element of an array ``[``.
    """

    word: str
    operands: tuple[Node, ...] = ()

    @property
    def is_logical(self) -> bool:
        """Whether it is a truth value that TChecker does not accept as a number."""
        return bool(self.operands) and self.word in LOGICAL


class _Reader:
    """Parses an expression that this package wrote."""

    def __init__(self, text: str) -> None:
        self._words: list[str] = TOKEN.findall(text)
        self._at = 0
        assert "".join(self._words) == re.sub(r"\s", "", text), text  # noqa: S101

    def expression(self) -> Node:
        test = self._binary(0)
        if not self._skip("?"):
            return test
        then = self.expression()
        self._expect(":")
        return Node("?", (test, then, self.expression()))

    def _binary(self, level: int) -> Node:
        if level == len(LEVELS):
            return self._prefix()
        found = self._binary(level + 1)
        while self._next in LEVELS[level]:
            word = self._take()
            found = Node(word, (found, self._binary(level + 1)))
        return found

    def _prefix(self) -> Node:
        if self._next in ("!", "-"):
            return Node(self._take(), (self._prefix(),))
        if self._skip("("):
            found = self.expression()
            self._expect(")")
            return found
        found = Node(self._take())
        if self._skip("["):
            found = Node("[", (found, self.expression()))
            self._expect("]")
        return found

    @property
    def _next(self) -> str:
        return self._words[self._at] if self._at < len(self._words) else ""

    def _take(self) -> str:
        self._at += 1
        return self._words[self._at - 1]

    def _skip(self, word: str) -> bool:
        is_next = self._next == word
        self._at += is_next
        return is_next

    def _expect(self, word: str) -> None:
        taken = self._take()
        assert taken == word, (taken, word)  # noqa: S101  (written by this package)


def for_tchecker(template: Template) -> Template:
    """Return a template whose guards, invariants and updates TChecker can read."""
    return replace(
        template,
        locations=tuple(map(_location, template.locations)),
        edges=tuple(map(_edge, template.edges)),
    )


def _location(location: Location) -> Location:
    return replace(location, invariant=_nested(location.invariant))


def _edge(edge: Edge) -> Edge:
    return replace(edge, guard=_nested(edge.guard), update=tuple(map(_assignment, edge.update)))


def _nested(parts: Sequence[str]) -> tuple[str, ...]:
    """Return conditions as two parts at most, the second a conjunction nested to the right."""
    found = [text for part in parts for text in _parts(part)]
    return tuple(found) if len(found) < 3 else (found[0], f"({_conjunction(found[1:])})")


@lru_cache(KEPT)
def _parts(condition: str) -> list[str]:
    return _conjuncts(_Reader(condition).expression())


@lru_cache(KEPT)
def _assignment(update: str) -> str:
    target, _, value = update.partition(" = ")
    return f"{_number(_Reader(target).expression())} = {_value(_Reader(value).expression())}"


def _conjuncts(node: Node) -> list[str]:
    """Return the parts of a condition: numbers, comparisons, and negations of these."""
    match node:
        case Node("&&", parts):
            return [text for part in parts for text in _conjuncts(part)]
        case Node("||"):
            return [f"{_truth(node)} > 0"]
        case Node("!", (Node("&&" | "||") as inner,)):
            return [f"{_truth(inner)} == 0"]
        case Node("!", (Node("!", (inner,)),)):
            return _conjuncts(inner)
        case Node("!", (inner,)):
            (text,) = _conjuncts(inner)
            return [f"!({text})"] if inner.operands else [f"!{text}"]
        case Node(word, (left, right)) if node.is_logical:
            return [f"{_number(left)} {word} {_number(right)}"]
        case _:
            return [_number(node)]


def _condition(node: Node) -> str:
    return _conjunction(_conjuncts(node))


def _conjunction(parts: Sequence[str]) -> str:
    if len(parts) == 1:
        return parts[0]
    rest = _conjunction(parts[1:])
    return f"{parts[0]} && {rest}" if len(parts) == 2 else f"{parts[0]} && ({rest})"


def _truth(node: Node) -> str:
    """Return 1 if a condition holds, else 0."""
    match node:
        case Node("||", (left, right)):
            return f"({_condition(left)} ? 1 : {_truth(right)})"
        case _:
            return f"({_condition(node)} ? 1 : 0)"


def _number(node: Node) -> str:
    """Return an operand: a number of TChecker, in parentheses if it has operators."""
    text = _value(node)
    is_bare = not node.operands or node.word == "["
    return text if is_bare or (node.word == "-" and len(node.operands) == 1) else f"({text})"


def _value(node: Node) -> str:
    if node.is_logical:
        return f"{_condition(node)} ? true : false"
    match node:
        case Node("?", (test, then, otherwise)):
            return f"{_condition(test)} ? {_number(then)} : {_number(otherwise)}"
        case Node("[", (array, index)):
            return f"{array.word}[{_value(index)}]"
        case Node("-", (operand,)):
            return f"-{_number(operand)}"
        case Node(word, (left, right)):
            return f"{_number(left)} {word} {_number(right)}"
        case _:
            return node.word
