"""The words and signs of statements, shared by reading and writing."""

from __future__ import annotations

import re

from fsmkit.diagnostics import Text
from fsmkit.document.statement_tokens import STRING, Lexeme
from fsmkit.language.syntax import unescape

DEEPEST = 16
"""Levels that statements may nest: fewer than any target bounds the nesting of loops to."""
LONGEST = 200_000
"""Characters of one text of statements."""

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
"""Signs of assignment and the operator each stands for; None: not in this language."""

CLAUSES = {
    "to": ("target", "target_expr"),
    "after": ("delay", "delay_expr"),
    "as": ("id", "id_location"),
    "type": ("type", "type_expr"),
    "content": ("content", "content_expr"),
    "with": ("name_list", "name_list"),
}
"""What may follow `send`: what a name or a string after it is, and an expression in parentheses."""

NEW_LINES = re.compile(rf"({STRING}|[\"'][^\n]*)|(?<![^\S\n])[^\S\n]*\n\s*")
"""A string, or a new line with the white space around it."""
NAME = re.compile(r"[^\s(){}\[\];,\"'=]+")
"""A name of an event, a peer or an id, where it needs no quotes."""
LITERAL_DELAY = re.compile(r"(\d+(\.\d*)?|\.\d+)(us|ms|s|m|h|d)?|[^\W\d]\w*")
"""A delay that is a duration or the name of a constant."""

FOREIGN = {
    "function": "declare an operation and call it",
    "while": "iterate over an array: `for x in array { ... }`",
    "do": "iterate over an array: `for x in array { ... }`",
    "switch": "write `if ... else if ...`",
    "try": "leave it out: an error raises `error.execution`",
    "throw": "raise an event",
    "return": "assign the result to a variable",
    "delete": "data live as long as the machine",
    "import": "declare operations and call them",
    "class": "declare a record type",
    "break": "guard the statements with `if`",
    "continue": "guard the statements with `if`",
    "pass": "leave it out",
    "def": "declare an operation and call it",
    "lambda": "declare an operation and call it",
    "goto": "name the target in a transition",
    "print": "write `log`",
    "assert": "state it as an `invariant`",
}

CALLABLE = frozenset(("goto", "print", "assert", "delete", "import", "pass"))
"""Which of these may be the name of an operation."""


def unquoted(text: Text, token: Lexeme) -> Text:
    """Return what stands in the quotes of a string."""
    inside = text.part(token.start + 1, token.end - 1)
    if "\\" not in inside.value:
        return inside
    return Text(unescape(inside.value), inside.span)
