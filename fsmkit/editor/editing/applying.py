"""Apply operations to sources: edits that keep comments, layout, and everything untouched."""

from __future__ import annotations

import difflib
from collections import Counter
from functools import lru_cache

from fsmkit.diagnostics import Edit, Findings, FsmkitError, Source, Span
from fsmkit.diagnostics.fixes import apply_edits, is_xml
from fsmkit.document.document import Document
from fsmkit.editor.editing import operations as op
from fsmkit.editor.editing.documents import transformed
from fsmkit.editor.editing.renaming import rename_edits
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.editing.xml_edits import edited_xml, xml_remarks
from fsmkit.editor.editing.yaml_edits import edited_yaml
from fsmkit.editor.formatting.concrete import remarks
from fsmkit.scxml.reader import read_document as read_scxml
from fsmkit.yaml.reader import read_document as read_yaml

REMOVING = (op.RemoveState, op.RemoveTransition, op.RemoveDeclaration)
"""Operations that remove the comments of their item."""


@lru_cache(maxsize=8)
def read(source: Source) -> Document:
    """Return the Document of a chart in either notation.

    Raises:
        FsmkitError: With the findings of the reader.

    """
    findings = Findings()
    document = (read_scxml if is_xml(source) else read_yaml)(source, findings)
    if document is None or findings.has_errors:
        raise FsmkitError(findings)
    return document


def apply(source: Source, operation: op.Operation) -> tuple[Edit, ...]:
    """Return the edits of one file for an operation on its chart.

    The edited text reads as the Document that the operation gives, and has each comment of the
    old text once. An operation that removes an item removes the comments of the item.

    Args:
        source: The source of a chart in YAML or SCXML.
        operation: The operation. `RenameSymbol` changes this file only; `renaming_of` renames in
            all files of a workspace.

    Raises:
        FsmkitError: ``edit-rejected`` if the operation does not fit the chart, or the findings of
            the reader for a value or a source that cannot be read.

    """
    old = read(source)
    if isinstance(operation, op.RenameSymbol):
        return rename_edits(source, operation)
    new = transformed(old, operation)
    if new is old:
        return ()
    keeps = not isinstance(operation, REMOVING)
    text = edited(source, old, new, keeps_comments=keeps)
    _require_comments(source, Source(source.name, text), keeps=keeps)
    return text_edits(source, text)


def edited(source: Source, old: Document, new: Document, *, keeps_comments: bool) -> str:
    """Return the text of a source after its document changed, as small as possible.

    Raises:
        FsmkitError: ``edit-rejected`` if the text cannot express the change.

    """
    write = edited_xml if is_xml(source) else edited_yaml
    text = write(source, old, new, keeps_comments=keeps_comments)
    try:
        written = read(Source(source.name, text))
    except FsmkitError as error:
        raise rejected(
            "the changed file could not be read", help=f"edit the text ({error})"
        ) from error
    if written != new:
        raise rejected("the file cannot be changed without another effect", help="edit the text")
    return text


def _require_comments(source: Source, result: Source, *, keeps: bool) -> None:
    """Reject a text that lost or repeats a comment."""
    find = xml_remarks if is_xml(source) else remarks
    before, after = Counter(find(source)), Counter(find(result))
    if after - before or (keeps and before != after):
        raise rejected("a comment would be lost", help="edit the text")


def text_edits(source: Source, text: str) -> tuple[Edit, ...]:
    """Return the edits that turn a source into another text, as small as its lines allow."""
    old, new = source.text, text
    start = _shared(old, new)
    start = old.rfind("\n", 0, start) + 1
    end = _shared(old[start:][::-1], new[start:][::-1])
    stop = old.find("\n", len(old) - end)
    end = len(old) - stop - 1 if stop >= 0 and end else 0
    before = old[start : len(old) - end].splitlines(keepends=True)
    after = new[start : len(new) - end].splitlines(keepends=True)
    edits: list[Edit] = []
    offsets = [start]
    for line in before:
        offsets.append(offsets[-1] + len(line))
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    for what, first, last, begin, close in matcher.get_opcodes():
        if what != "equal":
            span = Span(source, offsets[first], offsets[last])
            edits.append(Edit(span, "".join(after[begin:close])))
    return tuple(edits)


def inverted(source: Source, edits: tuple[Edit, ...]) -> tuple[Edit, ...]:
    """Return the edits that undo edits of a source."""
    text = source.text
    found: list[Edit] = []
    shift = 0
    result = Source(source.name, apply_edits(text, edits))
    for edit in sorted(edits, key=lambda one: one.span.start):
        start = edit.span.start + shift
        found.append(
            Edit(Span(result, start, start + len(edit.text)), text[edit.span.start : edit.span.end])
        )
        shift += len(edit.text) - (edit.span.end - edit.span.start)
    return tuple(found)


def _shared(one: str, other: str) -> int:
    """Return the length of the common start of two texts."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low
