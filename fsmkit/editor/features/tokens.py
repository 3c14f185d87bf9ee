"""Semantic tokens: the kind of each name in expressions and statements."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from fsmkit.document.document import Document
from fsmkit.document.walk import parts
from fsmkit.editor.context import Context
from fsmkit.editor.index.symbols import Role, SymbolKind
from fsmkit.language.statements import tree as stmt

TYPES = (
    "class", "event", "variable", "property", "enumMember", "function", "parameter", "enum",
    "namespace", "keyword", "method",
)  # fmt: skip
MODIFIERS = ("declaration", "readonly", "defaultLibrary")
OF = {
    SymbolKind.CHART: "namespace",
    SymbolKind.STATE: "class",
    SymbolKind.EVENT: "event",
    SymbolKind.DATA: "variable",
    SymbolKind.INPUT: "variable",
    SymbolKind.OUTPUT: "variable",
    SymbolKind.CONSTANT: "variable",
    SymbolKind.TYPE: "enum",
    SymbolKind.MEMBER: "enumMember",
    SymbolKind.FIELD: "property",
    SymbolKind.OPERATION: "function",
    SymbolKind.FUNCTION: "function",
    SymbolKind.PARAMETER: "parameter",
    SymbolKind.TRANSITION: "method",
    SymbolKind.INVOKE: "namespace",
    SymbolKind.ENTRY: "class",
    SymbolKind.SEND: "variable",
    SymbolKind.SYSTEM: "namespace",
    SymbolKind.MACHINE: "namespace",
    SymbolKind.PROPERTY: "property",
    SymbolKind.SETTING: "variable",
    SymbolKind.NODE: "namespace",
    SymbolKind.SIGNAL: "variable",
    SymbolKind.DEVICE: "namespace",
}
READONLY = (SymbolKind.INPUT, SymbolKind.CONSTANT, SymbolKind.SETTING)
WORDS = ("raise", "send", "cancel", "log", "if", "elif", "else", "for", "super")
WORD = re.compile(rf"(?:{'|'.join((*WORDS, *stmt.HANDLER_KEYWORDS))})\b")


def legend() -> types.SemanticTokensLegend:
    """Return the names of the kinds and marks of tokens, in the order of their numbers."""
    return types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))


def tokens(context: Context, path: Path, within: types.Range | None = None) -> types.SemanticTokens:
    """Return the tokens of a file, or of some of its lines."""
    lines = context.lines(path)
    file = context.workspace.file(path)
    data: list[int] = []
    if lines is None or file is None or file.is_broken:
        return types.SemanticTokens(data)
    found: dict[tuple[int, int], tuple[int, int]] = {}
    for occurrence in context.workspace.uses(path).occurrences:
        if occurrence.symbols and occurrence.role is not Role.MATCH:
            kind = occurrence.symbol.kind
            marks = 2 if kind in READONLY else 0
            marks |= 1 if occurrence.role is Role.DECLARATION else 0
            span = occurrence.span.start, occurrence.span.end
            found[span] = TYPES.index(OF[kind]), marks
    if file.document is not None:
        for span in _keywords(file.document):
            found.setdefault(span, (TYPES.index("keyword"), 0))
    line_before = column_before = 0
    for (start, end), (kind_number, marks) in sorted(found.items()):
        place = lines.range(start, end)
        if place.start.line != place.end.line or end <= start:
            continue
        line, column = place.start.line, place.start.character
        if within is not None and not within.start.line <= line <= within.end.line:
            continue
        delta = line - line_before
        shift = column - column_before if delta == 0 else column
        if delta < 0 or shift < 0:
            continue
        data += [delta, shift, place.end.character - column, kind_number, marks]
        line_before, column_before = line, column
    return types.SemanticTokens(data)


def _keywords(document: Document) -> Iterator[tuple[int, int]]:
    """Yield the ranges of words that start statements."""
    for part in parts(document):
        if isinstance(
            part,
            stmt.Raise
            | stmt.DocSend
            | stmt.DocCancel
            | stmt.Log
            | stmt.If
            | stmt.ForEach
            | stmt.KeywordStatement
            | stmt.Super,
        ):
            span = part.span
            match = WORD.match(span.source.text, span.start)
            if match is not None:
                yield match.span()
