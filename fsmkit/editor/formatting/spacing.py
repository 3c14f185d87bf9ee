"""Format the white space in expressions, statements and declarations.

Only white space within a line changes, never tokens, line ends or comments. It depends on the
tokens alone, so formatting twice equals formatting once.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.language.statements.tokens import COMMENT, STRING

TOKEN = re.compile(
    rf"""(?P<string>{STRING})
    |(?P<word>[^\W\d][\w$]*|\$[\w$]*)
    |(?P<number>(?:\d+\.?\d*|\.\d+)[eE][+-]?\d+|(?:\d|\.\d)(?:\w|\.(?!\.))*)
    |(?P<space>\s+)
    |(?P<sign>>>>=|===|!==|<<=|>>=|\*\*=|&&=|\|\|=|>>>|=>|->|\.\.|\+\+|--|[-+*/%&|^=<>!]=|&&|\|\||<<|>>|\*\*|//|[-+*/%&|^=<>!~?:.,;(){{}}\[\]])
    """,
    re.VERBOSE,
)
NAMING = frozenset({"raise", "send", "cancel"})
"""Words before a name that may hold signs, such as `go-on`."""
NAME = re.compile(r"[^\s(){}\[\];,\"'=]+")
SOFT = frozenset({"to", "after", "as", "type", "content", "with"})
"""Words that start a clause or are names."""
OPERATORS = frozenset({"and", "or", "not", "in", "instanceof", "typeof", "new", "void"})
SENTENCES = frozenset(
    {"if", "elif", "else", "for", "raise", "send", "cancel", "log", "var", "return"}
)
KEYWORDS = OPERATORS | SENTENCES
PREFIXES = frozenset({"-", "+", "!", "~", "++", "--"})
TIGHT = frozenset({".", ".."})
OPENING = frozenset({"(", "["})
CLOSING = frozenset({")", "]", ",", ";"})
COUNTING = frozenset({"++", "--"})


class _Unknown(Exception):  # noqa: N818  (it never leaves this module)
    """A character that no token has."""


def normalize_spaces(text: str) -> str:
    """Return an expression, statements or a declaration with the usual white space.

    Args:
        text: One or several lines; their indentation is kept.

    Returns:
        The same tokens. Sources with invalid tokens or multi-line comments are unchanged.

    """
    if _has_long_comment(text):
        return text
    lines = text.split("\n")
    try:
        return "\n".join(_line(line) for line in lines)
    except _Unknown:
        return text


def words_of(text: str) -> tuple[str, ...]:
    """Return the tokens of a text with its comments and line ends, to compare two of them."""
    found: list[str] = []
    for line in text.split("\n"):
        code, comment = _parted(line.strip())
        try:
            found += [token for _, token, _ in _tokens(code)]
        except _Unknown:
            found += code.split()
        found += [comment, "\n"]
    return tuple(found)


def _has_long_comment(text: str) -> bool:
    return any(m[1] is None and m[0].startswith("/*") for m in COMMENT.finditer(text))


def _parted(line: str) -> tuple[str, str]:
    """Return a line before its comment, and the comment."""
    for match in COMMENT.finditer(line):
        if match[1] is None:
            return line[: match.start()], line[match.start() :]
    return line, ""


def _line(line: str) -> str:
    code, comment = _parted(line)
    margin = code[: len(code) - len(code.lstrip())]
    if not code.strip():
        return (code + comment).rstrip()
    gap = code[len(code.rstrip()) :] if comment else ""
    return (margin + _joined(code) + gap + comment).rstrip()


def _tokens(code: str) -> Iterator[tuple[str, str, bool]]:
    """Yield the kind and text of each token, and whether white space precedes it."""
    at, has_space, names = 0, False, False
    while at < len(code):
        match = TOKEN.match(code, at)
        if names and (match is None or match.lastgroup != "space"):
            match = NAME.match(code, at) or match
            names = False
        if match is None:
            raise _Unknown
        at, kind = match.end(), match.lastgroup or "word"
        if kind == "space":
            has_space = True
            continue
        yield kind, match[0], has_space
        names = match[0] in NAMING
        has_space = False


def _joined(code: str) -> str:
    text, before, is_operand = "", ("", ""), False
    choices: list[int] = []  # how many `?` wait for their `:`, by level of brackets
    tokens = list(_tokens(code))
    for place, (kind, sign, has_space) in enumerate(tokens):
        is_operand = is_operand and not _starts_range(tokens, place)
        is_prefix = sign in PREFIXES and not is_operand
        text += " " * _gap(before, (kind, sign), has_space, is_operand, bool(choices)) + sign
        if sign == "?":
            choices.append(0)
        elif sign == ":" and choices:
            choices.pop()
        before = ("prefix" if is_prefix else kind, sign)
        is_operand = _ends_operand(kind, sign, is_operand)
    return text


def _starts_range(tokens: list[tuple[str, str, bool]], place: int) -> bool:
    """Return whether a sign belongs to the first bound of a type: ``speed -1..1``."""
    (_, sign, has_space), after = tokens[place], tokens[place + 1 : place + 3]
    if sign not in ("-", "+") or not has_space or len(after) < 2:
        return False
    (kind, _, is_apart), (_, dots, _) = after
    return kind == "number" and not is_apart and dots == ".."


def _ends_operand(kind: str, token: str, was: bool) -> bool:
    """Whether an operand ends with a token, so that a sign after it is infix."""
    if token in COUNTING:
        return was
    return token in (")", "]") or (kind != "sign" and token not in KEYWORDS)


def _gap(
    before: tuple[str, str],
    here: tuple[str, str],
    has_space: bool,
    after_operand: bool,
    waits: bool,
) -> int:
    """Return the number of spaces between two tokens."""
    (kind, last), (_, sign) = before, here
    if not last or kind == "prefix" or last in OPENING or sign in CLOSING:
        return 0
    if last in TIGHT or sign in TIGHT or (last, sign) == ("{", "}"):
        return 0
    if sign in COUNTING and after_operand:
        return 0
    if sign in OPENING and after_operand:
        return int(has_space) if last in SOFT else 0
    if sign == ":" and not waits:
        return int(has_space)
    return 1
