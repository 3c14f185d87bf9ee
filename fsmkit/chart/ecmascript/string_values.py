"""The values of expressions over strings, as ECMAScript computes them.

ECMA-262 22.1.3 (methods), 19.2.4 and 19.2.5 (``parseFloat``, ``parseInt``), 21.1.1 (``Number``).
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

from fsmkit.language import syntax

Value = str | int | float | bool
INT32 = range(-(2**31), 2**31)
EQUALITY: Mapping[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "===": operator.eq,
    "!=": operator.ne,
    "!==": operator.ne,
}
COMPARED: Mapping[str, Callable[[Any, Any], bool]] = {
    **EQUALITY,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
CURRENT_NAME = "_event.name"
"""The key for values of the current event's name."""
BLANK = "\\t\\n\\v\\f\\r \\xa0\\u1680\\u2000-\\u200a\\u2028\\u2029\\u202f\\u205f\\u3000\\ufeff"
"""White space and line ends of ECMA-262 12.2 and 12.3."""
BLANKS = re.compile(rf"\A[{BLANK}]+|[{BLANK}]+\Z")
INTEGER = re.compile(r"[+-]?[0-9]+")
DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


class Unknown(Exception):  # noqa: N818  (never leaves the passes)
    """A value that is unknown at compile time, or that the language does not have."""


def evaluate(node: syntax.Node, held: Mapping[str, Value]) -> Value:
    """Return the value of an expression; raise `Unknown` if the language has no such value.

    Strings count UTF-16 code units in ECMAScript: those with other characters are `Unknown`.
    """
    match node:
        case syntax.StringNode(value=text):
            return _plain(text)
        case syntax.NumberNode(digits=digits) if digits.isdigit():
            return int(digits)
        case syntax.NameNode(name=name) if name in held:
            value = held[name]
            return _plain(value) if isinstance(value, str) else value
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="name") if (
            CURRENT_NAME in held
        ):
            return _plain(_string(held[CURRENT_NAME]))
        case syntax.TruthNode(value=truth):
            return truth
        case syntax.UnaryNode(op="!", operand=operand):
            return not evaluate(operand, held)
        case syntax.ConditionalNode(test=test, then=then, otherwise=otherwise):
            return evaluate(then if evaluate(test, held) else otherwise, held)
        case syntax.BinaryNode(op="&&", left=left, right=right):
            return _truth(evaluate(left, held)) and _truth(evaluate(right, held))
        case syntax.BinaryNode(op="||", left=left, right=right):
            return _truth(evaluate(left, held)) or _truth(evaluate(right, held))
        case syntax.BinaryNode(op=op, left=left, right=right) if op in COMPARED:
            return _compared(op, evaluate(left, held), evaluate(right, held))
        case syntax.BinaryNode(op="*" | "/" | "%" as op, left=left, right=right):
            return _product(op, _whole(evaluate(left, held)), _whole(evaluate(right, held)))
        case syntax.CallNode(callee=syntax.MemberNode(base=base, name="toString"), arguments=()):
            return _text(evaluate(base, held))
        case syntax.UnaryNode(op="-", operand=operand):
            return -_whole(evaluate(operand, held))
        case syntax.BinaryNode(op="+" | "-" as op, left=left, right=right):
            return _sum(op, evaluate(left, held), evaluate(right, held))
        case syntax.MemberNode(base=base, name="length"):
            return len(_string(evaluate(base, held)))
        case syntax.ElementNode(
            base=syntax.CallNode(
                callee=syntax.MemberNode(base=base, name="split"), arguments=(by,)
            ),
            index=index,
        ):
            pieces = _split(_string(evaluate(base, held)), _string(evaluate(by, held)))
            return _at(pieces, _whole(evaluate(index, held)))
        case syntax.ElementNode(base=base, index=index):
            return _at(_string(evaluate(base, held)), _whole(evaluate(index, held)))
        case syntax.CallNode(callee=syntax.MemberNode(base=base, name=name), arguments=arguments):
            text = _string(evaluate(base, held))
            return call(name, text, [evaluate(argument, held) for argument in arguments])
        case syntax.CallNode(callee=syntax.NameNode(name=name), arguments=arguments) if (
            name in FUNCTIONS
        ):
            return FUNCTIONS[name](*(evaluate(argument, held) for argument in arguments))
        case _:
            raise Unknown


def _plain(text: str) -> str:
    if any(ord(each) > 0xFFFF for each in text):
        raise Unknown
    return text


def _string(value: Value) -> str:
    if not isinstance(value, str):
        raise Unknown
    return value


def _whole(value: Value) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise Unknown
    return value


def _sum(op: str, left: Value, right: Value) -> Value:
    if op == "+" and isinstance(left, str) | isinstance(right, str):
        return _text(left) + _text(right)
    sign = 1 if op == "+" else -1
    found = _whole(left) + sign * _whole(right)
    if found not in INT32:  # it would wrap around
        raise Unknown
    return found


def _text(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        raise Unknown
    return str(value)


def _truth(value: Value) -> bool:
    """Return a Boolean operand; for another value, raise `Unknown`: `&&` returns it unchanged."""
    if not isinstance(value, bool):
        raise Unknown
    return value


def _compared(op: str, left: Value, right: Value) -> bool:
    """Return the value of a comparison; raise `Unknown` if ECMAScript would convert a value."""
    if type(left) is not type(right) or (isinstance(left, str) and op not in EQUALITY):
        raise Unknown
    return bool(COMPARED[op](left, right))


def _product(op: str, left: int, right: int) -> int:
    """Return a product, or a quotient or remainder as they are in ECMAScript, if it is whole."""
    if op == "*":
        if left * right not in INT32:
            raise Unknown
        return left * right
    if right == 0 or (op == "/" and left % right):
        raise Unknown
    if op == "/":
        return left // right
    return abs(left) % abs(right) * (-1 if left < 0 else 1)


def _split(text: str, by: str) -> list[str]:
    return text.split(by) if by else list(text)


def _at(pieces: list[str] | str, index: int) -> str:
    if not 0 <= index < len(pieces):
        raise Unknown  # `undefined`
    return pieces[index]


def call(name: str, text: str, given: list[Value]) -> Value:
    """Return the result of a method of a string (ECMA-262 22.1.3, B.2.2.1)."""
    size = len(text)
    match name, given:
        case "charAt", [int(at)]:
            return text[at] if 0 <= at < size else ""
        case "charAt", []:
            return text[:1]
        case "slice" | "substring" | "substr", [int(start), *rest] if len(rest) <= 1:
            return _cut(name, text, start, *(_whole(value) for value in rest))
        case "indexOf", [str(sought), *rest] if len(rest) <= 1:
            start = min(max(_whole(rest[0]), 0), size) if rest else 0
            return text.find(sought, start)
        case "lastIndexOf", [str(sought)]:
            return text.rfind(sought)
        case "startsWith", [str(sought)]:
            return text.startswith(sought)
        case "endsWith", [str(sought)]:
            return text.endswith(sought)
        case "includes", [str(sought)]:
            return sought in text
        case "toUpperCase", []:
            return text.upper()
        case "toLowerCase", []:
            return text.lower()
        case "trim", []:
            return BLANKS.sub("", text)
        case "concat", _:
            return text + "".join(map(_text, given))
        case "replace", [str(old), str(new)] if "$" not in new:
            return text.replace(old, new, 1)
        case _:
            raise Unknown


def _cut(name: str, text: str, start: int, end: int | None = None) -> str:
    size = len(text)
    if name == "substring":
        one, other = (min(max(at, 0), size) for at in (start, size if end is None else end))
        return text[min(one, other) : max(one, other)]
    first = max(size + start, 0) if start < 0 else min(start, size)
    if end is None:
        return text[first:]
    if name == "substr":
        return text[first : first + max(end, 0)]
    last = max(size + end, 0) if end < 0 else min(end, size)
    return text[first:last]


def _parse_int(value: Value, base: Value = 10) -> Value:
    text = BLANKS.sub("", _text(value))
    found = INTEGER.match(text)
    if found is None or base != 10 or re.match(r"[+-]?0[xX]", text):
        raise Unknown  # `NaN`, or other digits
    return int(found[0])


def _parse_float(value: Value) -> Value:
    found = DECIMAL.match(BLANKS.sub("", _text(value)))
    if found is None:
        raise Unknown
    return _number(found[0])


def _number(value: Value) -> Value:
    if isinstance(value, bool):
        return int(value)
    if not isinstance(value, str):
        return value
    text = BLANKS.sub("", value)
    if not text:
        return 0
    if DECIMAL.fullmatch(text) is None:
        raise Unknown
    number = float(text)
    if number in (float("inf"), float("-inf")):
        raise Unknown
    return number


FUNCTIONS: Mapping[str, Callable[..., Value]] = {
    "parseInt": _parse_int,
    "parseFloat": _parse_float,
    "Number": _number,
    "String": _text,
}
"""The functions of the global object that take a string."""
