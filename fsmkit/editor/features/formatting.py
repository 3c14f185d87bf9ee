"""The layout of ``fsmkit fmt``, as edits."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Edit, Findings, FsmkitError, Source, Span
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.editor.context import Context
from fsmkit.scxml.nodes import read_nodes

KEY = re.compile(r"^([^\s#\-][^\n]*?):", re.MULTILINE)
Entries = dict[tuple[str, int], tuple[int, int]]
"""Start and end of entries, by key, or by element and number."""


def formatting(
    context: Context, path: Path, place: types.Range | None = None
) -> list[types.TextEdit]:
    """Return the edits that format a file; empty if it is formatted or cannot be read.

    Args:
        context: The editor.
        path: The file.
        place: The selection; only entries at the margin, or elements of the root, that it touches
            are formatted. None formats the file.

    """
    from fsmkit.editor.formatting import format_source

    lines = context.lines(path)
    if lines is None:
        return []
    with context.workspace.unsaved():
        try:
            made = format_source(lines.text, str(path))
            if made == lines.text:
                return []
            if place is None:
                return [types.TextEdit(lines.whole, made)]
            source = Source(str(path), lines.text)
            start, end = lines.offset(place.start), lines.offset(place.end)
            edits = _within(source, made, start, end)
            if format_source(apply_edits(source.text, edits), str(path)) != made:
                return []
        except FsmkitError:
            return []
    return [types.TextEdit(context.range(edit.span), edit.text) for edit in edits]


def _within(source: Source, made: str, start: int, end: int) -> list[Edit]:
    """Return the edits of the entries that a selection touches."""
    wanted = entries(Source(source.name, made))
    found = []
    for key, (first, last) in entries(source).items():
        if first <= end and start <= last and key in wanted:
            written = made[slice(*wanted[key])]
            if written != source.text[first:last]:
                found.append(Edit(Span(source, first, last), written))
    return found


def entries(source: Source) -> Entries:
    """Return where the entries of a text are, without the white space around them."""
    pairs = _in_xml(source) if is_xml(source) else _in_yaml(source.text)
    counts: Counter[str] = Counter()
    found: Entries = {}
    for name, first, last in pairs:
        text = source.text[first:last]
        blanks = len(text) - len(text.lstrip())
        found[name, counts[name]] = first + blanks, first + len(text.rstrip())
        counts[name] += 1
    return found


def _in_yaml(text: str) -> Iterator[tuple[str, int, int]]:
    matches = list(KEY.finditer(text))
    for match, after in zip(matches, [*matches[1:], None], strict=True):
        yield match[1], match.start(), len(text) if after is None else _above(text, after.start())


def _above(text: str, at: int) -> int:
    """Return the offset of the first comment above an entry."""
    while at > 0:
        line = text.rfind("\n", 0, at - 1) + 1
        if not text[line : at - 1].startswith("#"):
            break
        at = line
    return at


def _in_xml(source: Source) -> Iterator[tuple[str, int, int]]:
    root = read_nodes(source, Findings())
    for child in () if root is None else root.children:
        end = child.inner.end
        if not source.text.startswith("/>", end - 2) or child.inner.start != end:
            end = source.text.find(">", end) + 1
        yield child.name, child.span.start, end
