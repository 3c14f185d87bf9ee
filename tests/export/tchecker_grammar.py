"""What TChecker reads, by its grammar; and what its importer makes of expressions of UPPAAL.

`imported` does what uppaal-to-tchecker does: it puts each operator of two operands in parentheses,
and the operand of each negation. `is_guard` and `is_term` decide whether TChecker's parser
(``program.yy``) derives the result from ``conjunctive_formula`` and from ``term``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

TOKEN = re.compile(r"\s*(\d+|[A-Za-z_][\w.]*|\|\||&&|==|!=|<=|>=|<<|>>|[-+*/%<>!?:()\[\]&|^])")
BINDING = {"||": 1, "&&": 2, "|": 3, "^": 4, "&": 5, "==": 6, "!=": 6, "<": 7, "<=": 7, ">": 7,
           ">=": 7, "<<": 8, ">>": 8, "+": 9, "-": 9, "*": 10, "/": 10, "%": 10}  # fmt: skip
COMPARISONS = frozenset({"==", "!=", "<", "<=", ">", ">="})
ARITHMETIC = frozenset({"+", "-", "*", "/", "%"})


def imported(text: str) -> list[str]:
    """Return the tokens that the importer writes for an expression of UPPAAL."""
    tokens = TOKEN.findall(text)
    assert "".join(tokens) == re.sub(r"\s", "", text)
    left, rest = _choice(tokens)
    assert not rest
    return left


def _choice(tokens: list[str]) -> tuple[list[str], list[str]]:
    test, rest = _infix(tokens, 1)
    if rest[:1] != ["?"]:
        return test, rest
    then, rest = _choice(rest[1:])
    assert rest[0] == ":"
    otherwise, rest = _choice(rest[1:])
    return ["(", "if", *test, "then", *then, "else", *otherwise, ")"], rest


def _infix(tokens: list[str], least: int) -> tuple[list[str], list[str]]:
    left, rest = _prefix(tokens)
    while rest and BINDING.get(rest[0], 0) >= least:
        word = rest[0]
        right, rest = _infix(rest[1:], BINDING[word] + 1)
        left = ["(", *left, word, *right, ")"]
    return left, rest


def _prefix(tokens: list[str]) -> tuple[list[str], list[str]]:
    first, rest = tokens[0], tokens[1:]
    if first in ("!", "-"):
        inner, rest = _prefix(rest)
        return [first, "(", *inner, ")"], rest
    if first == "(":
        inner, rest = _choice(rest)
        assert rest[0] == ")"
        return inner, rest[1:]
    if rest[:1] == ["["]:
        index, rest = _choice(rest[1:])
        assert rest[0] == "]"
        return [first, "[", *index, "]"], rest[1:]
    return [first], rest


def is_guard(tokens: list[str]) -> bool:
    """Whether TChecker reads tokens as a guard or an invariant."""
    return len(tokens) in _Derivations(tuple(tokens)).ends("conjunctive", 0)


def is_term(tokens: list[str]) -> bool:
    """Whether TChecker reads tokens as a value or an index."""
    return len(tokens) in _Derivations(tuple(tokens)).ends("term", 0)


class _Derivations:
    """Where each symbol of the grammar can end that begins at a token."""

    def __init__(self, tokens: tuple[str, ...]) -> None:
        self._tokens = tokens
        self.ends = cache(lambda symbol, at: frozenset(getattr(self, f"_{symbol}")(at)))

    def _at(self, at: int) -> str:
        return self._tokens[at] if at < len(self._tokens) else ""

    def _conjunctive(self, at: int) -> Iterator[int]:
        yield from self.ends("atomic", at)
        yield from self.ends("several", at)

    def _several(self, at: int) -> Iterator[int]:
        if self._at(at) == "(":
            yield from (end + 1 for end in self.ends("several", at + 1) if self._at(end) == ")")
        for end in self.ends("atomic", at):
            if self._at(end) == "&&":
                yield from self.ends("conjunctive", end + 1)

    def _atomic(self, at: int) -> Iterator[int]:
        yield from self.ends("term", at)
        yield from self.ends("predicate", at)
        if self._at(at) == "!":
            yield from self.ends("atomic", at + 1)

    def _predicate(self, at: int) -> Iterator[int]:
        if self._at(at) == "(":
            yield from (end + 1 for end in self.ends("predicate", at + 1) if self._at(end) == ")")
        for end in self.ends("term", at):
            if self._at(end) in COMPARISONS:
                yield from self.ends("term", end + 1)

    def _term(self, at: int) -> Iterator[int]:
        for end in self.ends("factor", at):
            yield end
            if self._at(end) in ARITHMETIC:
                yield from self.ends("term", end + 1)

    def _factor(self, at: int) -> Iterator[int]:
        word = self._at(at)
        if word == "-":
            yield from self.ends("factor", at + 1)
        elif re.fullmatch(r"\w[\w.]*", word):
            yield at + 1
            if self._at(at + 1) == "[":
                yield from (end + 1 for end in self.ends("term", at + 2) if self._at(end) == "]")
        elif word == "(" and self._at(at + 1) == "if":
            for test in self.ends("conjunctive", at + 2):
                for then in self.ends("term", test + 1) if self._at(test) == "then" else ():
                    ends = self.ends("term", then + 1) if self._at(then) == "else" else ()
                    yield from (end + 1 for end in ends if self._at(end) == ")")
        elif word == "(":
            yield from (end + 1 for end in self.ends("term", at + 1) if self._at(end) == ")")
