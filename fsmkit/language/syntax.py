"""The syntax tree of expressions, before any name is looked up.

Reading is linear in the length of the text and does not recurse. A tree nests less than `DEEPEST`,
so later passes may recurse.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from typing import Any

from lark import Lark, Token, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from fsmkit.language.parser_tables import load_parser
from fsmkit.language.relocation import field_getter
from fsmkit.language.statements.building import EMITTED, StatementBuilder
from fsmkit.language.statements.tokens import NO_ZERO, WITHOUT_ZERO, unescape
from fsmkit.language.units import split_number, suggest_duration, suggest_sum, unknown_unit

DEEPEST = 100
"""Maximum nesting of an expression; operators in a row nest, too."""
LONGEST = 1_000_000
"""Maximum length of an expression, in characters."""
SHORT = 200
"""Maximum length of an expression that is cached, in characters."""
QUOTED = re.compile("[\"'`]")
INTEGER = re.compile(r"(?<![\w.$])\d+(?![\w.$])")
"""A whole number; a cached tree serves for other numbers with as many digits."""


@dataclass(frozen=True, slots=True)
class Node:
    """A node: its location in the text (including brackets) and its height."""

    start: int
    end: int
    height: int


@dataclass(frozen=True, slots=True)
class NameNode(Node):
    """A name."""

    name: str


@dataclass(frozen=True, slots=True)
class NumberNode(Node):
    """A number, as written."""

    digits: str


@dataclass(frozen=True, slots=True)
class DurationNode(Node):
    """A number with a unit of time, as written."""

    written: str


@dataclass(frozen=True, slots=True)
class StringNode(Node):
    """A string, with its escapes resolved."""

    value: str


@dataclass(frozen=True, slots=True)
class TruthNode(Node):
    """``true`` or ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class SuperNode(Node):
    """``super``: the guard of the base chart."""


@dataclass(frozen=True, slots=True)
class ArrayNode(Node):
    """``[a, b]``."""

    items: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class UnaryNode(Node):
    """A prefix operator; ``op`` in the notation of C."""

    op: str
    operand: Node


@dataclass(frozen=True, slots=True)
class BinaryNode(Node):
    """An infix operator and its location; ``and`` and ``or`` are normalized."""

    op: str
    left: Node
    right: Node
    op_start: int
    op_end: int


@dataclass(frozen=True, slots=True)
class ConditionalNode(Node):
    """``test ? then : otherwise``, or ``then if test else otherwise``."""

    test: Node
    then: Node
    otherwise: Node


@dataclass(frozen=True, slots=True)
class ElementNode(Node):
    """``base[index]``."""

    base: Node
    index: Node


@dataclass(frozen=True, slots=True)
class MemberNode(Node):
    """``base.name``."""

    base: Node
    name: str
    name_start: int


@dataclass(frozen=True, slots=True)
class CallNode(Node):
    """``callee(arguments)``."""

    callee: Node
    arguments: tuple[Node, ...]


def children(node: Node) -> tuple[Node, ...]:
    """Return the direct parts of a node, in field order."""
    found: list[Node] = []
    for value in _values(node):
        found += [value] if isinstance(value, Node) else value if type(value) is tuple else ()
    return tuple(found)


def map_leaves(node: Node, change: Callable[[Node], Node]) -> Node:
    """Return a node whose leaves are replaced by `change`."""
    values = _values(node)
    if not any(isinstance(value, Node | tuple) for value in values):
        return change(node)

    def rebuild(value: Any) -> Any:
        if isinstance(value, Node):
            return map_leaves(value, change)
        return tuple(map(rebuild, value)) if type(value) is tuple else value

    return change(node.__class__(*map(rebuild, values)))


def _values(node: Any) -> tuple[Any, ...]:
    return _field_getter(node.__class__)(node)


@cache
def _field_getter(kind: type[Node]) -> Callable[[Node], tuple[Any, ...]]:
    return field_getter(tuple(field.name for field in fields(kind)))


class SyntaxFault(Exception):  # noqa: N818  (becomes a finding at once)
    """The reason why a text is not an expression: the violated rule, the location, and advice."""

    def __init__(self, rule: str, message: str, start: int, end: int, advice: str | None) -> None:
        """Store the parts of the finding."""
        super().__init__(message)
        self.rule, self.message, self.start, self.end, self.advice = (
            rule,
            message,
            start,
            end,
            advice,
        )


WORDS = {"and": "&&", "or": "||", "not": "!", "===": "==", "!==": "!="}


@v_args(inline=True)
class _Builder(StatementBuilder):
    """Builds nodes bottom up while the parser runs; rejects trees that nest too deeply."""

    def name(self, token: Token) -> Node:
        return NameNode(*_place(token), 1, str(token))

    def number(self, token: Token) -> Node:
        return NumberNode(*_place(token), 1, str(token))

    def duration(self, token: Token) -> Node:
        return DurationNode(*_place(token), 1, str(token))

    def string(self, token: Token) -> Node:
        text = unescape(str(token)[1:-1])
        if "\0" in text:
            raise SyntaxFault("expression-syntax", NO_ZERO, *_place(token), WITHOUT_ZERO)
        return StringNode(*_place(token), 1, text)

    def true(self, token: Token) -> Node:
        return TruthNode(*_place(token), 1, True)

    def false(self, token: Token) -> Node:
        return TruthNode(*_place(token), 1, False)

    def super(self, token: Token) -> Node:
        return SuperNode(*_place(token), 1)

    def group(self, opening: Token, inner: Node, closing: Token) -> Node:
        start, end = _place(opening)[0], _place(closing)[1]
        return replace(inner, start=start, end=end, height=_height(start, end, inner))

    def array(self, opening: Token, *rest: Any) -> Node:
        items = _items(rest)
        start, end = _place(opening)[0], _place(rest[-1])[1]
        return ArrayNode(start, end, _height(start, end, *items), items)

    def unary(self, op: Token, operand: Node) -> Node:
        start = _place(op)[0]
        height = _height(start, operand.end, operand)
        return UnaryNode(start, operand.end, height, WORDS.get(op, str(op)), operand)

    foreign_prefix = unary

    def binary(self, left: Node, op: Token, right: Node) -> Node:
        height = _height(left.start, right.end, left, right)
        written = WORDS.get(op, str(op))
        return BinaryNode(left.start, right.end, height, written, left, right, *_place(op))

    def conditional(self, test: Node, then: Node, otherwise: Node) -> Node:
        height = _height(test.start, otherwise.end, test, then, otherwise)
        return ConditionalNode(test.start, otherwise.end, height, test, then, otherwise)

    def chosen(self, then: Node, test: Node, otherwise: Node) -> Node:
        height = _height(then.start, otherwise.end, test, then, otherwise)
        return ConditionalNode(then.start, otherwise.end, height, test, then, otherwise)

    def element(self, base: Node, index: Node, closing: Token) -> Node:
        end = _place(closing)[1]
        return ElementNode(base.start, end, _height(base.start, end, base, index), base, index)

    def member(self, base: Node, name: Token) -> Node:
        start, end = _place(name)
        return MemberNode(base.start, end, _height(base.start, end, base), base, str(name), start)

    def call(self, callee: Node, *rest: Any) -> Node:
        items = _items(rest)
        end = _place(rest[-1])[1]
        return CallNode(
            callee.start, end, _height(callee.start, end, callee, *items), callee, items
        )

    def list(self, *items: Node) -> tuple[Node, ...]:
        return items


def _place(token: Token) -> tuple[int, int]:
    start = token.start_pos or 0
    return start, start + len(token)


def _items(rest: tuple[Any, ...]) -> tuple[Node, ...]:
    """Return the items of an optional list before its closing bracket."""
    return rest[0] if isinstance(rest[0], tuple) else ()


def _height(start: int, end: int, *below: Node) -> int:
    height = 1 + max((node.height for node in below), default=0)
    if height > DEEPEST:
        raise SyntaxFault(
            "expression-too-deep",
            f"the expression nests deeper than {DEEPEST} levels",
            start,
            end,
            "split it: store parts of it in variables first",
        )
    return height


@cache
def parser() -> Lark:
    """Return the parser of expressions, statements and declarations."""
    return load_parser(_Builder())


def parse(text: str) -> Node:
    """Read an expression; raise `SyntaxFault` for an invalid one."""
    if not text.strip():
        raise SyntaxFault(
            "expression-syntax", "an expression is missing", 0, len(text), "write one here"
        )
    if len(text) > LONGEST:
        raise SyntaxFault(
            "expression-too-deep",
            f"the expression is longer than {LONGEST} characters",
            0,
            1,
            "split it: store parts of it in variables first",
        )
    try:
        return _parse_cached(text) if len(text) <= SHORT else _parse_uncached(text)
    except UnexpectedInput as error:
        raise _fault(text, error) from None


@lru_cache(maxsize=200_000)
def _parse_cached(text: str) -> Node:
    """Read a short expression; charts repeat the same conditions with different numbers."""
    shape = text if QUOTED.search(text) else INTEGER.sub(lambda match: "0" * len(match[0]), text)
    if shape == text:
        return _parse_uncached(text)

    def numbered(node: Node) -> Node:
        if not isinstance(node, NumberNode) or node.digits.strip("0"):
            return node
        found = INTEGER.search(text, node.start, node.end)
        return node if found is None else replace(node, digits=found[0])

    return map_leaves(_parse_cached(shape), numbered)


def _parse_uncached(text: str) -> Node:
    if text.isascii() and text.isdigit():
        return NumberNode(0, len(text), 1, text)  # half of all expressions in charts
    # the parser runs the transformer and returns its result
    node: Any = parser().parse(text, start="expression")
    assert isinstance(node, Node)  # noqa: S101
    return node


SPACED = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)\s+(us|ms|s|min|h)$")
"""A duration with a blank before its unit."""
ASSIGNS = re.compile(r"\w[\w.[\]]*\s*=(?!=)")
FOREIGN = {
    "function": "declare an operation and call it",
    "=>": "write `>=` to compare; for a function declare an operation and call it",
    "new": "declare the data with its type",
    "instanceof": "the types of all data are known when compiling",
    "delete": "data live as long as the machine",
    "await": "declare an event for the answer",
    "lambda": "declare an operation and call it",
}


def _fault(text: str, error: UnexpectedInput) -> SyntaxFault:
    if isinstance(error, UnexpectedToken) and error.token.type == "$END":
        end = len(text.rstrip())
        return SyntaxFault(
            "expression-syntax",
            "the expression ends too early",
            max(0, end - 1),
            end,
            _closing(text) or "write the operand that is missing",
        )
    at = error.pos_in_stream or 0
    size = len(error.token) if isinstance(error, UnexpectedToken) else 1
    for word, advice in FOREIGN.items():
        if word in text[: at + size + len(word)].replace("(", " ").split():
            start = text.find(word)
            message = f"`{word}` is outside the language"
            return SyntaxFault("outside-language", message, start, start + len(word), advice)
    if (wrong := split_number(text, at)) is not None:
        word, advice = wrong[1], suggest_duration(*wrong)
        return SyntaxFault("expression-syntax", unknown_unit(word), at, at + len(word), advice)
    found = text[at : at + size]
    if (parts := suggest_sum(text, at)) is not None:
        message = f"`{found}` is not expected here"
        return SyntaxFault("expression-syntax", message, at, at + size, parts)
    return SyntaxFault(
        "expression-syntax",
        f"`{found}` is not expected here",
        at,
        at + size,
        _advice(text, at, found, isinstance(error, UnexpectedCharacters)),
    )


def _closing(text: str) -> str | None:
    for opening, closing in ("()", "[]"):
        if text.count(opening) > text.count(closing):
            return f"close the bracket with `{closing}`"
    return None


CALLED = {
    "is": "compare with `==`",
    "equals": "compare with `==`",
    "xor": "compare with `!=`",
    "mod": "write `%`",
    "between": "write `lo <= x and x <= hi`",
    "then": "a choice of two values is `a if test else b`",
}
"""Operators that have another name here."""


def _advice(text: str, at: int, found: str, is_foreign: bool) -> str:
    if (emitted := EMITTED.match(text)) is not None:
        return f"write `send` for `{emitted[1]}`"
    before, after = text[:at].rstrip()[-1:], text[at + 1 : at + 2]
    rest = text[at + len(found) :].lstrip()
    match found:
        case _ if (spaced := SPACED.search(text[: at + len(found)])) is not None:
            return f"write the number and its unit together: `{spaced[1]}{spaced[2]}`"
        case _ if text.startswith("every "):
            return f"move it to the key `every`: `every: {{{text[6:].strip()}: ...}}`"
        case "=" if after == "<":
            return "write `<=`"
        case "=":
            return "compare with `==`; an assignment is a statement"
        case '"' | "'" if is_foreign:
            return "close the string with the same quote, on the same line"
        case "{":
            return "declare a record type, and assign its fields one by one"
        case "`":
            return "write a string in single or double quotes"
        case ")" | "]":
            return "remove it, or write the operand that is missing"
        case "+" | "-" if text[at - 1 : at] == found:
            return "`++` and `--` are statements of their own"
        case ";":
            return "an expression is not a statement: remove the semicolon"
        case ">" if before == "<":
            return "compare with `!=`"
        case ":" if after == "=" or not rest:
            return "assign with `=`"
        case ":" if before.isdigit() and after.isdigit():
            return "a time is a number with a unit, such as `5s`"
        case "," if before.isdigit() and after.isdigit():
            return "write a point: `1.5`"
        case "," if ASSIGNS.search(rest):
            return "separate statements with `;`"
        case word if word in CALLED:
            return CALLED[word]
        case word if word.isidentifier() and ASSIGNS.match(word + rest):
            return "separate statements with `;`"
        case _ if found[:1].isalnum() or found[:1] in "_\"'":
            return "write an operator between the two"
        case _:
            return "remove it, or write the operand that is missing"
