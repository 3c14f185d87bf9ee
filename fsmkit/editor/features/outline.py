"""Symbols of a file and of the workspace, folding, and selection."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from lsprotocol import types

from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import DocState, DocTransition, Document, Trigger
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.index.chart_names import line_of
from fsmkit.editor.index.files import File, Kind
from fsmkit.editor.index.symbols import Occurrence, Role, SymbolKind
from fsmkit.editor.index.system_uses import entries
from fsmkit.yaml.nodes import Mapping, Node, Scalar

KINDS = {
    SymbolKind.CHART: types.SymbolKind.Module,
    SymbolKind.STATE: types.SymbolKind.Class,
    SymbolKind.EVENT: types.SymbolKind.Event,
    SymbolKind.DATA: types.SymbolKind.Variable,
    SymbolKind.INPUT: types.SymbolKind.Variable,
    SymbolKind.OUTPUT: types.SymbolKind.Variable,
    SymbolKind.CONSTANT: types.SymbolKind.Constant,
    SymbolKind.TYPE: types.SymbolKind.Enum,
    SymbolKind.MEMBER: types.SymbolKind.EnumMember,
    SymbolKind.FIELD: types.SymbolKind.Field,
    SymbolKind.OPERATION: types.SymbolKind.Function,
    SymbolKind.FUNCTION: types.SymbolKind.Function,
    SymbolKind.PARAMETER: types.SymbolKind.Variable,
    SymbolKind.TRANSITION: types.SymbolKind.Method,
    SymbolKind.INVOKE: types.SymbolKind.Object,
    SymbolKind.ENTRY: types.SymbolKind.Interface,
    SymbolKind.SEND: types.SymbolKind.Key,
    SymbolKind.SYSTEM: types.SymbolKind.Module,
    SymbolKind.MACHINE: types.SymbolKind.Object,
    SymbolKind.PROPERTY: types.SymbolKind.Property,
    SymbolKind.SETTING: types.SymbolKind.Constant,
    SymbolKind.NODE: types.SymbolKind.Package,
    SymbolKind.SIGNAL: types.SymbolKind.Interface,
    SymbolKind.DEVICE: types.SymbolKind.Object,
}
GROUPS = {
    SymbolKind.TYPE: "types",
    SymbolKind.CONSTANT: "constants",
    SymbolKind.DATA: "data",
    SymbolKind.INPUT: "inputs",
    SymbolKind.OUTPUT: "outputs",
    SymbolKind.OPERATION: "operations",
    SymbolKind.FUNCTION: "functions",
    SymbolKind.EVENT: "events",
}
MOST_FOUND = 1_000
"""Maximum number of symbols per response."""


def document_symbols(context: Context, path: Path) -> list[types.DocumentSymbol]:
    """Return the tree of a file: of a chart its declarations and its states with transitions."""
    file = context.workspace.readable(path)
    if file is None or file.kind is Kind.OTHER:
        return []
    if file.document is not None:
        return _chart(context, file, file.document)
    return _sections(context, file)


def _chart(context: Context, file: File, document: Document) -> list[types.DocumentSymbol]:
    found: list[types.DocumentSymbol] = []
    declared = [
        o
        for o in context.workspace.uses(file.path).occurrences
        if o.role in (Role.DECLARATION, Role.OVERRIDE) and o.symbols
    ]
    for kind, title in GROUPS.items():
        inner = [_named(context, o) for o in declared if o.symbol.kind is kind]
        if inner:
            whole = types.Range(inner[0].range.start, _end(inner))
            found.append(
                types.DocumentSymbol(
                    title, types.SymbolKind.Namespace, whole, inner[0].range, children=inner
                )
            )
    tops = (*document.root.children, *document.refine)
    found += [_state(context, file, state) for state in tops if state.id is not None]
    return found


def _end(symbols: Iterable[types.DocumentSymbol]) -> types.Position:
    return max((s.range.end for s in symbols), key=lambda p: (p.line, p.character))


def _named(context: Context, occurrence: Occurrence) -> types.DocumentSymbol:
    span = occurrence.span
    own = context.range(span)
    whole = context.range(occurrence.whole or span)
    return types.DocumentSymbol(occurrence.name, KINDS[occurrence.symbol.kind], whole, own)


def _state(context: Context, file: File, state: DocState) -> types.DocumentSymbol:
    name = state.id or Text("", state.span)
    children = [_transition(context, t) for t in state.transitions]
    children += [_state(context, file, child) for child in state.children if child.id is not None]
    selection = context.range(name.span)
    first = context.range(line_of(name.span))
    start = min(selection.start, context.range(state.span).start, key=_order)
    end = max((first.end, *(c.range.end for c in children)), key=_order)
    return types.DocumentSymbol(
        name.value or "state",
        types.SymbolKind.Class,
        types.Range(start, end),
        selection,
        detail=state.kind.value,
        children=children,
    )


def _order(position: types.Position) -> tuple[int, int]:
    return position.line, position.character


def _transition(context: Context, transition: DocTransition) -> types.DocumentSymbol:
    place = context.range(transition.span)
    name = label_of(transition)
    targets = ", ".join(t.value for t in transition.targets)
    return types.DocumentSymbol(
        name, types.SymbolKind.Method, place, place, detail=f"→ {targets}" if targets else None
    )


def label_of(transition: DocTransition) -> str:
    """Return the trigger of a transition as text."""
    if transition.trigger is Trigger.EVENT:
        return " ".join(e.value for e in transition.events) or "event"
    if transition.delay is not None:
        return f"{transition.trigger.value} {transition.delay}"
    return str(transition.trigger.value)


def _sections(context: Context, file: File) -> list[types.DocumentSymbol]:
    """Return the outermost keys of a file, with the names under each."""
    found = []
    kinds = {
        "machines": SymbolKind.MACHINE,
        "properties": SymbolKind.PROPERTY,
        "parameters": SymbolKind.SETTING,
        "shared": SymbolKind.DATA,
        "nodes": SymbolKind.NODE,
        "signals": SymbolKind.SIGNAL,
        "use": SymbolKind.DEVICE,
        "cases": SymbolKind.PROPERTY,
        "bind": SymbolKind.MACHINE,
    }
    for key, value in entries(file.root):
        if not key.value:
            continue
        inner = [
            types.DocumentSymbol(
                name.value,
                KINDS[kinds.get(key.value, SymbolKind.FIELD)],
                _with_value(context, name, part),
                context.range(name.span),
            )
            for name, part in entries(value)
            if name.value
        ]
        found.append(
            types.DocumentSymbol(
                key.value,
                types.SymbolKind.Namespace if inner else types.SymbolKind.Key,
                _with_value(context, key, value),
                context.range(key.span),
                children=inner or None,
            )
        )
    return found


def _with_value(context: Context, key: Text, value: Node) -> types.Range:
    start, end = context.range(key.span), context.range(value.span)
    return types.Range(start.start, max(start.end, end.end, key=_order))


def workspace_symbols(context: Context, query: str) -> list[types.WorkspaceSymbol]:
    """Return all declarations of the workspace whose name holds a text, case left aside."""
    wanted = query.casefold()
    found = []
    for path, uses in context.workspace.all_uses():
        for occurrence in uses.occurrences:
            if occurrence.role is not Role.DECLARATION or wanted not in occurrence.name.casefold():
                continue
            location = types.Location(uri_of(path), context.range(occurrence.span))
            kind = KINDS[occurrence.symbol.kind]
            found.append(
                types.WorkspaceSymbol(location, occurrence.name, kind, container_name=path.name)
            )
            if len(found) >= MOST_FOUND:
                return found
    return found


# --- folding and selection ------------------------------------------------------------------------


def folding(context: Context, path: Path) -> list[types.FoldingRange]:
    """Return the foldable ranges: by indentation, which both notations have, and comments."""
    source = context.source(path)
    if source is None:
        return []
    lines = [line.rstrip() for line in source.text.split("\n")]
    found: list[types.FoldingRange] = []
    open_: list[tuple[int, int]] = []
    last = 0
    comment: int | None = None
    for number, line in enumerate([*lines, "end"]):
        is_comment = line.lstrip().startswith("#") and number < len(lines)
        if is_comment and comment is None:
            comment = number
        elif not is_comment and comment is not None:
            if number - 1 > comment:
                kind = types.FoldingRangeKind.Comment
                found.append(types.FoldingRange(comment, number - 1, kind=kind))
            comment = None
        if not line.strip() or is_comment:
            continue
        indent = len(line) - len(line.lstrip(" "))
        while open_ and open_[-1][1] >= indent:
            start, _ = open_.pop()
            if last > start:
                found.append(types.FoldingRange(start, last))
        open_.append((number, indent))
        last = number
    return sorted(found, key=lambda f: (f.start_line, -f.end_line))


def selection(
    context: Context, path: Path, positions: Iterable[types.Position]
) -> list[types.SelectionRange]:
    """Return the enclosing ranges of each position, from the name to the file."""
    file = context.workspace.file(path)
    lines = context.lines(path)
    found = []
    for position in positions:
        offset = context.offset(path, position)
        spans: list[tuple[int, int]] = []
        if lines is not None and file is not None:
            spans.append((0, len(lines.text)))
            spans += [(s.start, s.end) for s in _around(file.root, offset)]
            line = lines.line(position.line)
            start = lines.starts[min(position.line, len(lines.starts) - 1)]
            blank = len(line) - len(line.lstrip())
            spans.append((start + blank, start + len(line.rstrip())))
            spans += [(o.span.start, o.span.end) for o in context.workspace.at(path, offset)]
        here = types.SelectionRange(types.Range(position, position))
        for start, end in sorted(set(spans), key=lambda s: s[0] - s[1]):
            if lines is None or not start <= offset <= end:
                continue
            outer = here if here.range.start != here.range.end else None
            if outer is None or _holds(outer.range, lines.range(start, end)):
                here = types.SelectionRange(lines.range(start, end), parent=outer)
        found.append(here)
    return found


def _holds(outer: types.Range, inner: types.Range) -> bool:
    starts = _order(outer.start) <= _order(inner.start)
    return starts and _order(inner.end) <= _order(outer.end) and outer != inner


def _around(node: Node | None, offset: int) -> Iterator[Span]:
    """Yield the places of the nodes that hold an offset, the outermost first."""
    while node is not None and node.span.start <= offset <= node.span.end:
        yield node.span
        match node:
            case Scalar():
                return
            case Mapping():
                inner: tuple[Node, ...] = tuple(value for _, value in node.entries)
                for key, value in node.entries:
                    if key.span.start <= offset <= value.span.end:
                        yield Span(node.span.source, key.span.start, value.span.end)
            case _:
                inner = node.items
        node = next((n for n in inner if n.span.start <= offset <= n.span.end), None)
