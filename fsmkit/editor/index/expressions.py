"""The names in expressions and types, found without elaborating the chart."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from fsmkit.diagnostics import Text
from fsmkit.editor.index.chart_names import ChartNames
from fsmkit.editor.index.symbols import Occurrence, Role, Symbol, SymbolKind
from fsmkit.language import syntax
from fsmkit.language.binding.calls import BUILT_IN

WORD = re.compile(r"(?<![\w.$\"'])[A-Za-z_]\w*")
Hint = str | None
"""The name of the enumeration expected at an expression."""


@dataclass(frozen=True, slots=True)
class ExpressionReader:
    """Finds names. ``events`` are the possible current events; None: unknown."""

    names: ChartNames
    report: Callable[[Occurrence], None]
    events: tuple[Symbol, ...] | None = ()

    def read(self, text: Text | None, hint: Hint = None) -> None:
        """Report the names of an expression; nothing if it is invalid."""
        if text is None:
            return
        try:
            node = syntax.parse(text.value)
        except (syntax.SyntaxFault, RecursionError):
            return
        self._visit(node, text, hint)

    def read_words(self, text: Text | None) -> None:
        """Report the names in a type, with constants as bounds, and the constants in a delay."""
        if text is None:
            return
        for match in WORD.finditer(text.value):
            symbol = self.names.values.get(match[0])
            if symbol is not None:
                self.use(text.part(*match.span()), symbol)

    def use(self, text: Text, *symbols: Symbol, role: Role = Role.USE) -> None:
        """Report one name."""
        self.report(Occurrence(symbols, text.value, role, text.span))

    def unknown(self, text: Text) -> None:
        """Report a name of which nothing is known."""
        self.report(Occurrence((), text.value, Role.UNKNOWN, text.span))

    # --- the enumeration that an expression is of -------------------------------------------------

    def hint_of(self, text: Text | None) -> Hint:
        """Return the enumeration that the value of a text is of, if it is of one."""
        if text is None:
            return None
        try:
            return self._enumeration(syntax.parse(text.value))
        except (syntax.SyntaxFault, RecursionError):
            return None

    def hint_of_symbol(self, symbol: Symbol | None) -> Hint:
        """Return the enumeration that a variable, a field or a constant is of."""
        if symbol is None:
            return None
        found = self.names.enumeration(self.names.types.get(symbol))
        start = self.names.starts.get(symbol)
        if found is None and self.names.types.get(symbol) is None and start is not None:
            return self.hint_of(start) if symbol.name not in start.value else None
        return found

    def _enumeration(self, node: syntax.Node) -> Hint:
        match node:
            case syntax.NameNode(name=name):
                return self.hint_of_symbol(self.names.values.get(name))
            case syntax.MemberNode(base=syntax.NameNode(name=name)) if name in self.names.members:
                return name
            case syntax.MemberNode():
                return self.hint_of_symbol(self._field(node))
            case syntax.ElementNode(base=base):
                return self._enumeration(base)
            case syntax.CallNode(callee=syntax.NameNode(name=name)):
                return self.hint_of_symbol(self.names.values.get(name))
            case syntax.ConditionalNode(then=then, otherwise=otherwise):
                return self._enumeration(then) or self._enumeration(otherwise)
            case _:
                return None

    def _record(self, node: syntax.Node) -> Symbol | None:
        """Return the record that a node has the value of."""
        match node:
            case syntax.NameNode(name=name):
                symbol = self.names.values.get(name)
                return None if symbol is None else self.names.record(self.names.types.get(symbol))
            case syntax.ElementNode(base=base):
                return self._record(base)
            case syntax.MemberNode():
                field = self._field(node)
                return None if field is None else self.names.record(self.names.types.get(field))
            case syntax.CallNode(callee=syntax.NameNode(name=name)):
                symbol = self.names.values.get(name)
                return None if symbol is None else self.names.record(self.names.types.get(symbol))
            case _:
                return None

    def _field(self, node: syntax.MemberNode) -> Symbol | None:
        """Return the field of an event or a record that a node names."""
        if self._is_event(node.base):
            found = self._event_fields(node.name)
            return found[0] if found else None
        record = self._record(node.base)
        return None if record is None else self.names.fields.get(record, {}).get(node.name)

    def _is_event(self, node: syntax.Node) -> bool:
        match node:
            case syntax.NameNode(name="event" | "_event" as name):
                return name not in self.names.values
            case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"):
                return True
            case _:
                return False

    def _event_fields(self, name: str) -> tuple[Symbol, ...]:
        found = []
        for event in self.events or ():
            known = self.names.fields.get(event, {})
            if name in known:
                found.append(known[name])
            elif self.names.is_loose:
                within = (event.kind.value, event.name)
                found.append(Symbol(SymbolKind.FIELD, event.owner, name, within))
        return tuple(dict.fromkeys(found))

    # --- names ------------------------------------------------------------------------------------

    def _visit(self, node: syntax.Node, text: Text, hint: Hint) -> None:
        match node:
            case syntax.NameNode():
                self._name(node, text, hint)
            case syntax.MemberNode():
                self._member(node, text)
            case syntax.CallNode():
                self._call(node, text)
            case syntax.BinaryNode(
                op="==" | "!=" | "<" | "<=" | ">" | ">=", left=left, right=right
            ):
                self._named_event(left, right, text)
                self._named_event(right, left, text)
                self._visit(left, text, self._enumeration(right))
                self._visit(right, text, self._enumeration(left))
            case syntax.ConditionalNode(test=test, then=then, otherwise=otherwise):
                self._visit(test, text, None)
                self._visit(then, text, hint or self._enumeration(otherwise))
                self._visit(otherwise, text, hint or self._enumeration(then))
            case syntax.ElementNode(base=base, index=index):
                self._visit(base, text, None)
                self._visit(index, text, None)
            case _:
                for child in syntax.children(node):
                    self._visit(child, text, hint)

    def _name(self, node: syntax.NameNode, text: Text, hint: Hint) -> None:
        name = node.name
        at = text.part(node.start, node.end)
        if at.value != name:  # brackets belong to the place of a node
            start = text.value.index(name, node.start)
            at = text.part(start, start + len(name))
        symbol = self.names.values.get(name)
        if symbol is not None:
            self.use(at, symbol)
        elif hint is not None and name in self.names.members[hint]:
            self.use(at, self.names.members[hint][name])
        elif name not in ("event", "_event", "_name", "_sessionid", "Infinity", "NaN"):
            having = [m[name] for m in self.names.members.values() if name in m]
            if len(having) == 1:
                self.use(at, having[0])
            else:
                self.unknown(at)

    def _member(self, node: syntax.MemberNode, text: Text) -> None:
        at = text.part(node.name_start, node.name_start + len(node.name))
        if self._is_event(node.base):
            is_fact = isinstance(node.base, syntax.NameNode) and node.base.name == "_event"
            if is_fact and not self._event_fields(node.name):
                return  # `_event.name` and the like
            found = self._event_fields(node.name)
            if found:
                self.use(at, *found)
            else:
                self.unknown(at)
            return
        if isinstance(node.base, syntax.NameNode) and node.base.name in self.names.members:
            self._name(node.base, text, None)
            member = self.names.members[node.base.name].get(node.name)
            if member is not None:
                self.use(at, member)
            else:
                self.unknown(at)
            return
        whole = text.part(node.start, node.end)
        if "(" not in whole.value and self.within(whole.strip()):
            return
        self._visit(node.base, text, None)
        field = self._field(node)
        if field is not None:
            self.use(at, field)

    def _call(self, node: syntax.CallNode, text: Text) -> None:
        match node.callee:
            case syntax.NameNode(name="In") if "In" not in self.names.values:
                for argument in node.arguments:
                    self._state(argument, text)
                return
            case syntax.NameNode(name="occurs") if "occurs" not in self.names.values:
                for argument in node.arguments:
                    self.event(text.part(argument.start, argument.end).strip())
                return
            case syntax.NameNode(name=name) if name not in BUILT_IN or name in self.names.values:
                self._name(node.callee, text, None)
                symbol = self.names.values.get(name)
                wanted = () if symbol is None else tuple(self.names.fields.get(symbol, {}).values())
                for place, argument in enumerate(node.arguments):
                    hint = self.hint_of_symbol(wanted[place]) if place < len(wanted) else None
                    self._visit(argument, text, hint)
                return
            case _:
                pass
        for argument in node.arguments:
            self._visit(argument, text, None)

    def event(self, at: Text) -> None:
        """Record a use of the event with this name, or an unknown name."""
        symbol = self.names.events.get(at.value)
        if symbol is not None:
            self.use(at, symbol)
        else:
            self.unknown(at)

    def _state(self, node: syntax.Node, text: Text) -> None:
        at = text.part(node.start, node.end).strip()
        if isinstance(node, syntax.StringNode) and len(at.value) >= 2:
            at = at.part(1, len(at.value) - 1)
        self.state(at)

    def state(self, at: Text) -> None:
        """Report the name of a state, or of the main region of one: ``working.main``."""
        symbol = self.names.states.get(at.value)
        name = at.value.removesuffix(".main")
        if symbol is not None:
            self.use(at, symbol)
        elif name != at.value and name in self.names.states:
            self.use(at.part(0, len(name)), self.names.states[name])
        elif self.within(at):
            pass
        else:
            self.unknown(at)

    def within(self, at: Text) -> bool:
        """Report a name that leads into a used chart; whether it is one."""
        found = self.names.resolve_path(at.value)
        for start, end, symbol in found:
            self.use(at.part(start, end), symbol)
        return bool(found)

    def _named_event(self, one: syntax.Node, other: syntax.Node, text: Text) -> None:
        """Report the event in ``_event.name == 'start'``."""
        match one, other:
            case syntax.MemberNode(
                base=syntax.NameNode(name="_event"), name="name"
            ), syntax.StringNode(value=name):
                if name in self.names.events:
                    at = text.part(other.start, other.end).strip()
                    self.use(at.part(1, len(at.value) - 1), self.names.events[name])
