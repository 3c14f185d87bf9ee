"""Rename at a cursor: the changes of `fsmkit.editor.editing.renaming` in the editor's protocol."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lsprotocol import types

from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.editing.renaming import RenameError, Renaming, renamed
from fsmkit.editor.index.symbols import Occurrence, Role, SymbolKind

__all__ = ["RenameError", "Renaming", "prepare", "renaming", "workspace_edit"]


def prepare(context: Context, path: Path, position: types.Position) -> Occurrence:
    """Return the renamable name at a position; raises `RenameError` if there is no such name."""
    for occurrence in context.at(path, position):
        if occurrence.symbols and occurrence.role is not Role.MATCH:
            if occurrence.symbol.kind in (SymbolKind.CHART, SymbolKind.SYSTEM):
                what = occurrence.symbol.kind.value
                raise RenameError(f"the name of a {what} has no other uses; edit it here")
            return occurrence
    found = [o for o in context.at(path, position) if o.role is Role.UNKNOWN]
    if found:
        raise RenameError(f"the meaning of `{found[0].name}` is unknown here")
    raise RenameError("there is no renamable name here")


def renaming(context: Context, path: Path, position: types.Position, new: str) -> Renaming:
    """Return the changes for a new name; raises `RenameError` if they are impossible."""
    here = prepare(context, path, position)
    return renamed(context.workspace, frozenset(here.symbols), here.name, new)


def workspace_edit(
    context: Context,
    made: Renaming,
    versions: Mapping[Path, int | None],
    *,
    with_documents: bool,
    with_annotations: bool,
) -> types.WorkspaceEdit:
    """Return the edits of a renaming in the format of the protocol.

    Args:
        context: The editor.
        made: The renaming.
        versions: Versions of the open files.
        with_documents: Whether the editor accepts edits by version.
        with_annotations: Whether it shows a remark with the edits of each file.

    """
    if not with_documents:
        return types.WorkspaceEdit(
            changes={
                uri_of(path): [types.TextEdit(context.range(s), made.new) for s in spans]
                for path, spans in made.places.items()
            }
        )
    annotations: dict[str, types.ChangeAnnotation] = {}
    documents: list[types.TextDocumentEdit] = []
    for path, spans in made.places.items():
        ranges = [context.range(span) for span in spans]
        uri = uri_of(path)
        count = f"{len(spans)} place{'s' if len(spans) > 1 else ''}"
        annotations[uri] = types.ChangeAnnotation(f"{path.name}: {count}")
        edits: list[types.TextEdit | types.AnnotatedTextEdit | types.SnippetTextEdit] = [
            types.AnnotatedTextEdit(uri, place, made.new)
            if with_annotations
            else types.TextEdit(place, made.new)
            for place in ranges
        ]
        identifier = types.OptionalVersionedTextDocumentIdentifier(uri, versions.get(path))
        documents.append(types.TextDocumentEdit(identifier, edits))
    return types.WorkspaceEdit(
        document_changes=list(documents),
        change_annotations=annotations if with_annotations else None,
    )
