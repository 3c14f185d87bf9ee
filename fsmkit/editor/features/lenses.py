"""Code lenses and inlay hints: overrides, commands, verdicts, values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from lsprotocol import types

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Span
from fsmkit.editor.context import Context, uri_of
from fsmkit.editor.index.files import Kind
from fsmkit.editor.index.symbols import Role, Symbol, SymbolKind
from fsmkit.language import ArrayType, DurationType, EnumType, IntType, format_value

SHOWN = (SymbolKind.STATE, SymbolKind.TRANSITION, SymbolKind.CONSTANT, SymbolKind.DATA)


@dataclass(frozen=True, slots=True)
class PropertyVerdict:
    """The last verdict on a property; ``has_path``: a counterexample or witness can be shown."""

    text: str
    has_path: bool = False


def lenses(
    context: Context, path: Path, verdicts: Mapping[str, PropertyVerdict] | None = None
) -> list[types.CodeLens]:
    """Return the lenses of a file.

    Args:
        context: The editor.
        path: The file.
        verdicts: The last verdicts on its properties, deadlocks and so on, by name.

    """
    file = context.workspace.readable(path)
    if file is None or file.kind is Kind.OTHER:
        return []
    known, uri = verdicts or {}, uri_of(path)
    found: list[types.CodeLens] = []
    head = types.Range(types.Position(0, 0), types.Position(0, 0))
    if file.kind in (Kind.CHART, Kind.SYSTEM, Kind.DEPLOYMENT):
        for title in ("check", "run", "draw"):
            command = types.Command(title, command=f"fsmkit.{title}", arguments=[uri])
            found.append(types.CodeLens(head, command))
    for name, told in known.items():
        if not _has_place(context, path, name):
            found += (types.CodeLens(head, command) for command in _verdict(uri, name, told))
    overridden = _overridden(context, path)
    for occurrence in context.workspace.uses(path).occurrences:
        if not occurrence.symbols or occurrence.symbol.kind not in SHOWN:
            if occurrence.symbols and occurrence.symbol.kind is SymbolKind.PROPERTY:
                told_ = known.get(occurrence.name)
                if told_ is not None and occurrence.role is Role.DECLARATION:
                    place = context.range(occurrence.span)
                    commands = _verdict(uri, occurrence.name, told_)
                    found += (types.CodeLens(place, command) for command in commands)
            continue
        place = context.range(occurrence.span)
        if occurrence.role is Role.OVERRIDE:
            declared = context.workspace.declarations(path, occurrence.symbol)
            others = [d.name.span for d in declared if d.path != path]
            if others:
                title = f"overrides {_place(others[0])}"
                found.append(types.CodeLens(place, _go(context, title, uri, place, others)))
        elif occurrence.role is Role.DECLARATION and occurrence.symbol in overridden:
            spans = overridden[occurrence.symbol]
            title = f"{len(spans)} override{'s' if len(spans) > 1 else ''}"
            found.append(types.CodeLens(place, _go(context, title, uri, place, spans)))
    return found


def _overridden(context: Context, path: Path) -> dict[Symbol, list[Span]]:
    """Return the locations in other files that override declarations of a file."""
    found: dict[Symbol, list[Span]] = {}
    for other, uses in context.workspace.all_uses():
        for occurrence in uses.occurrences if other != path else ():
            if occurrence.role is Role.OVERRIDE and occurrence.symbol.owner == path:
                found.setdefault(occurrence.symbol, []).append(occurrence.span)
    return found


def _place(span: Span) -> str:
    return f"{Path(span.source.name).name}:{span.source.position(span.start)[0]}"


def _go(
    context: Context, title: str, uri: str, place: types.Range, spans: list[Span]
) -> types.Command:
    locations = [context.location(span) for span in spans]
    return types.Command(
        title, command="fsmkit.showReferences", arguments=[uri, place.start, locations]
    )


def _has_place(context: Context, path: Path, name: str) -> bool:
    return any(
        o.name == name and o.role is Role.DECLARATION and o.symbol.kind is SymbolKind.PROPERTY
        for o in context.workspace.uses(path).occurrences
    )


def _verdict(uri: str, name: str, verdict: PropertyVerdict) -> list[types.Command]:
    title = f"{name}: {verdict.text}"
    if verdict.has_path:
        return [
            types.Command(f"{title}: show", command="fsmkit.counterexample", arguments=[uri, name]),
            types.Command("replay", command="fsmkit.replay", arguments=[uri, name]),
        ]
    return [types.Command(title, command="fsmkit.check", arguments=[uri])]


# --- inlay hints ----------------------------------------------------------------------------------


def hints(context: Context, path: Path, within: types.Range) -> list[types.InlayHint]:
    """Return inferred types, results of constants, and times in ticks, in some lines."""
    chart = context.analyses.chart(path)
    names = context.workspace.chart(path)
    if chart is None or names is None:
        return []
    found: list[types.InlayHint] = []
    for occurrence in context.workspace.uses(path).occurrences:
        if occurrence.role not in (Role.DECLARATION, Role.OVERRIDE):
            continue
        place = context.range(occurrence.whole or occurrence.span).end
        if not within.start.line <= place.line <= within.end.line:
            continue
        symbol = occurrence.symbol
        if symbol.kind is SymbolKind.CONSTANT:
            text = _constant(chart, symbol.name, names.starts.get(symbol))
            if text:
                found.append(_hint(place, f"= {text}", types.InlayHintKind.Parameter))
        elif symbol.kind is SymbolKind.DATA and names.types.get(symbol) is None:
            type_ = next((d.type for d in chart.data if d.name == symbol.name), None)
            if isinstance(type_, IntType | EnumType | ArrayType | DurationType):
                end = context.range(occurrence.span).end
                found.append(_hint(end, f": {type_}", types.InlayHintKind.Type))
    return found


def _constant(chart: Chart, name: str, written: object) -> str:
    """Return the value of a constant, if it differs from its source."""
    value = dict(chart.constants).get(name)
    if value is None:
        return ""
    if isinstance(value.type, DurationType):
        return f"{value.value} ticks"
    text = format_value(value.value, value.type)
    return "" if text == str(written) else text


def _hint(place: types.Position, text: str, kind: types.InlayHintKind) -> types.InlayHint:
    return types.InlayHint(place, text, kind=kind, padding_left=True)
