"""The state that features share: index, analyses, and the column encoding of the editor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lsprotocol import types
from pygls import uris

from fsmkit.diagnostics import Source, Span
from fsmkit.editor.analysis import Analyses
from fsmkit.editor.index.files import normal
from fsmkit.editor.index.symbols import Occurrence
from fsmkit.editor.index.workspace import Workspace
from fsmkit.editor.positions import Lines, lines_of


@dataclass
class Context:
    """An editor's view of the workspace."""

    workspace: Workspace
    analyses: Analyses
    encoding: types.PositionEncodingKind = types.PositionEncodingKind.Utf16

    def source(self, path: Path) -> Source | None:
        """Return the text of a file as it is now."""
        file = self.workspace.file(path)
        return None if file is None else file.source

    def lines(self, path: Path) -> Lines | None:
        """Return the lines of a file as it is now."""
        source = self.source(path)
        return None if source is None else lines_of(source, self.encoding)

    def offset(self, path: Path, position: types.Position) -> int:
        """Return the offset of a position; 0 where there is no such file."""
        lines = self.lines(path)
        return 0 if lines is None else lines.offset(position)

    def range(self, span: Span) -> types.Range:
        """Return the range of a place."""
        return lines_of(span.source, self.encoding).range(span.start, span.end)

    def location(self, span: Span) -> types.Location:
        """Return a place in whichever file it is."""
        return types.Location(uri_of(Path(normal(Path(span.source.name)))), self.range(span))

    def at(self, path: Path, position: types.Position) -> tuple[Occurrence, ...]:
        """Return the occurrences of names at a position."""
        return self.workspace.at(path, self.offset(path, position))


def uri_of(path: Path) -> str:
    """Return the address of a file."""
    return uris.from_fs_path(str(path)) or path.as_uri()


def path_of(uri: str) -> Path | None:
    """Return the file of a URI, or None if it is not a file."""
    found = uris.to_fs_path(uri) if uri.startswith("file:") else None
    return None if not found else Path(normal(Path(found)))
