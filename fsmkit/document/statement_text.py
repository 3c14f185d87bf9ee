"""Statements as text that is guaranteed to read back unchanged."""

from __future__ import annotations

import re

from fsmkit.diagnostics import Findings, Source, Span, Text, fail
from fsmkit.document.walk import parts
from fsmkit.language.statements.reading import read_statements
from fsmkit.language.statements.tokens import without_comments
from fsmkit.language.statements.tree import Block, WrittenStatement
from fsmkit.language.statements.writing import write_statements


def statements_text(block: Block) -> str:
    """Return statements as text that reads back as the same statements.

    Raise `FsmkitError` (``not-expressible``) otherwise: an attribute in SCXML may contain a
    character that ends a statement.
    """
    written = write_statements(block)
    source = Source("statements", written)
    again = read_statements(Text(written, Span(source, 0, len(written))), Findings())
    for number, statement in enumerate(block):
        if number >= len(again) or _words(again[number]) != _words(statement):
            raise fail(
                "not-expressible",
                "as text this would be read as something else",
                statement.span,
                help="fix it: it cannot be evaluated",
            )
    return written


def _words(statement: WrittenStatement) -> list[str]:
    """Return the texts in a statement, without the layout of its expressions."""
    return [
        re.sub(r"\s", "", without_comments(part.value)).rstrip(";")
        if isinstance(part, Text)
        else str(part)
        if isinstance(part, str)
        else type(part).__name__
        for part in parts(statement)
    ]
