"""Find every name in a chart's Document, with its symbol."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fsmkit.diagnostics import Text
from fsmkit.document import document as doc
from fsmkit.editor.index.chart_names import ChartNames, line_of
from fsmkit.editor.index.expressions import ExpressionReader
from fsmkit.editor.index.symbols import Occurrence, Role, Symbol, SymbolKind, Uses
from fsmkit.language.statements import tree as stmt

DONE_STATE = "done.state."
DONE_INVOKE = "done.invoke."
LEADING = re.compile(r"\s*(?:occurs\s*\(\s*)?([A-Za-z_][\w.]*)")
PLATFORM = ("done.", "error.")


def chart_uses(
    path: Path,
    document: doc.Document,
    names: ChartNames,
    invoked: Mapping[str, ChartNames],
) -> Uses:
    """Return the names that a chart uses.

    Args:
        path: Its file.
        document: Its Document.
        names: The names declared by it and its bases.
        invoked: The names of invoked charts, by the written file name.

    """
    walker = _Walker(path, document, names, invoked)
    walker.chart()
    return Uses(tuple(dict.fromkeys(walker.found)), tuple(dict.fromkeys(walker.links)))


@dataclass(slots=True)
class _Walker:
    path: Path
    document: doc.Document
    names: ChartNames
    invoked: Mapping[str, ChartNames]
    found: list[Occurrence] = field(default_factory=list)
    links: list[tuple[Symbol, Symbol]] = field(default_factory=list)
    reader: ExpressionReader = field(init=False)

    def __post_init__(self) -> None:
        self.reader = ExpressionReader(self.names, self.found.append, self.possible_events)

    @property
    def possible_events(self) -> tuple[Symbol, ...] | None:
        """The possible current events outside transitions: in SCXML any last event."""
        return None if self.names.is_loose else ()

    # --- declarations -----------------------------------------------------------------------------

    def chart(self) -> None:
        document, names = self.document, self.names
        if document.name.span.start < document.name.span.end:
            chart = Symbol(SymbolKind.CHART, self.path, document.name.value)
            self.declare(document.name, chart)
        for declared in document.types:
            symbol = names.values[declared.name.value]
            self.declare(declared.name, symbol)
            for member in declared.members:
                name = member.name
                self.declare(name, names.members[declared.name.value][name.value])
            self.fields(symbol, declared.fields)
        for constant in document.constants:
            symbol = names.values[constant.name.value]
            self.declare(constant.name, symbol)
            self.reader.read(constant.value, self.reader.hint_of_symbol(symbol))
        for data in (*document.inputs, *document.outputs, *document.data):
            self.data(data)
        for operation in document.operations:
            symbol = names.values[operation.name.value]
            self.declare(operation.name, symbol)
            self.fields(symbol, operation.parameters)
            self.reader.read_words(operation.result)
        for function in document.functions:
            symbol = names.values[function.name.value]
            self.declare(function.name, symbol)
            self.fields(symbol, function.parameters)
            self.reader.read_words(function.result)
            outer = self.reader
            values = {**names.values, **names.fields.get(symbol, {})}
            self.reader = replace(outer, names=replace(names, values=values), events=())
            self.block(function.body)
            self.reader = outer
        for event in document.events:
            symbol = names.events[event.name.value]
            self.declare(event.name, symbol)
            self.fields(symbol, event.fields)
            self.reader.read_words(event.reply)
        for capacity in document.capacities:
            self.reader.read_words(capacity.value)
        for entry in document.entries:
            self.declare(entry.name, names.entries[entry.name.value])
            for target in entry.targets:
                self.reader.state(target)
        for asked in document.properties:
            self.property(asked)
        if document.environment is not None:
            for item in (*document.environment.may, *document.environment.will):
                self.seen(item)
        self.block(document.script)
        self.state(document.root)
        for refined in document.refine:
            self.state(refined)

    def declare(self, name: Text, symbol: Symbol) -> None:
        """Report a declaration; for a name of a base, a modification."""
        role = Role.DECLARATION if symbol.owner == self.path else Role.OVERRIDE
        self.found.append(Occurrence((symbol,), name.value, role, name.span, line_of(name.span)))

    def fields(self, owner: Symbol, found: Sequence[stmt.DocField]) -> None:
        known = self.names.fields.get(owner, {})
        for one in found:
            if one.name.value in known:
                self.declare(one.name, known[one.name.value])
            self.reader.read_words(one.type)

    def data(self, data: doc.DocData) -> None:
        symbol = self.names.values[data.name.value]
        self.declare(data.name, symbol)
        self.reader.read_words(data.type)
        self.reader.read(data.init, self.reader.hint_of_symbol(symbol))

    # --- properties --------------------------------------------------------------------------

    def property(self, asked: doc.DocProperty) -> None:
        name = asked.name.value
        inherited = (
            path
            for path, document in self.names.documents
            if any(one.name.value == name for one in document.properties)
        )
        self.declare(asked.name, Symbol(SymbolKind.PROPERTY, next(inherited, self.path), name))
        self.reader.read_words(asked.time)
        if asked.kind.value != "monitor":
            self.reader.read(asked.first)
            self.reader.read(asked.then)
        for line in asked.watch:
            self.seen(line.part(0, len(line.value.partition("->")[0])))

    def seen(self, text: Text) -> None:
        """Report the event or variable at the start of a source, and the names after it."""
        match = LEADING.match(text.value)
        if match is None:
            return
        name = text.part(*match.span(1))
        hint = self.names.values.get(name.value)
        if hint is not None and name.value not in self.names.events:
            self.reader.use(name, hint)
        else:
            self.reader.event(name)
        self.reader.read_words(text.part(match.end(), len(text.value)))

    # --- states -----------------------------------------------------------------------------------

    def state(self, state: doc.DocState) -> None:
        if state.id is not None and state.id.value in self.names.states:
            self.declare(state.id, self.names.states[state.id.value])
        if state.initial is not None:
            self.transition(state, state.initial)
        for data in state.data:
            self.data(data)
        for event in state.defer:
            self.descriptor(event)
        self.reader.read(state.invariant)
        for block in (*state.entry, *state.exit):
            self.block(block)
        for invoke in state.invokes:
            self.invoke(invoke)
        self.done(state)
        if state.use is not None:
            self.used(state, state.use)
        for transition in state.transitions:
            self.transition(state, transition)
        for child in state.children:
            self.state(child)

    def done(self, state: doc.DocState) -> None:
        """Report the payload of ``done.state`` of the state that this one ends."""
        parent = self.names.parents.get("" if state.id is None else state.id.value)
        event = None if parent is None else self.names.event(f"{DONE_STATE}{parent}")
        self.arguments(event, state.done_data)
        self.reader.read(state.done_content)

    def transition(self, state: doc.DocState, transition: doc.DocTransition) -> None:
        key = "" if state.id is None else state.id.value
        if transition.id is not None and transition.id.value:
            self.declare(transition.id, self.names.transitions[key, transition.id.value])
        if transition.override is not None and transition.override.value != "true":
            symbol = self.names.transitions.get((key, transition.override.value))
            if symbol is not None:
                self.reader.use(transition.override, symbol, role=Role.OVERRIDE)
        at_hand: tuple[Symbol, ...] | None = self.possible_events
        if transition.trigger is doc.Trigger.EVENT:
            at_hand = tuple(e for d in transition.events for e in self.descriptor(d))
        self.reader.read_words(transition.delay)
        for target in transition.targets:
            self.reader.state(target)
        outer = self.reader
        self.reader = replace(outer, events=at_hand)
        self.reader.read(transition.guard)
        self.block(transition.content or ())
        self.reader = outer

    def descriptor(self, text: Text) -> tuple[Symbol, ...]:
        """Report an event, or a pattern of events; return those that it fits."""
        name = text.value
        fitting = self.names.matching(name)
        if fitting:
            self.reader.use(text, *fitting, role=Role.MATCH)
        for prefix, known in ((DONE_STATE, self.names.states), (DONE_INVOKE, self.names.invokes)):
            if name.startswith(prefix) and name[len(prefix) :] in known:
                self.reader.use(text.part(len(prefix), len(name)), known[name[len(prefix) :]])
        if name in self.names.events:
            self.reader.use(text, self.names.events[name])
            return (self.names.events[name], *fitting)
        if self.reader.within(text):
            return (self.names.resolve_path(name)[-1][2], *fitting)
        if name.startswith(PLATFORM):
            return (self.names.event(name), *fitting)
        if name.endswith("*"):
            return fitting
        if self.names.is_loose:
            self.reader.use(text, self.names.event(name))
            return (self.names.event(name), *fitting)
        if not fitting:
            self.reader.unknown(text)
        return fitting

    # --- statements -------------------------------------------------------------------------------

    def block(self, block: Iterable[stmt.WrittenStatement]) -> None:
        for statement in block:
            self.statement(statement)

    def statement(self, statement: stmt.WrittenStatement) -> None:
        reader = self.reader
        match statement:
            case stmt.Assign(location=location, value=value):
                reader.read(location)
                reader.read(value, reader.hint_of(location))
            case stmt.Raise(event=event, arguments=arguments):
                self.event(event, arguments)
            case stmt.DocSend():
                self.send(statement)
            case stmt.DocCancel(id=id_, id_expr=expression):
                if id_ is not None:
                    self.send_id(id_)
                reader.read(expression)
            case stmt.Log(values=values):
                for value in values:
                    reader.read(value)
            case stmt.If(branches=branches):
                for branch in branches:
                    reader.read(branch.condition)
                    self.block(branch.body)
            case stmt.ForEach():
                reader.read(statement.array)
                self.loop(statement.item)
                if statement.index is not None:
                    self.loop(statement.index)
                self.block(statement.body)
            case stmt.CallOperation(call=call):
                reader.read(call)
            case stmt.KeywordStatement(value=value):
                hints = [
                    self.names.enumeration(self.names.types.get(e)) for e in reader.events or ()
                ]
                reader.read(value, hints[0] if hints else None)
            case _:
                pass

    def loop(self, name: Text) -> None:
        symbol = self.names.values.get(name.value)
        declared = () if symbol is None else self.names.declared.get(symbol, ())
        if symbol is not None and any(d.name.span == name.span for d in declared):
            self.declare(name, symbol)
        else:
            self.reader.read(name)

    def event(self, name: Text, arguments: Sequence[stmt.DocArgument]) -> None:
        known = name.value in self.names.events or self.names.is_loose
        if known and not name.value.startswith(PLATFORM):
            self.reader.use(name, self.names.event(name.value))
        elif not name.value.startswith(PLATFORM):
            self.reader.unknown(name)
        self.arguments(self.names.event(name.value), arguments)

    def arguments(self, event: Symbol | None, arguments: Sequence[stmt.DocArgument]) -> None:
        known = {} if event is None else self.names.fields.get(event, {})
        for argument in arguments:
            symbol = known.get(argument.name.value)
            if symbol is None and event is not None and self._has_loose_fields(event):
                within = (event.kind.value, event.name)
                symbol = Symbol(SymbolKind.FIELD, event.owner, argument.name.value, within)
            if symbol is not None:
                self.reader.use(argument.name, symbol)
            self.reader.read(argument.value, self.reader.hint_of_symbol(symbol))

    def _has_loose_fields(self, event: Symbol) -> bool:
        return self.names.is_loose or event.name.startswith(PLATFORM)

    def send(self, send: stmt.DocSend) -> None:
        reader = self.reader
        if send.event is not None:
            self.event(send.event, send.arguments)
        else:
            self.arguments(None, send.arguments)
        event = None if send.event is None else self.names.event(send.event.value)
        for expression in (
            *(send.event_expr, send.target_expr, send.delay_expr, send.id_location),
            *(send.type_expr, send.content_expr),
        ):
            reader.read(expression)
        reader.read_words(send.delay)
        if send.id is not None:
            self.send_id(send.id, is_declared=True)
        if send.target is not None and send.target.value.startswith("#_"):
            name = send.target.value[2:]
            if name in self.names.invokes:
                reader.use(send.target.part(2, 2 + len(name)), self.names.invokes[name])
        for name_ in send.name_list:
            self.listed(name_, event)

    def listed(self, name: Text, event: Symbol | None) -> None:
        """Report a name that is both a variable and a field."""
        variable = self.names.values.get(name.value)
        if variable is None:
            self.reader.unknown(name)
            return
        symbols = [variable]
        if event is not None:
            known = self.names.fields.get(event, {})
            within = (event.kind.value, event.name)
            loose = Symbol(SymbolKind.FIELD, event.owner, name.value, within)
            symbols.append(known.get(name.value, loose))
        self.reader.use(name, *symbols)

    def send_id(self, text: Text, *, is_declared: bool = False) -> None:
        symbol = Symbol(SymbolKind.SEND, self.names.documents[-1][0], text.value)
        self.reader.use(text, symbol, role=Role.DECLARATION if is_declared else Role.USE)

    # --- used charts ------------------------------------------------------------------------------

    def used(self, state: doc.DocState, use: doc.DocUse) -> None:
        """Report the names in the use of a chart: those of that chart and those of this one."""
        name = "" if state.id is None else state.id.value
        chart = self.names.used.get(name)
        values = {} if chart is None else chart.values
        events = {} if chart is None else chart.events
        for argument in (*use.constants, *use.start, *use.bind):
            symbol = values.get(argument.name.value) or events.get(argument.name.value)
            if symbol is None:
                self.reader.unknown(argument.name)
            else:
                self.reader.use(argument.name, symbol)
            given = argument.value.strip()
            if given.value in self.names.events and given.value not in self.names.values:
                self.reader.use(given, self.names.events[given.value])
            else:
                self.reader.read(given)
        for leaving in use.exits:
            final = None if chart is None else chart.states.get(leaving.name.value)
            if final is None:
                self.reader.unknown(leaving.name)
            else:
                self.reader.use(leaving.name, final)
            for transition in leaving.transitions:
                self.transition(state, transition)

    # --- invoked charts ---------------------------------------------------------------------------

    def invoke(self, invoke: doc.DocInvoke) -> None:
        reader = self.reader
        if invoke.id is not None and invoke.id.value in self.names.invokes:
            self.declare(invoke.id, self.names.invokes[invoke.id.value])
        for expression in (
            *(invoke.id_location, invoke.type_expr, invoke.src_expr, invoke.content_expr),
        ):
            reader.read(expression)
        chart = None if invoke.src is None else self.invoked.get(invoke.src.value)
        for argument in invoke.arguments:
            given = None if chart is None else chart.values.get(argument.name.value)
            if given is not None:
                reader.use(argument.name, given)
            else:
                reader.unknown(argument.name)
            reader.read(argument.value)
        for name in invoke.name_list:
            symbols = [self.names.values.get(name.value)]
            symbols += [] if chart is None else [chart.values.get(name.value)]
            known = tuple(s for s in symbols if s is not None)
            if known:
                reader.use(name, *known)
        self.block(invoke.finalize or ())
        if chart is not None:
            self.link(chart)

    def link(self, chart: ChartNames) -> None:
        """Link the events exchanged with an invoked chart, and their fields."""
        for name, symbol in chart.events.items():
            if name not in self.names.events:
                continue
            own = self.names.events[name]
            self.links.append((own, symbol))
            theirs = chart.fields.get(symbol, {})
            for part, known in self.names.fields.get(own, {}).items():
                if part in theirs:
                    self.links.append((known, theirs[part]))
