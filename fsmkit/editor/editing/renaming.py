"""Rename a symbol in all files of the index, or reject the new name with locations.

Before the edits are returned, the names of the changed files must have the same meaning as before,
except for the renamed symbol. A new name that clashes with another one is therefore rejected.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from fsmkit.diagnostics import Edit, Source, Span
from fsmkit.editor.editing.operations import RenameSymbol
from fsmkit.editor.editing.values import rejected
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.files import File, Kind, normal
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


def renamed(workspace: Workspace, symbols: frozenset[Symbol], old: str, new: str) -> Renaming:
    """Return the changes for a new name of symbols; `RenameError` if they are impossible."""
    with workspace.steady():
        symbols = workspace.linked_symbols(symbols)
        require_legal(new, symbols)
        if new == old:
            return Renaming(symbols, old, new, {})
        found = _places(workspace, symbols, old)
        _require_known(workspace, symbols, old)
        _require_free(workspace, symbols, new)
        rename = Renaming(symbols, old, new, found)
        _require_same(workspace, rename)
    return rename


def renaming_of(workspace: Workspace, path: Path, operation: RenameSymbol) -> Renaming:
    """Return the changes in all files of a workspace for an operation on a chart.

    Raises:
        FsmkitError: ``edit-rejected`` if the chart has no such symbol, or the name is impossible.

    """
    found = _symbols(workspace, path, operation)
    try:
        return renamed(workspace, found, operation.name, operation.new)
    except RenameError as error:
        raise rejected(str(error), help="use another name") from error


def rename_edits(
    source: Source, operation: RenameSymbol, *, is_whole: bool = True
) -> tuple[Edit, ...]:
    """Return the edits of one file, of which no other file is known.

    With ``is_whole`` false, the text is a part of a chart: names that it does not declare stay, and
    the new name is not compared with them.
    """
    path = Path(normal(Path(source.name)))
    workspace = Workspace()
    workspace.set_text(path, source.text.encode("utf-8", "surrogatepass"))
    if is_whole:
        places = renaming_of(workspace, path, operation).places.get(path, ())
    else:
        symbols = _symbols(workspace, path, operation)
        places = _places(workspace, symbols, operation.name).get(path, ())
    return tuple(Edit(Span(source, s.start, s.end), operation.new) for s in places)


def _symbols(workspace: Workspace, path: Path, operation: RenameSymbol) -> frozenset[Symbol]:
    found = {
        symbol
        for occurrence in workspace.uses(path).occurrences
        for symbol in occurrence.symbols
        if symbol.kind.value == operation.kind and symbol.name == operation.name
    }
    if not found:
        raise rejected(
            f"the chart has no {operation.kind} `{operation.name}`", help="select another item"
        )
    return frozenset(found)


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
    """Reject where a file that may mean it does not parse, or names it in an unknown way."""
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


def _require_same(workspace: Workspace, rename: Renaming) -> None:
    """Reject the name if any name would change its meaning."""
    tried = workspace.copy()
    for path in rename.places:
        file = workspace.file(path)
        if file is not None:
            tried.set_text(
                path, rename.text(path, file.source.text).encode("utf-8", "surrogatepass")
            )
    changed: list[Span] = []
    with tried.steady():
        for path in _affected(workspace, rename):
            before = [_meaning(o, rename) for o in workspace.uses(path).occurrences]
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
        raise RenameError(f"`{rename.new}` would mean something else", changed)


def _affected(workspace: Workspace, rename: Renaming) -> Iterator[Path]:
    """Yield the changed files, and those with the new name or patterns of events."""
    word = re.compile(rf"(?<!\w){re.escape(rename.new.split('.')[0])}(?!\w)")
    owners = _owners(rename.symbols)
    events = any(symbol.kind is SymbolKind.EVENT for symbol in rename.symbols)
    for file in workspace.files():
        if file.path in rename.places:
            yield file.path
        elif owners.isdisjoint(workspace.depends_on(file.path)):
            continue
        elif word.search(file.source.text) is not None or (events and _has_patterns(file)):
            yield file.path


def _has_patterns(file: File) -> bool:
    return file.kind is Kind.CHART and "*" in file.source.text


def _meaning(occurrence: Occurrence, rename: Renaming) -> tuple[Role, frozenset[Symbol]]:
    """Return the meaning of an occurrence after the change, in terms of the old symbols."""
    return occurrence.role, frozenset(_renamed(symbol, rename) for symbol in occurrence.symbols)


def _renamed(symbol: Symbol, rename: Renaming) -> Symbol:
    if symbol in rename.symbols:
        symbol = replace(symbol, name=rename.new)
    if rename.old not in symbol.within:
        return symbol
    if symbol.kind is SymbolKind.TRANSITION:
        is_owner = any(s.kind is SymbolKind.STATE for s in rename.symbols)
    else:
        kind = SymbolKind(symbol.within[0])
        is_owner = Symbol(kind, symbol.owner, symbol.within[1]) in rename.symbols
        if kind is SymbolKind.EVENT and symbol.within[1] == rename.old:
            is_owner = is_owner or any(s.kind is SymbolKind.EVENT for s in rename.symbols)
    if not is_owner:
        return symbol
    within = tuple(rename.new if part == rename.old else part for part in symbol.within)
    return replace(symbol, within=within)
