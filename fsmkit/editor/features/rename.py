"""Rename a symbol in all files of the index, or reject the new name with locations.

Before the edits are returned, the names of the changed files must have the same meaning as before,
except for the renamed symbol. A new name that clashes with another one is therefore rejected.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Span
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.files import File, Kind
from fsmkit.editor.index.symbols import VARIABLES, Occurrence, Role, Symbol, SymbolKind
from fsmkit.editor.index.workspace import Workspace
from fsmkit.language.binding.calls import BUILT_IN
from fsmkit.language.format import WORDS
from fsmkit.language.notation import NAMED

PLAIN = re.compile(r"[A-Za-z_]\w*", re.ASCII)
DOTTED = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*", re.ASCII)
HYPHENED = re.compile(r"[A-Za-z_][\w.-]*", re.ASCII)
RESERVED = frozenset(
    (*WORDS, *BUILT_IN, "in", "instanceof", "event", "_event", "occurs", "all", "any", "count")
) | frozenset(("raise", "send", "cancel", "log", "for", "elif", "reply", "var", "after", "with"))
"""Words that no name of a chart can be, in one notation or the other."""
VALUES = (
    *VARIABLES,
    SymbolKind.CONSTANT,
    SymbolKind.OPERATION,
    SymbolKind.FUNCTION,
    SymbolKind.TYPE,
)
FORMS = {
    SymbolKind.EVENT: DOTTED,
    SymbolKind.STATE: DOTTED,
    SymbolKind.TRANSITION: HYPHENED,
    SymbolKind.PROPERTY: HYPHENED,
    SymbolKind.NODE: HYPHENED,
    SymbolKind.SIGNAL: DOTTED,
    SymbolKind.SEND: HYPHENED,
    SymbolKind.INVOKE: HYPHENED,
}
"""Patterns of names; the default is a plain word."""
MOST_SHOWN = 5


class RenameError(Exception):
    """The reason why a symbol cannot be renamed, with the conflicting locations."""

    def __init__(self, reason: str, places: Iterable[Span] = ()) -> None:
        """Keep the places; the text names some of them."""
        self.places = tuple(places)
        shown = ", ".join(
            f"{Path(s.source.name).name}:{_line(s)}" for s in self.places[:MOST_SHOWN]
        )
        more = len(self.places) - MOST_SHOWN
        shown += f" and {more} more" if more > 0 else ""
        super().__init__(f"{reason}: {shown}" if shown else reason)


def _line(span: Span) -> int:
    return span.source.position(span.start)[0]


@dataclass(frozen=True, slots=True)
class Renaming:
    """The renamed symbols, the new name, and every changed location by file."""

    symbols: frozenset[Symbol]
    old: str
    new: str
    places: Mapping[Path, tuple[Span, ...]]

    def text(self, path: Path, source: str) -> str:
        """Return the text of a file with the new name."""
        for span in sorted(self.places.get(path, ()), key=lambda s: -s.start):
            source = source[: span.start] + self.new + source[span.end :]
        return source


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
    workspace = context.workspace
    here = prepare(context, path, position)
    with workspace.steady():
        symbols = workspace.linked_symbols(here.symbols)
        require_legal(new, symbols)
        if new == here.name:
            return Renaming(symbols, here.name, new, {})
        found = _places(workspace, symbols, here.name)
        _require_known(workspace, symbols, here.name)
        _require_free(workspace, symbols, new)
        made = Renaming(symbols, here.name, new, found)
        _require_same(workspace, made)
    return made


def require_legal(new: str, symbols: Iterable[Symbol]) -> None:
    """Reject a name that one of the symbols cannot have in one of the notations."""
    for symbol in symbols:
        form = FORMS.get(symbol.kind, PLAIN)
        if form.fullmatch(new) is None:
            raise RenameError(f"`{new}` is not a valid name for a {symbol.kind.value}")
        if symbol.kind in (*VALUES, SymbolKind.MEMBER, SymbolKind.FIELD, SymbolKind.PARAMETER):
            if new in RESERVED or new in NAMED:
                raise RenameError(f"`{new}` is a word of the language")
        elif symbol.kind is SymbolKind.EVENT and (
            new.startswith(("done.", "error.")) or new in ("done", "error")
        ):
            raise RenameError(f"`{new}` is an event of the platform")
        elif symbol.kind is SymbolKind.STATE and new.endswith(".main"):
            raise RenameError(f"`{new}` is reserved for the main region of a state")
        elif symbol.kind in (SymbolKind.EVENT, SymbolKind.MACHINE) and new in RESERVED:
            raise RenameError(f"`{new}` is a word of the language")
        elif symbol.kind is SymbolKind.TRANSITION and new == "true":
            raise RenameError("`override: true` means the transition with the same trigger")


def _places(
    workspace: Workspace, symbols: frozenset[Symbol], old: str
) -> dict[Path, tuple[Span, ...]]:
    found: dict[Path, dict[tuple[int, int], Span]] = {}
    odd: list[Span] = []
    for path, occurrence in workspace.occurrences(symbols):
        if occurrence.role in (Role.MATCH, Role.UNKNOWN):
            continue
        span = occurrence.span
        if span.source.text[span.start : span.end] != old:
            odd.append(span)
        file = workspace.file(path)
        if file is None or file.is_broken:
            raise RenameError(f"`{path.name}` names it and does not parse", [span])
        found.setdefault(path, {})[span.start, span.end] = span
    if odd:
        raise RenameError(f"`{old}` is written with quotes, escapes or line breaks in it", odd)
    return {path: tuple(spans.values()) for path, spans in found.items()}


def _owners(symbols: Iterable[Symbol]) -> frozenset[Path]:
    return frozenset(symbol.owner for symbol in symbols)


def _require_known(workspace: Workspace, symbols: frozenset[Symbol], old: str) -> None:
    """Raise `RenameError` if a file may use the name where it cannot be found: in broken text."""
    owners = _owners(symbols)
    word = re.compile(rf"(?<![\w.]){re.escape(old)}(?!\w)")
    broken: list[Span] = []
    unclear: list[Span] = []
    for file in workspace.files():
        now = workspace.file(file.path)
        if now is None or owners.isdisjoint(workspace.depends_on(file.path)):
            continue
        if now.is_broken:
            match = word.search(now.source.text)
            if match is not None:
                broken.append(Span(now.source, *match.span()))
            continue
        unclear += [
            occurrence.span
            for occurrence in workspace.uses(file.path).occurrences
            if occurrence.role is Role.UNKNOWN and occurrence.name == old
        ]
    for path in workspace.paths():
        now = workspace.file(path)
        if now is not None and now.is_broken and workspace.readable(path) is now:
            match = word.search(now.source.text)
            if match is not None:
                broken.append(Span(now.source, *match.span()))
    if broken:
        raise RenameError(f"a file that may use `{old}` does not parse", broken)
    if unclear:
        raise RenameError(f"a use of `{old}` may have another meaning", unclear)


def _require_free(workspace: Workspace, symbols: frozenset[Symbol], new: str) -> None:
    """Reject a name that exists in any chart or system with one of the symbols."""
    taken: dict[Span, None] = {}
    wanted = frozenset(replace(symbol, name=new) for symbol in symbols)
    for _, occurrence in workspace.occurrences(wanted):
        taken[occurrence.span] = None
    for file in workspace.files():
        if _owners(symbols).isdisjoint(workspace.depends_on(file.path)):
            continue
        if file.document is not None:
            chart = workspace.chart(file.path)
            for symbol in symbols if chart is not None else ():
                if chart is not None and symbol in chart.declared:
                    taken.update(dict.fromkeys(_taken_in(chart, symbol, new)))
        elif file.path in _owners(symbols):
            for occurrence in workspace.uses(file.path).occurrences:
                if occurrence.role is not Role.DECLARATION or occurrence.name != new:
                    continue
                if any(_is_one_space(s.kind, occurrence.symbol.kind) for s in symbols):
                    taken[occurrence.span] = None
    if taken:
        raise RenameError(f"there is a `{new}` already", taken)


def _is_one_space(one: SymbolKind, other: SymbolKind) -> bool:
    bare = (SymbolKind.MACHINE, SymbolKind.SETTING, SymbolKind.SIGNAL, SymbolKind.DEVICE)
    return one is other or (one in bare and other in bare)


def _taken_in(chart: ChartNames, symbol: Symbol, new: str) -> Iterator[Span]:
    other: Symbol | None = None
    match symbol.kind:
        case kind if kind in VALUES:
            other = chart.values.get(new)
        case SymbolKind.STATE:
            other = chart.states.get(new)
        case SymbolKind.EVENT:
            other = chart.events.get(new)
        case SymbolKind.MEMBER:
            other = chart.members.get(symbol.within[1], {}).get(new)
        case SymbolKind.TRANSITION:
            other = chart.transitions.get((symbol.within[0], new))
        case SymbolKind.ENTRY:
            other = chart.entries.get(new) or chart.states.get(new)
        case SymbolKind.INVOKE:
            other = chart.invokes.get(new)
        case _:
            for fields in chart.fields.values():
                if symbol in fields.values() and new in fields:
                    other = fields[new]
    if other is not None and other != symbol:
        yield from (declared.name.span for declared in chart.declared.get(other, ()))


# --- trying ---------------------------------------------------------------------------------------


def _require_same(workspace: Workspace, made: Renaming) -> None:
    """Reject the name if any name would change its meaning."""
    tried = workspace.copy()
    for path in made.places:
        file = workspace.file(path)
        if file is not None:
            tried.set_text(path, made.text(path, file.source.text).encode("utf-8", "surrogatepass"))
    changed: list[Span] = []
    with tried.steady():
        for path in _affected(workspace, made):
            before = [_meaning(o, made) for o in workspace.uses(path).occurrences]
            after = list(tried.uses(path).occurrences)
            for place, occurrence in enumerate(after):
                known = (occurrence.role, frozenset(occurrence.symbols))
                if place >= len(before) or before[place] != known:
                    changed.append(occurrence.span)
                    break
            else:
                if len(before) != len(after):
                    changed.append(workspace.uses(path).occurrences[len(after)].span)
    if changed:
        raise RenameError(f"`{made.new}` would mean something else", changed)


def _affected(workspace: Workspace, made: Renaming) -> Iterator[Path]:
    """Yield the changed files, and those with the new name or patterns of events."""
    word = re.compile(rf"(?<!\w){re.escape(made.new.split('.')[0])}(?!\w)")
    owners = _owners(made.symbols)
    events = any(symbol.kind is SymbolKind.EVENT for symbol in made.symbols)
    for file in workspace.files():
        if file.path in made.places:
            yield file.path
        elif owners.isdisjoint(workspace.depends_on(file.path)):
            continue
        elif word.search(file.source.text) is not None or (events and _has_patterns(file)):
            yield file.path


def _has_patterns(file: File) -> bool:
    return file.kind is Kind.CHART and "*" in file.source.text


def _meaning(occurrence: Occurrence, made: Renaming) -> tuple[Role, frozenset[Symbol]]:
    """Return the meaning of an occurrence after the change, in terms of the old symbols."""
    return occurrence.role, frozenset(_renamed(symbol, made) for symbol in occurrence.symbols)


def _renamed(symbol: Symbol, made: Renaming) -> Symbol:
    if symbol in made.symbols:
        symbol = replace(symbol, name=made.new)
    if made.old not in symbol.within:
        return symbol
    if symbol.kind is SymbolKind.TRANSITION:
        is_owner = any(s.kind is SymbolKind.STATE for s in made.symbols)
    else:
        kind = SymbolKind(symbol.within[0])
        is_owner = Symbol(kind, symbol.owner, symbol.within[1]) in made.symbols
        if kind is SymbolKind.EVENT and symbol.within[1] == made.old:
            is_owner = is_owner or any(s.kind is SymbolKind.EVENT for s in made.symbols)
    if not is_owner:
        return symbol
    within = tuple(made.new if part == made.old else part for part in symbol.within)
    return replace(symbol, within=within)


# --- answers --------------------------------------------------------------------------------------


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
