"""Functions that a script of ECMAScript declares, separated from its statements."""

from __future__ import annotations

import re

from fsmkit.diagnostics import Findings, Text
from fsmkit.document.document import DocFunction
from fsmkit.document.walk import texts
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.tokens import Lexeme, lexemes, without_comments
from fsmkit.language.statements.tree import DocField
from fsmkit.language.syntax import SyntaxFault, parse

NAME = re.compile(r"[^\W\d][\w$]*")


def split_functions(text: Text) -> tuple[Text, tuple[DocFunction, ...]]:
    """Return a script without its function declarations, and the functions.

    An unreadable function stays in the script, where it becomes a finding.
    """
    plain = without_comments(text.value)
    tokens = lexemes(plain)
    found: list[DocFunction] = []
    depth = 0
    for place, token in enumerate(tokens):
        depth += (token.text == "{") - (token.text == "}")
        if depth == 0 and token.text == "function":
            end = _function(text, tokens, place, found)
            if end is not None:
                blank = re.sub(r"[^\n]", " ", plain[token.start : end])
                plain = plain[: token.start] + blank + plain[end:]
    return (Text(plain, text.span, text.offsets) if found else text), tuple(found)


def _function(
    text: Text, tokens: tuple[Lexeme, ...], place: int, found: list[DocFunction]
) -> int | None:
    """Add the function that starts at a token; return its end, or None if it is not a function."""
    name, opening = tokens[place + 1 : place + 3] if place + 3 < len(tokens) else (None, None)
    if name is None or opening is None or not NAME.fullmatch(name.text) or opening.text != "(":
        return None
    at = place + 3
    parameters: list[DocField] = []
    while at + 1 < len(tokens) and tokens[at].text != ")":
        if NAME.fullmatch(tokens[at].text):
            parameters.append(DocField(text.part(tokens[at].start, tokens[at].end), None))
        elif tokens[at].text != ",":
            return None
        at += 1
    first = last = at + 1
    depth = 0
    while last < len(tokens):
        depth += (tokens[last].text == "{") - (tokens[last].text == "}")
        if depth == 0:
            break
        last += 1
    if last >= len(tokens) or tokens[first].text != "{":
        return None
    attempt = Findings()
    body = read_statements(text.part(tokens[first].end, tokens[last].start), attempt)
    if attempt.has_errors or not all(map(_is_read, texts(body))):
        return None
    called = text.part(name.start, name.end)
    found.append(DocFunction(called, tuple(parameters), None, body))
    return tokens[last].end


def _is_read(text: Text) -> bool:
    try:
        parse(text.value)
    except SyntaxFault:
        return False
    return True
