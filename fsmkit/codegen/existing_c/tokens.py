"""C expressions as tokens, to verify that a text is exactly one expression.

The C compiler reads the expressions later. Here a text is rejected if it could be anything but a
part of one expression: statements, blocks, directives, comments, and unbalanced brackets (C99 6.4).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from fsmkit.diagnostics import Findings, Text

TOKEN = re.compile(
    r"""(?P<space>[ \t\r\n]+)
    |(?P<text>(?:u8|[LuU])?"(?:[^"\\\r\n]|\\[^\r\n])*")
    |(?P<char>[LuU]?'(?:[^'\\\r\n]|\\[^\r\n])+')
    |(?P<word>[A-Za-z_]\w*)
    |(?P<number>\.?[0-9](?:[eEpP][+-]|[\w.])*)
    |(?P<mark>\.\.\.|->|\+\+|--|<<=|>>=|<<|>>|[<>=!+*/%&|^-]=|&&|\|\||[-\[\](){}.&*+~!/%<>^|?:=,;#])
    """,
    re.VERBOSE | re.ASCII,
)
CLOSING = {"(": ")", "[": "]"}
REJECTED = {
    ";": "ends a statement",
    "{": "starts a block",
    "}": "ends a block",
    "#": "starts a directive",
    "...": "is for declarations",
}
_STATEMENTS = """
    if else for while do switch case default break continue return goto typedef static extern auto
    register inline restrict _Noreturn _Static_assert _Alignas _Thread_local asm __asm __asm__
    __extension__ __attribute__ __declspec _Pragma __pragma
    """
STATEMENTS = frozenset(_STATEMENTS.split())
"""Words that no expression contains, or that leave one."""
TRAPS = re.compile(r"//|/\*|\?\?|<%|%>|<:|:>|%:")
"""The starts of comments, trigraphs and digraphs (C99 5.2.1.1, 6.4.6)."""
SELECTORS = (".", "->")


class Sort(Enum):
    """The kinds of tokens."""

    WORD = "word"
    OTHER = "other"
    SPACE = "space"


@dataclass(frozen=True, slots=True)
class Token:
    """A token as in C; all white space is one blank."""

    text: str
    sort: Sort


@dataclass(frozen=True, slots=True)
class CExpression:
    """A C expression of a binding; only `read_expression` creates one."""

    tokens: tuple[Token, ...]
    place: Text

    @property
    def text(self) -> str:
        """The source of the expression."""
        return self.replaced({})

    @property
    def names(self) -> frozenset[str]:
        """The free identifiers: those that do not follow ``.`` or ``->``."""
        return frozenset(token.text for token, is_free in self._words() if is_free)

    @property
    def needs_brackets(self) -> bool:
        """Whether it is not an operand of names, members, elements and calls."""
        depth = 0
        for token in self.tokens:
            if token.text in CLOSING:
                depth += 1
            elif token.text in CLOSING.values():
                depth -= 1
            elif not depth and token.sort is Sort.OTHER and token.text not in SELECTORS:
                return not token.text[0].isalnum()
        return self.tokens[0].text == "("

    def replaced(self, instead: Mapping[str, str]) -> str:
        """Return the text with its free identifiers replaced."""
        return "".join(
            instead.get(token.text, token.text) if is_free else token.text
            for token, is_free in self._words()
        )

    def operand(self, instead: Mapping[str, str]) -> str:
        """Return the same as one operand, in brackets if necessary."""
        found = self.replaced(instead)
        return f"({found})" if self.needs_brackets else found

    def _words(self) -> Iterator[tuple[Token, bool]]:
        before = ""
        for token in self.tokens:
            yield token, token.sort is Sort.WORD and before not in SELECTORS
            if token.sort is not Sort.SPACE:
                before = token.text


def read_expression(text: Text, findings: Findings) -> CExpression | None:
    """Return the expression of a text, or None after a finding (``binding-syntax``)."""
    text = text.strip()
    wrong = _trap(text)
    tokens: list[Token] = []
    opened: list[tuple[str, int]] = []
    at = 0
    while wrong is None and at < len(text.value):
        found = TOKEN.match(text.value, at)
        if found is None:
            wrong = at, at + 1, f"`{text.value[at]}` is not the start of a C token"
            break
        reason = _rejection(found, opened)
        wrong = None if reason is None else (*found.span(), reason)
        tokens.append(_token(found))
        at = found.end()
    if wrong is None and opened:
        wrong = opened[-1][1], opened[-1][1] + 1, "this bracket is not closed"
    if wrong is None and not tokens:
        wrong = 0, 0, "nothing stands here"
    if wrong is None:
        return CExpression(tuple(tokens), text)
    start, end, what = wrong
    findings.add(
        "binding-syntax",
        f"this is not one expression of C: {what}",
        text.part(start, end),
        help="write one expression, as `bms_set(BMS_CHANNEL_1, amps)`; put more into a function "
        "of C and call that",
    )
    return None


def _rejection(found: re.Match[str], opened: list[tuple[str, int]]) -> str | None:
    """Return why a token is invalid, or None; ``opened``: the stack of open brackets."""
    token = found[0]
    if token in REJECTED:
        return f"`{token}` {REJECTED[token]}"
    if found.lastgroup == "word" and token in STATEMENTS:
        return f"`{token}` is not allowed in an expression"
    if token in CLOSING:
        opened.append((CLOSING[token], found.start()))
    elif token in CLOSING.values() and (not opened or opened.pop()[0] != token):
        return f"no bracket fits this `{token}`"
    return None


def _token(found: re.Match[str]) -> Token:
    if found.lastgroup == "space":
        return Token(" ", Sort.SPACE)
    return Token(found[0], Sort.WORD if found.lastgroup == "word" else Sort.OTHER)


def _trap(text: Text) -> tuple[int, int, str] | None:
    """Return the first trap outside of literals; trigraphs count within literals, too."""
    quoted: list[range] = []
    at = 0
    while (token := TOKEN.match(text.value, at)) is not None:
        if token.lastgroup in ("text", "char"):
            quoted.append(range(*token.span()))
        at = token.end()
    for trap in TRAPS.finditer(text.value):
        if trap[0] == "??" or not any(trap.start() in each for each in quoted):
            return *trap.span(), f"`{trap[0]}` has no place here"
    return None
