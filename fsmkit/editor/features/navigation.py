"""Definition, declaration, implementation, references, highlights, and links to files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Span
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.index.symbols import Occurrence, Role, Symbol

DECLARING = (Role.DECLARATION, Role.OVERRIDE)


def definition(context: Context, path: Path, position: types.Position) -> list[types.Location]:
    """Return the nearest declaration of a name: in the chart, else in its bases."""
    file = _file_at(context, path, position)
    if file is not None:
        return [file]
    found: list[Span] = []
    for symbol in _symbols(context.at(path, position)):
        declared = context.workspace.declarations(path, symbol)
        if declared:
            found.append(declared[0].name.span)
        else:
            places = context.workspace.occurrences([symbol], [Role.DECLARATION])
            found += [occurrence.span for _, occurrence in places]
    return [context.location(span) for span in _unique(found)]


def declaration(context: Context, path: Path, position: types.Position) -> list[types.Location]:
    """Return the declaration of a name in the outermost base."""
    symbols = _symbols(context.at(path, position))
    places = context.workspace.occurrences(symbols, [Role.DECLARATION])
    return [context.location(span) for span in _unique(o.span for _, o in places)]


def implementation(context: Context, path: Path, position: types.Position) -> list[types.Location]:
    """Return the locations where derived charts override a name."""
    symbols = _symbols(context.at(path, position))
    places = context.workspace.occurrences(symbols, [Role.OVERRIDE])
    return [context.location(span) for span in _unique(o.span for _, o in places)]


def references(
    context: Context, path: Path, position: types.Position, *, with_declaration: bool
) -> list[types.Location]:
    """Return every place that names it, an event also where a pattern fits it."""
    symbols = _symbols(context.at(path, position))
    roles = [r for r in Role if with_declaration or r is not Role.DECLARATION]
    places = context.workspace.occurrences(symbols, roles)
    return [context.location(span) for span in _unique(o.span for _, o in places)]


def highlights(
    context: Context, path: Path, position: types.Position
) -> list[types.DocumentHighlight]:
    """Return the places in the file itself."""
    wanted = set(_symbols(context.at(path, position)))
    return [
        types.DocumentHighlight(
            context.range(occurrence.span),
            types.DocumentHighlightKind.Write
            if occurrence.role in DECLARING
            else types.DocumentHighlightKind.Read,
        )
        for occurrence in context.workspace.uses(path).occurrences
        if not wanted.isdisjoint(occurrence.symbols)
    ]


def links(context: Context, path: Path) -> list[types.DocumentLink]:
    """Return the files that a file names."""
    file = context.workspace.readable(path)
    if file is None:
        return []
    return [
        types.DocumentLink(context.range(text.span), target=uri_of(other))
        for text, other in file.named
    ]


def _file_at(context: Context, path: Path, position: types.Position) -> types.Location | None:
    file = context.workspace.readable(path)
    offset = context.offset(path, position)
    for text, other in () if file is None else file.named:
        if text.span.start <= offset <= text.span.end:
            nowhere = types.Position(0, 0)
            return types.Location(uri_of(other), types.Range(nowhere, nowhere))
    return None


def _symbols(occurrences: Iterable[Occurrence]) -> tuple[Symbol, ...]:
    """Return the symbols of the smallest occurrences; patterns of events have lowest priority."""
    found = list(occurrences)
    if not found:
        return ()
    first = found[0]
    same = [o for o in found if o.role is first.role or o.role is not Role.MATCH]
    return tuple(dict.fromkeys(s for o in same if o.span == first.span for s in o.symbols))


def _unique(spans: Iterable[Span]) -> Iterator[Span]:
    seen: set[tuple[str, int, int]] = set()
    for span in spans:
        key = span.source.name, span.start, span.end
        if key not in seen:
            seen.add(key)
            yield span
