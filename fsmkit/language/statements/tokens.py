"""The tokens of a text of statements, and the extent of the expressions in it.

Expressions are not read here; only their ends matter. An error in an expression costs one finding,
and the statements around it are still read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from fsmkit.diagnostics import Text

STRING = r"\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'"
COMMENT = re.compile(rf"({STRING}|[\"'][^\n]*)|//[^\n]*|/\*[\s\S]*?(?:\*/|\Z)|\#[^\n]*")
TOKEN = re.compile(
    rf"""(?P<string>{STRING})
    |(?P<open>["'][^\n]*)
    |(?P<word>[^\W\d][\w$]*|\$[\w$]*)
    |(?P<number>(?:\d|\.\d)[\w.]*)
    |(?P<newline>\n)
    |(?P<space>[^\S\n]+)
    |(?P<sign>>>>=|===|!==|<<=|>>=|\*\*=|&&=|\|\|=|>>>|=>|->|\+\+|--|[-+*/%&|^=<>!]=|&&|\|\||<<|>>|.)
    """,
    re.VERBOSE,
)
BRACKETS = {"(": ")", "[": "]", "{": "}"}
OPERATORS = frozenset(
    re.findall(r"\S+", "+ - * / % & | ^ && || == != === !== < <= > >= << >> ? . and or")
)
"""Infix signs and words, which need an operand on either side."""
JOINING = OPERATORS | {"*=", "+=", ",", "-=", "/=", ":", "="}
"""Tokens that an operand must follow: no statement ends with them."""
JOINED = JOINING - {",", "="}
"""Tokens with which no statement starts."""
GOES_ON = OPERATORS | {"[", "if"}
"""Tokens that continue an expression after a closing parenthesis."""


DEEPEST = 16
"""Maximum nesting of statements, below every target's limit for nested loops."""
LONGEST = 200_000
"""Maximum length of one text of statements, in characters."""

ASSIGNMENT: dict[str, str | None] = {
    "=": "",
    "++": "+",
    "--": "-",
    "+=": "+",
    "-=": "-",
    "*=": "*",
    "/=": "/",
    "%=": "%",
    "&=": "&",
    "|=": "|",
    "^=": "^",
    "<<=": "<<",
    ">>=": ">>",
    ">>>=": None,
    "**=": None,
    "&&=": None,
    "||=": None,
}
"""Signs of assignment and the operator of each; None if it is not in this language."""

CLAUSES = {
    "to": ("target", "target_expr"),
    "after": ("delay", "delay_expr"),
    "as": ("id", "id_location"),
    "type": ("type", "type_expr"),
    "content": ("content", "content_expr"),
    "with": ("name_list", "name_list"),
}
"""The clauses of `send`: the kind of a name or string after each word, and of an expression in
parentheses."""

NEW_LINES = re.compile(rf"({STRING}|[\"'][^\n]*)|(?<![^\S\n])[^\S\n]*\n\s*")
"""A string, or a new line with the white space around it."""
NAME = re.compile(r"[^\s(){}\[\];,\"'=]+")
"""A name of an event, a peer or an id that needs no quotes."""
LITERAL_DELAY = re.compile(r"(\d+(\.\d*)?|\.\d+)(us|ms|s|m|h|d)?|[^\W\d]\w*")
"""A delay that is a duration or the name of a constant."""

FOREIGN = {
    "function": "declare an operation and call it",
    "while": "iterate over an array: `for x in array { ... }`",
    "do": "iterate over an array: `for x in array { ... }`",
    "switch": "write `if ... else if ...`",
    "try": "remove it: an error raises `error.execution`",
    "throw": "raise an event",
    "return": "assign the result to a variable",
    "delete": "data live as long as the machine",
    "import": "declare operations and call them",
    "class": "declare a record type",
    "break": "guard the statements with `if`",
    "continue": "guard the statements with `if`",
    "pass": "remove it",
    "def": "declare an operation and call it",
    "lambda": "declare an operation and call it",
    "goto": "name the target in a transition",
    "print": "write `log`",
    "assert": "state it as an `invariant`",
}

CALLABLE = frozenset(("goto", "print", "assert", "delete", "import", "pass"))
"""The words among these that may also name an operation."""


ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "0": "\0", "b": "\b", "f": "\f", "v": "\v", "\n": ""}


class Lexeme(NamedTuple):
    """A token: its kind (a group of `TOKEN`), its text and its location in the text."""

    kind: str
    text: str
    start: int

    @property
    def end(self) -> int:
        """The offset after it."""
        return self.start + len(self.text)


def without_comments(text: str) -> str:
    """Return the text with every comment blanked out, so that offsets stay valid."""

    def blank(match: re.Match[str]) -> str:
        return match[0] if match[1] is not None else re.sub(r"[^\n]", " ", match[0])

    return COMMENT.sub(blank, text)


def lexemes(text: str) -> tuple[Lexeme, ...]:
    """Return the tokens of a text without comments, omitting white space, and a final ``end``."""
    found = [
        Lexeme(match.lastgroup or "sign", match[0], match.start())
        for match in TOKEN.finditer(text)
        if match.lastgroup != "space"
    ]
    return (*found, Lexeme("end", "", len(text)))


@dataclass(slots=True)
class Cursor:
    """A position among tokens."""

    text: str
    tokens: tuple[Lexeme, ...]
    index: int = 0
    has_lines: bool = True
    """Whether the end of a line, `;` and `}` end a statement."""

    @property
    def current(self) -> Lexeme:
        """The current token."""
        return self.tokens[self.index]

    def ahead(self, distance: int = 1) -> Lexeme:
        """Return a later token."""
        return self.tokens[min(self.index + distance, len(self.tokens) - 1)]

    @property
    def previous_end(self) -> int:
        """The end of the previous token."""
        return self.tokens[self.index - 1].end if self.index else 0

    def take(self) -> Lexeme:
        """Return the current token and advance."""
        token = self.current
        if token.kind != "end":
            self.index += 1
        return token

    def accept(self, *texts: str) -> bool:
        """Consume the current token if it is one of these."""
        if self.current.kind in ("sign", "word") and self.current.text in texts:
            self.index += 1
            return True
        return False

    def skip_newlines(self) -> None:
        """Advance to the next token that is not a new line."""
        while self.current.kind == "newline":
            self.index += 1

    def go_to(self, offset: int) -> None:
        """Advance to the first token at or after an offset."""
        while self.current.kind != "end" and self.current.start < offset:
            self.index += 1

    def is_end_of_statement(self) -> bool:
        """Return whether the statement ends here, or the block around it."""
        token = self.current
        if token.kind == "newline":
            return self.has_lines and not self._is_continued()
        return token.kind == "end" or (self.has_lines and token.text in (";", "}"))

    def _is_continued(self) -> bool:
        """Return whether the expression continues after the current new line."""
        before = self.tokens[self.index - 1] if self.index else None
        if before is not None and before.kind in ("sign", "word") and before.text in JOINING:
            return True
        distance = 0
        while self.ahead(distance).kind == "newline":
            distance += 1
        after = self.ahead(distance)
        return after.kind in ("sign", "word") and after.text in JOINED

    def expression(self, *stops: str) -> tuple[int, int]:
        """Skip an expression; return its start and its end.

        It ends at the end of the statement, or at one of the signs or words ``stops``, outside
        brackets. Brackets contain everything, including new lines.
        """
        open_: list[str] = []
        first = self.index
        while self.current.kind != "end":
            token = self.current
            if not open_:
                if self.is_end_of_statement():
                    break
                if token.kind == "newline":
                    self.skip_newlines()
                    continue
                if token.kind in ("sign", "word") and token.text in stops:
                    break
                if token.text in (")", "]") and token.kind == "sign":
                    break
            if token.kind == "sign" and token.text in BRACKETS:
                open_.append(BRACKETS[token.text])
            elif token.kind == "sign" and open_ and token.text == open_[-1]:
                open_.pop()
            self.index += 1
        start = self.tokens[first].start
        last = self.index
        while last > first and self.tokens[last - 1].kind == "newline":
            last -= 1
        return start, (self.tokens[last - 1].end if last > first else start)

    def closing(self) -> int | None:
        """Return the index of the token that closes the current bracket, or None."""
        open_: list[str] = []
        for index in range(self.index, len(self.tokens)):
            token = self.tokens[index]
            if token.kind != "sign":
                continue
            if token.text in BRACKETS:
                open_.append(BRACKETS[token.text])
            elif open_ and token.text == open_[-1]:
                open_.pop()
                if not open_:
                    return index
        return None

    def continues_expression(self, index: int) -> bool:
        """Return whether the token after a closing parenthesis continues the expression."""
        token = self.tokens[index]
        return token.kind in ("sign", "word") and token.text in GOES_ON

    def skip_statement(self) -> None:
        """Skip an unreadable statement with its blocks."""
        self.expression()
        while not self.is_end_of_statement():
            self.take()
            self.expression()


def unquoted(text: Text, token: Lexeme) -> Text:
    """Return the text between the quotes of a string."""
    inside = text.part(token.start + 1, token.end - 1)
    if "\\" not in inside.value:
        return inside
    return Text(unescape(inside.value), inside.span)


def bracketed(text: Text) -> Text | None:
    """Return the text between the outer parentheses; None if they do not enclose the whole text."""
    if not text.value.startswith("("):
        return None
    cursor = Cursor(text.value, lexemes(text.value))
    closing = cursor.closing()
    if closing is None or cursor.tokens[closing + 1].kind != "end":
        return None
    return text.part(1, cursor.tokens[closing].start).strip()


NO_ZERO = "a string cannot hold the character U+0000"
WITHOUT_ZERO = "remove it: strings of C end there, so two strings would be equal"


def unescape(inside: str) -> str:
    """Return the value of a quoted string; surrogate halves become one character."""
    if "\\" not in inside:
        return inside
    found, i = [], 0
    while i < len(inside):
        if inside[i] != "\\":
            found.append(inside[i])
            i += 1
            continue
        kind = inside[i + 1]
        size = {"x": 2, "u": 4}.get(kind, 0)
        digits = inside[i + 2 : i + 2 + size]
        if size and len(digits) == size and all(c in "0123456789abcdefABCDEF" for c in digits):
            found.append(chr(int(digits, 16)))
            i += 2 + size
        else:
            found.append(ESCAPES.get(kind, kind))
            i += 2
    return "".join(found).encode("utf-16", "surrogatepass").decode("utf-16", "replace")
