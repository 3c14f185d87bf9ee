"""Content in C, C++, Java or JavaScript, as statements and expressions of a chart.

What the data language can express is translated: assignments to known variables, ``++``, ``if``,
and expressions over known variables. Everything else is opaque: a statement becomes an operation
of the host, a condition an operation that returns ``bool``. Each text is one operation, wherever
it occurs.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocOperation
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import OpaqueContent, Role
from fsmkit.foreign.words import RESERVED
from fsmkit.language.statements.tree import Assign, Block, Branch, CallOperation, If

TOKEN = re.compile(
    r"""(?P<space>\s+|//[^\n]*|/\*.*?\*/|/\*.*\Z)
      | (?P<string>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
      | (?P<number>0[xX][0-9a-fA-F]+|\d+(?:\.\d+)?)(?:[uUlLfF]+(?!\w))?
      | (?P<name>(?:[A-Za-z_$]|[^\W\d])[\w$]*(?:(?:->|\.|::)[^\W\d][\w$]*)*)
      | (?P<sign>===|!==|<<=|>>=|\+\+|--|->|&&|\|\||[-+*/%&|^]=|[<>=!]=|<<|>>|.)
    """,
    re.VERBOSE | re.DOTALL,
)
KEYWORDS = frozenset(
    {"for", "while", "do", "switch", "case", "default", "return", "break", "continue", "goto"}
    | {"try", "throw", "catch", "function"}
)
"""Words that start a statement that no chart expresses: the whole handler becomes opaque."""
ASSIGNING = {"=": "", "+=": "+", "-=": "-", "*=": "*", "/=": "/", "%=": "%"}
OPERATORS = {
    **{s: s for s in ("+", "-", "*", "/", "%", "<", "<=", ">", ">=", "==", "!=", "&&", "||")},
    **{s: s for s in ("!", "(", ")", "?", ":", "&", "|", "^", "~", "<<", ">>")},
    "===": "==",
    "!==": "!=",
}
CONSTANTS = {"true": "true", "false": "false", "TRUE": "true", "FALSE": "false"}
LONGEST = 40
"""Characters of the name of an operation."""
LARGEST = 1 << 16
"""Characters of a text that is translated; a longer one is opaque."""
DEEPEST = 50
"""Nested brackets and blocks, ``if`` and ``!``; content with more is opaque."""


@dataclass(frozen=True, slots=True)
class Token:
    """A token of content, and its range in the text."""

    kind: str
    text: str
    start: int
    end: int


def tokens(text: str) -> list[Token]:
    """Return the tokens of a text without blanks and comments; this never fails."""
    found = []
    for match in TOKEN.finditer(text[:LARGEST]):
        kind = match.lastgroup or "sign"
        if kind != "space":
            found.append(Token(kind, match[kind], match.start(), match.end()))
    return found


@dataclass
class Operations:
    """The operations of a chart that represent opaque content."""

    namer: Namer = field(default_factory=lambda: Namer(RESERVED))
    _found: dict[tuple[Role, str], OpaqueContent] = field(default_factory=dict)

    def operation(self, text: Text, role: Role, preferred: str | None = None) -> str:
        """Return the name of the operation for a text; equal texts share one."""
        key = role, " ".join(text.value.split())
        if key not in self._found:
            name = self.namer.name(preferred or _name_for(key[1], role), "_op")
            self._found[key] = OpaqueContent(name, text, role)
        return self._found[key].name

    def action(self, text: Text) -> Block:
        """Return the call of an operation for a statement."""
        call = text.with_value(f"{self.operation(text, Role.ACTION)}()")
        return (CallOperation(call, text.span),)

    def guard(self, text: Text) -> str:
        """Return the expression that calls an operation for a condition."""
        return f"{self.operation(text, Role.GUARD)}()"

    def delay(self, text: Text) -> str:
        """Return the expression that calls an operation for a duration."""
        return f"{self.operation(text, Role.DELAY)}()"

    @property
    def opaque(self) -> tuple[OpaqueContent, ...]:
        """Return the opaque texts, in the order of their first use."""
        return tuple(self._found.values())

    def declarations(self) -> tuple[DocOperation, ...]:
        """Return the declarations of the operations."""
        result = {Role.ACTION: None, Role.GUARD: "bool", Role.DELAY: "duration"}
        return tuple(
            DocOperation(
                one.text.with_value(one.name),
                (),
                None if (type_ := result[one.role]) is None else one.text.with_value(type_),
            )
            for one in self.opaque
        )


def _name_for(text: str, role: Role) -> str:
    words = "_".join(re.findall(r"[^\W_]+(?:_[^\W_]+)*", text))
    return words[:LONGEST].strip("_") or role.value


BITS = {"0": "false", "1": "true"}
Special = Callable[[Text], Block | None]
"""Reads a statement that only one tool has, such as one that raises an event; None for others."""


@dataclass
class Content:
    """Translates the content of one machine.

    Args:
        operations: Collects opaque content.
        variables: Variables as written (``me->count``), with their names in the chart.
        special: Is called first for each statement.
        numbers: Variables, as written, that are true if they are not 0.
        booleans: Variables, as written, to which 0 and 1 are assigned for `false` and `true`.

    """

    operations: Operations
    variables: Mapping[str, str] = field(default_factory=dict)
    special: Special = lambda _: None
    numbers: AbstractSet[str] = frozenset()
    booleans: AbstractSet[str] = frozenset()

    def block(self, text: Text) -> Block:
        """Return the statements of a handler."""
        found = tokens(text.value)
        if any(token.text in KEYWORDS for token in found) or not _is_readable(text, found):
            return self.operations.action(text.strip())
        block, _ = self._statements(text, found, 0)
        return block

    def guard(self, text: Text) -> Text | None:
        """Return a condition; None for an empty one."""
        found = tokens(text.value)
        if not found:
            return None
        if not _is_readable(text, found):
            return text.with_value(self.operations.guard(text.strip()))
        return text.with_value(self._condition(text, found))

    def expression(self, text: Text) -> Text | None:
        """Return an expression over known variables; None if it is anything else."""
        value = self._known(tokens(text.value))
        return None if value is None else text.with_value(value)

    # --- statements -------------------------------------------------------------------------------

    def _statements(self, text: Text, found: list[Token], at: int) -> tuple[Block, int]:
        """Return statements up to the end of a block, and the place behind it."""
        block: list[object] = []
        while at < len(found) and found[at].text != "}":
            statements, at = self._statement(text, found, at)
            block += statements
        return tuple(block), at + 1  # type: ignore[arg-type]

    def _statement(self, text: Text, found: list[Token], at: int) -> tuple[Block, int]:
        first = found[at]
        if first.text == ";":
            return (), at + 1
        if first.text == "{":
            return self._statements(text, found, at + 1)
        if first.text == "if" and at + 1 < len(found) and found[at + 1].text == "(":
            return self._branches(text, found, at)
        end = _end_of_statement(found, at)
        part = found[at:end]
        piece = text.part(first.start, part[-1].end)
        after = end + (end < len(found) and found[end].text == ";")
        special = self.special(piece)
        return self._simple(piece, part) if special is None else special, after

    def _branches(self, text: Text, found: list[Token], at: int) -> tuple[Block, int]:
        branches: list[Branch[Text, object]] = []
        start = found[at].start
        while True:
            close = _closing(found, at + 1)
            inner = found[at + 2 : close]
            condition = text.part(found[at + 1].end, found[close].start)
            written = condition.with_value(self._condition(text, inner))
            body, at = self._body(text, found, close + 1)
            branches.append(Branch(written, body))
            if at >= len(found) or found[at].text != "else":
                break
            if at + 2 < len(found) and found[at + 1].text == "if" and found[at + 2].text == "(":
                at += 1
                continue
            body, at = self._body(text, found, at + 1)
            branches.append(Branch(None, body))
            break
        span = text.span_of(start, found[min(at, len(found)) - 1].end)
        return (If(tuple(branches), span),), at  # type: ignore[arg-type]

    def _body(self, text: Text, found: list[Token], at: int) -> tuple[Block, int]:
        return self._statement(text, found, at) if at < len(found) else ((), at)

    def _simple(self, piece: Text, part: list[Token]) -> Block:
        words = [token.text for token in part]
        if len(part) == 2 and ("++" in words or "--" in words):
            name = words[0] if part[0].kind == "name" else words[1]
            sign = "+" if "++" in words else "-"
            if name in self.variables:
                place = piece.with_value(self.variables[name])
                return (Assign(place, piece.with_value("1"), piece.span, sign),)
        if len(part) > 2 and words[0] in self.variables and words[1] in ASSIGNING:
            value = self._known(part[2:])
            if words[0] in self.booleans and value in BITS:
                value = BITS[value]
            if value is not None:
                place = piece.with_value(self.variables[words[0]])
                written = piece.with_value(value)
                return (Assign(place, written, piece.span, ASSIGNING[words[1]]),)
        return self.operations.action(piece)

    # --- expressions ------------------------------------------------------------------------------

    def _condition(self, text: Text, found: list[Token]) -> str:
        """Return a condition; operands of ``&&``, ``||`` and ``!`` are translated separately."""
        if not found:
            return "true"
        words = [token.text for token in found]
        if words[-1] in self.numbers and words[:-1] in ([], ["!"]):
            return f"{self.variables[words[-1]]} {'==' if words[:-1] else '!='} 0"
        known = None if self._tests_number(found) else self._known(found)
        if known is not None:
            return known
        for operator in ("||", "&&"):
            operands = _split(found, operator)
            if len(operands) > 1 and all(operands) and not _has_choice(found):
                return f" {operator} ".join(self._bracketed(text, operand) for operand in operands)
        if found[0].text == "!" and len(_split(found[1:], "==")) == 1 and not _has_relation(found):
            return f"!{self._bracketed(text, found[1:])}"
        if found[0].text == "(" and _closing(found, 0) == len(found) - 1:
            return f"({self._condition(text, found[1:-1])})"
        return self.operations.guard(text.part(found[0].start, found[-1].end))

    def _tests_number(self, found: list[Token]) -> bool:
        """Return whether an operand of ``&&``, ``||`` or ``!`` is a number."""
        outside = [token.text for token in found if token.text not in ("(", ")")]
        signs = ("&&", "||", "!", "")
        around = zip(["", *outside], outside, [*outside[1:], ""], strict=False)
        return any(a in signs and b in self.numbers and c in signs for a, b, c in around)

    def _bracketed(self, text: Text, found: list[Token]) -> str:
        inner = self._condition(text, found)
        is_group = found[0].text == "(" and _closing(found, 0) == len(found) - 1
        return inner if is_group or re.fullmatch(r"!?\w+(\(\))?", inner) else f"({inner})"

    def _known(self, found: Iterable[Token]) -> str | None:
        parts = []
        for token in found:
            match token.kind:
                case "number":
                    parts.append(_number(token.text))
                case "name" if token.text in self.variables:
                    parts.append(self.variables[token.text])
                case "name" if token.text in CONSTANTS:
                    parts.append(CONSTANTS[token.text])
                case "sign" if token.text in OPERATORS:
                    parts.append(OPERATORS[token.text])
                case _:
                    return None
        return " ".join(parts).replace("( ", "(").replace(" )", ")").replace("! ", "!")


def _number(text: str) -> str:
    """Return a number of C: an octal one in decimal."""
    is_octal = len(text) > 1 and text.isdigit() and text[0] == "0" and not set(text) & set("89")
    return str(int(text, 8)) if is_octal else text


def uses(opaque: Iterable[OpaqueContent], name: str) -> bool:
    """Return whether opaque content uses a variable, which the chart then cannot own."""
    return any(
        token.text == name or token.text.startswith((f"{name}.", f"{name}->"))
        for one in opaque
        for token in tokens(one.text.value)
    )


def _is_readable(text: Text, found: list[Token]) -> bool:
    """Return whether all brackets are closed, and are nested no deeper than `DEEPEST`."""
    words = [token.text for token in found]
    if len(text.value) > LARGEST or max(words.count("if"), words.count("!")) > DEEPEST:
        return False
    left: list[str] = []
    pairs = {")": "(", "]": "[", "}": "{"}
    for token in found:
        if token.kind != "sign":
            continue
        if token.text in pairs.values():
            left.append(token.text)
            if len(left) > DEEPEST:
                return False
        elif token.text in pairs and (not left or left.pop() != pairs[token.text]):
            return False
    return not left


def _closing(found: list[Token], at: int) -> int:
    """Return the place of the bracket that closes the one at ``at``."""
    depth = 0
    for place in range(at, len(found)):
        if found[place].kind == "sign":
            depth += (found[place].text in "([{") - (found[place].text in ")]}")
        if not depth:
            return place
    return len(found) - 1


def _end_of_statement(found: list[Token], at: int) -> int:
    depth = 0
    for place in range(at, len(found)):
        token = found[place]
        if token.kind != "sign":
            continue
        if token.text == ";" and not depth:
            return place
        if token.text == "}" and not depth:
            return place
        depth += (token.text in "([{") - (token.text in ")]}")
    return len(found)


def _split(found: list[Token], operator: str) -> list[list[Token]]:
    parts: list[list[Token]] = [[]]
    depth = 0
    for token in found:
        if token.kind == "sign":
            depth += (token.text in "([{") - (token.text in ")]}")
            if token.text == operator and not depth:
                parts.append([])
                continue
        parts[-1].append(token)
    return parts


def _has_choice(found: list[Token]) -> bool:
    return any(token.text in ("?", "=", ",") for token in _outer(found))


def _has_relation(found: list[Token]) -> bool:
    signs = {"<", ">", "<=", ">=", "==", "!=", "===", "!==", "&", "|", "^", "+", "-", "*", "/", "%"}
    return any(token.text in signs for token in _outer(found))


def _outer(found: list[Token]) -> list[Token]:
    """Return the tokens outside of brackets."""
    outside, depth = [], 0
    for token in found:
        if token.kind == "sign":
            depth += (token.text in "([{") - (token.text in ")]}")
        if not depth:
            outside.append(token)
    return outside
