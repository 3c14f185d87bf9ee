"""Describe a name: its declaration, type, value and documentation, and its overrides."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Span, rules
from fsmkit.document.document import (
    DocConstant,
    DocData,
    DocEvent,
    DocOperation,
    DocState,
    DocTransition,
    DocType,
)
from fsmkit.editor.context import Context
from fsmkit.editor.cursor.keys_at import key_at
from fsmkit.editor.features.outline import label_of
from fsmkit.editor.index.chart_names import Declared
from fsmkit.editor.index.symbols import Role, Symbol, SymbolKind
from fsmkit.language import format_value
from fsmkit.language.statements.tree import DocField

MOST_SHOWN = 12
"""Charts that are named as overriding something."""


def hover(context: Context, path: Path, position: types.Position) -> types.Hover | None:
    """Return the description of the item at a position."""
    finding = _rule(context, path, position)
    named = context.at(path, position)
    for occurrence in named:
        if occurrence.symbols:
            text = "\n\n---\n\n".join(
                _symbol(context, path, symbol) for symbol in occurrence.symbols[:4]
            )
            text += "".join(f"\n\n---\n\n{part}" for part in finding)
            return _hover(text, context.range(occurrence.span))
    if finding:
        return _hover("\n\n---\n\n".join(finding), None)
    source = context.source(path)
    key = None if source is None else key_at(path, source, context.offset(path, position))
    if key is not None and source is not None:
        span = Span(source, key.start, key.end)
        return _hover(f"`{key.row.name}`: {key.row.doc}", context.range(span))
    return None


def _hover(text: str, place: types.Range | None) -> types.Hover:
    return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, text), place)


def _rule(context: Context, path: Path, position: types.Position) -> list[str]:
    """Return the explanations of the findings at a position."""
    offset = context.offset(path, position)
    found: dict[str, None] = {}
    for finding in context.analyses.analysis(path).findings:
        at = finding.primary
        if at is None or Path(at.span.source.name) != path:
            continue
        if at.span.start <= offset <= at.span.end:
            rule = finding.rule
            found[f"**{rule.code} {rule.name}**\n\n{_first(rule.explanation)}"] = None
    return list(found)


def _first(explanation: str) -> str:
    """Return the first two sections of a rule's page: its description and its rationale."""
    parts = explanation.split("## ")
    return "\n\n".join(part.partition("\n")[2].strip() for part in parts[1:3])


def rule_explanation(name: str) -> str:
    """Return the whole explanation of a rule, by name or code; empty if it does not exist."""
    for rule in rules():
        if name in (rule.name, rule.code):
            return rule.explanation
    return ""


def _symbol(context: Context, path: Path, symbol: Symbol) -> str:
    declared = context.workspace.declarations(path, symbol)
    head = f"{symbol.kind.value} {'.'.join((*symbol.within[1:], symbol.name))}"
    lines = [f"```fsmkit\n{_declaration(context, path, symbol, declared) or head}\n```"]
    doc = _doc(declared)
    if doc:
        lines.append(doc)
    value = _value(context, path, symbol)
    if value:
        lines.append(value)
    chain = [_place(d.name.span) for d in declared]
    if len(chain) > 1 and not _is_repeated(declared):
        lines.append(" overrides ".join(chain))
    elif chain and declared[0].path != path:
        lines.append(f"declared at {chain[0]}")
    others = _overrides(context, path, symbol)
    if others:
        lines.append(f"overridden by {', '.join(others)}")
    return "\n\n".join(lines)


def _is_repeated(declared: tuple[Declared, ...]) -> bool:
    """Return whether one file declares a name twice, such as an event that goes in and out."""
    return len({d.path for d in declared}) == 1


def _overrides(context: Context, path: Path, symbol: Symbol) -> list[str]:
    """Return the charts that override the symbol."""
    found: dict[str, None] = {}
    for other, occurrence in context.workspace.occurrences([symbol], [Role.OVERRIDE]):
        if other != path and occurrence.symbols == (symbol,):
            found[_place(occurrence.span)] = None
    shown = list(found)
    rest = len(shown) - MOST_SHOWN
    return shown[:MOST_SHOWN] + ([f"{rest} more"] if rest > 0 else [])


def _place(span: Span) -> str:
    line, _ = span.source.position(span.start)
    return f"{Path(span.source.name).name}:{line}"


def _declaration(
    context: Context, path: Path, symbol: Symbol, declared: tuple[Declared, ...]
) -> str:
    part = declared[0].part if declared else None
    match part:
        case DocState():
            return f"state {symbol.name} ({_kind(context, path, symbol.name, part)})"
        case DocTransition():
            where = f" of {symbol.within[0]}" if symbol.within and symbol.within[0] else ""
            targets = ", ".join(t.value for t in part.targets)
            arrow = f" -> {targets}" if targets else ""
            return f"transition {symbol.name}{where}: {label_of(part)}{arrow}"
        case DocData():
            return f"{symbol.kind.value} {symbol.name}: {_type(context, path, symbol, part)}"
        case DocConstant():
            return f"constant {symbol.name} = {part.value.value}"
        case DocOperation():
            result = "" if part.result is None else f" -> {part.result}"
            return f"operation {symbol.name}({_fields(part.parameters)}){result}"
        case DocEvent():
            directions = "/".join(dict.fromkeys(d.direction for d in reversed(declared)))
            reply = "" if part.reply is None else f" -> {part.reply}"
            return f"event {directions} {symbol.name}({_fields(part.fields)}){reply}"
        case DocType(members=members) if members:
            return f"type {symbol.name}: {{{', '.join(m.name.value for m in members)}}}"
        case DocType():
            return f"type {symbol.name}: {{{_fields(part.fields)}}}"
        case _:
            return _part(context, path, symbol)


def _kind(context: Context, path: Path, name: str, state: DocState) -> str:
    chart = context.analyses.chart(path)
    if chart is not None and name in chart.state_index:
        return chart.states[chart.state_index[name]].kind.value
    return state.kind.value


def _part(context: Context, path: Path, symbol: Symbol) -> str:
    """Return the declaration of a field, a parameter or a member, which has no piece of its own."""
    owner = symbol.within[1] if len(symbol.within) > 1 else ""
    names = context.workspace.chart(path) or context.workspace.chart(symbol.owner)
    written = None if names is None else names.types.get(symbol)
    if symbol.kind is SymbolKind.MEMBER:
        return f"member {owner}.{symbol.name}"
    if symbol.kind in (SymbolKind.FIELD, SymbolKind.PARAMETER):
        return f"{symbol.kind.value} {symbol.name} of {owner}" + (
            "" if written is None else f": {written}"
        )
    if symbol.kind is SymbolKind.MACHINE:
        return _machine(context, path, symbol)
    return ""


def _machine(context: Context, path: Path, symbol: Symbol) -> str:
    system = context.workspace.system(path) or context.workspace.system(symbol.owner)
    machine = None if system is None else system.machines.get(symbol.name)
    if machine is None or machine.names is None:
        return f"machine {symbol.name}"
    return f"machine {symbol.name}: {machine.names.document.name} ({machine.names.path.name})"


def _fields(fields: tuple[DocField, ...]) -> str:
    return ", ".join(f"{f.name}" if f.type is None else f"{f.name} {f.type}" for f in fields)


def _type(context: Context, path: Path, symbol: Symbol, part: DocData) -> str:
    """Return a type as the chart understands it, with the start value."""
    chart = context.analyses.chart(path) or context.analyses.chart(symbol.owner)
    typed = None if chart is None else _variable(chart, symbol.name)
    if typed is not None:
        return typed
    written = "" if part.type is None else str(part.type)
    start = "" if part.init is None else f" = {part.init}"
    return f"{written}{start}".strip()


def _variable(chart: Chart, name: str) -> str | None:
    for data in (*chart.data, *chart.inputs, *chart.outputs):
        if data.name == name:
            return f"{data.type} = {format_value(data.init.value, data.init.type)}"
    return None


def _value(context: Context, path: Path, symbol: Symbol) -> str:
    """Return the value that a constant has in the chart."""
    chart = context.analyses.chart(path) or context.analyses.chart(symbol.owner)
    if symbol.kind is not SymbolKind.CONSTANT or chart is None:
        return ""
    for name, value in chart.constants:
        if name == symbol.name:
            return f"value: `{format_value(value.value, value.type)}` (`{value.type}`)"
    return ""


def _doc(declared: tuple[Declared, ...]) -> str:
    """Return the description of a state, of the nearest chart that has one."""
    docs = (d.part.doc for d in declared if isinstance(d.part, DocState))
    return next((doc for doc in docs if doc), "")
