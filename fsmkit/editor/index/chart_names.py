"""The declarations of a chart and its bases."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fsmkit.diagnostics import Span, Text
from fsmkit.document.document import DocData, DocEvent, DocState, DocTransition, Document
from fsmkit.document.walk import parts, states
from fsmkit.editor.index.symbols import Symbol, SymbolKind
from fsmkit.language.statements.tree import DocField, DocSend, ForEach, Raise

NAMED_TYPE = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\[.*\])?\s*", re.DOTALL)
"""A type that is a name, or an array of such."""


@dataclass(frozen=True, slots=True)
class Declared:
    """A declaration: its symbol, location and source."""

    symbol: Symbol
    path: Path
    name: Text
    part: object = None
    """The piece of the Document."""
    direction: str = ""
    """Direction of an event: ``in``, ``out``, ``internal``."""


@dataclass
class ChartNames:
    """The meaning of a chart's names, from its own document and those of its bases."""

    documents: tuple[tuple[Path, Document], ...]
    states: dict[str, Symbol] = field(default_factory=dict)
    events: dict[str, Symbol] = field(default_factory=dict)
    values: dict[str, Symbol] = field(default_factory=dict)
    """Data, inputs, outputs, constants, operations and types share one space."""
    transitions: dict[tuple[str, str], Symbol] = field(default_factory=dict)
    invokes: dict[str, Symbol] = field(default_factory=dict)
    sends: dict[str, Symbol] = field(default_factory=dict)
    members: dict[str, dict[str, Symbol]] = field(default_factory=dict)
    """By the name of the enumeration."""
    fields: dict[Symbol, dict[str, Symbol]] = field(default_factory=dict)
    """Fields of events, records and operations, by name, in order."""
    types: dict[Symbol, Text | None] = field(default_factory=dict)
    """The type that is written for data, fields, parameters and results."""
    starts: dict[Symbol, Text | None] = field(default_factory=dict)
    """The start value or value that is written."""
    declared: dict[Symbol, list[Declared]] = field(default_factory=dict)
    """Its declarations, from the outermost base inward."""
    parents: dict[str, str] = field(default_factory=dict)
    """The parent of each state except top-level ones."""
    entries: dict[str, Symbol] = field(default_factory=dict)
    used: dict[str, ChartNames] = field(default_factory=dict)
    """The charts that fill states, by the name of the state."""
    state_parts: dict[str, list[tuple[Path, DocState]]] = field(default_factory=dict)

    @property
    def path(self) -> Path:
        """The file of the chart."""
        return self.documents[0][0]

    @property
    def document(self) -> Document:
        """The document of the file itself."""
        return self.documents[0][1]

    @property
    def is_loose(self) -> bool:
        """Whether events need no declaration, as in plain SCXML."""
        return self.document.datamodel != "fsmkit"

    def event(self, name: str) -> Symbol:
        """Return the event of a name, which in a loose dialect nothing declares."""
        found = self.events.get(name)
        if found is None:
            found = Symbol(SymbolKind.EVENT, self.documents[-1][0], name)
        return found

    def matching(self, descriptor: str) -> tuple[Symbol, ...]:
        """Return the events that a descriptor fits though it is not their name (SCXML 3.12.1)."""
        prefix = descriptor.removesuffix(".*").removesuffix("*").rstrip(".")
        return tuple(
            symbol
            for name, symbol in self.events.items()
            if name != descriptor
            and (not prefix or name.startswith(f"{prefix}.") or name == prefix)
        )

    def enumeration(self, text: Text | None) -> str | None:
        """Return the name of the enumeration that a written type is, or holds elements of."""
        match = None if text is None else NAMED_TYPE.fullmatch(text.value)
        return match[1] if match is not None and match[1] in self.members else None

    def record(self, text: Text | None) -> Symbol | None:
        """Return the record that a written type is, or holds elements of."""
        match = None if text is None else NAMED_TYPE.fullmatch(text.value)
        symbol = self.values.get(match[1]) if match is not None else None
        return symbol if symbol in self.fields else None

    def resolve_path(self, name: str) -> tuple[tuple[int, int, Symbol], ...]:
        """Resolve a dotted name into used charts: ``left.open``.

        Return the start, end and symbol of each part; empty if a part is unknown.
        """
        head, dot, rest = name.partition(".")
        used = self.used.get(head)
        if not dot or used is None or head not in self.states:
            return ()
        spaces = (used.states, used.entries, used.events, used.values)
        symbol = next((space[rest] for space in spaces if rest in space), None)
        start = len(head) + 1
        if symbol is not None:
            inner: tuple[tuple[int, int, Symbol], ...] = ((0, len(rest), symbol),)
        else:
            inner = used.resolve_path(rest)
        if not inner:
            return ()
        return (
            (0, len(head), self.states[head]),
            *((start + a, start + b, found) for a, b, found in inner),
        )


def chart_names(documents: Sequence[tuple[Path, Document]]) -> ChartNames:
    """Return the names of a chart from its document and those of its bases, nearest first."""
    names = ChartNames(tuple(documents))
    for path, document in reversed(names.documents):
        _Collector(names, path, document).collect()
    return names


@dataclass(slots=True)
class _Collector:
    names: ChartNames
    path: Path
    document: Document

    def collect(self) -> None:
        document = self.document
        for declared in document.types:
            symbol = self.value(SymbolKind.TYPE, declared.name, declared)
            if declared.members:
                members = self.names.members.setdefault(declared.name.value, {})
                for member in declared.members:
                    name = member.name
                    members[name.value] = self.part_of(symbol, SymbolKind.MEMBER, name)
            self.fields(symbol, SymbolKind.FIELD, declared.fields)
        for constant in document.constants:
            symbol = self.value(SymbolKind.CONSTANT, constant.name, constant)
            self.names.starts[symbol] = constant.value
        self.variables(SymbolKind.INPUT, document.inputs)
        self.variables(SymbolKind.OUTPUT, document.outputs)
        self.variables(SymbolKind.DATA, document.data)
        for operation in document.operations:
            symbol = self.value(SymbolKind.OPERATION, operation.name, operation)
            self.names.types[symbol] = operation.result
            self.fields(symbol, SymbolKind.PARAMETER, operation.parameters)
        for function in document.functions:
            symbol = self.value(SymbolKind.FUNCTION, function.name, function)
            self.names.types[symbol] = function.result
            self.fields(symbol, SymbolKind.PARAMETER, function.parameters)
        for event in document.events:
            self.event(event)
        for entry in document.entries:
            symbol = self.symbol(SymbolKind.ENTRY, entry.name.value)
            symbol = self.names.entries.setdefault(entry.name.value, symbol)
            self.declare(symbol, entry.name, entry)
        for top in (*document.root.children, *document.refine):
            self.tree(top)
        self.transitions(document.root)
        for part in parts((document.root, document.refine, document.script)):
            if isinstance(part, ForEach):
                self.loop(part.item)
                if part.index is not None:
                    self.loop(part.index)
            if document.datamodel != "fsmkit":
                self.mentioned(part)

    def mentioned(self, part: object) -> None:
        """Take the events that a loose dialect mentions: nothing declares them."""
        match part:
            case Raise(event=Text() as event) | DocSend(event=Text() as event):
                found = (event,)
            case DocTransition(events=found):
                pass
            case _:
                return
        for event in found:
            name = event.value
            if not name.endswith("*") and not name.startswith(("done.", "error.")):
                self.names.events.setdefault(name, self.names.event(name))

    def tree(self, top: DocState) -> None:
        for state in states(top):
            self.state(state)

    def state(self, state: DocState) -> None:
        if state.id is not None:
            name = state.id.value
            symbol = self.names.states.setdefault(name, self.symbol(SymbolKind.STATE, name))
            self.declare(symbol, state.id, state)
            self.names.state_parts.setdefault(name, []).append((self.path, state))
            for child in state.children:
                if child.id is not None:
                    self.names.parents[child.id.value] = name
        self.variables(SymbolKind.DATA, state.data)
        self.transitions(state)
        for invoke in state.invokes:
            if invoke.id is not None and invoke.id.value:
                symbol = self.symbol(SymbolKind.INVOKE, invoke.id.value)
                symbol = self.names.invokes.setdefault(invoke.id.value, symbol)
                self.declare(symbol, invoke.id, invoke)

    def transitions(self, state: DocState) -> None:
        name = "" if state.id is None else state.id.value
        for transition in state.transitions:
            if transition.id is not None and transition.id.value:
                key = name, transition.id.value
                symbol = Symbol(SymbolKind.TRANSITION, self.path, key[1], (name,))
                symbol = self.names.transitions.setdefault(key, symbol)
                self.declare(symbol, transition.id, transition)

    def symbol(self, kind: SymbolKind, name: str) -> Symbol:
        return Symbol(kind, self.path, name)

    def value(self, kind: SymbolKind, name: Text, part: object) -> Symbol:
        symbol = self.names.values.setdefault(name.value, self.symbol(kind, name.value))
        self.declare(symbol, name, part)
        return symbol

    def declare(self, symbol: Symbol, name: Text, part: object, direction: str = "") -> None:
        found = Declared(symbol, self.path, name, part, direction)
        self.names.declared.setdefault(symbol, []).append(found)

    def part_of(self, owner: Symbol, kind: SymbolKind, name: Text) -> Symbol:
        symbol = Symbol(kind, owner.owner, name.value, (owner.kind.value, owner.name))
        self.declare(symbol, name, owner)
        return symbol

    def variables(self, kind: SymbolKind, found: Sequence[DocData]) -> None:
        for data in found:
            symbol = self.value(kind, data.name, data)
            self.names.types[symbol] = data.type or self.names.types.get(symbol)
            self.names.starts[symbol] = data.init or self.names.starts.get(symbol)

    def loop(self, name: Text) -> None:
        if name.value.isidentifier() and name.value not in self.names.values:
            self.value(SymbolKind.DATA, name, None)

    def fields(self, owner: Symbol, kind: SymbolKind, found: Sequence[DocField]) -> None:
        known = self.names.fields.setdefault(owner, {})
        for one in found:
            if one.name.value in known and owner.kind is SymbolKind.EVENT:
                self.declare(known[one.name.value], one.name, owner)  # in and out: written twice
                continue
            symbol = known[one.name.value] = self.part_of(owner, kind, one.name)
            self.names.types[symbol] = one.type

    def event(self, event: DocEvent) -> None:
        name = event.name.value
        symbol = self.names.events.setdefault(name, self.symbol(SymbolKind.EVENT, name))
        self.declare(symbol, event.name, event, event.direction.value)
        self.names.types[symbol] = event.reply or self.names.types.get(symbol)
        self.fields(symbol, SymbolKind.FIELD, event.fields)


def line_of(span: Span) -> Span:
    """Return a place and the rest of its line."""
    text = span.source.text
    end = text.find("\n", span.end)
    line = text[span.start : len(text) if end < 0 else end]
    return Span(span.source, span.start, span.start + len(line.rstrip()))
