"""Infer the types that a loose dialect does not declare from their uses.

* A variable has the type of its start value, joined with the types of the assigned values.
* An undeclared event has the fields that it is raised and sent with. An event that only the host
  can send has the fields that the chart reads.
* ``done.state.x`` has the fields of the final states in ``x``.

These types may depend on each other, so the inference repeats until nothing changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import fsmkit.language as lang
from fsmkit.chart.passes.collect_events import Events, done_event
from fsmkit.chart.passes.collect_names import Names
from fsmkit.chart.passes.number_states import Place, Tree, places
from fsmkit.chart.passes.plan_invocations import Slot
from fsmkit.chart.passes.read_payloads import PAYLOAD, Read, join_uses, reads
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.document.document import Document, Trigger
from fsmkit.document.invocation_context import InvocationContext
from fsmkit.language.binding.ecmascript import WHOLE_PAYLOAD
from fsmkit.language.constants import general_type, join_types
from fsmkit.language.statements import tree as stmt

MOST_ROUNDS = 10
"""A chain of dependencies longer than this is not followed to its end."""


def infer_types(
    document: Document,
    tree: Tree,
    names: Names,
    events: Events,
    findings: Findings,
    given: InvocationContext | None = None,
    slots: tuple[Slot, ...] = (),
) -> tuple[Names, Events]:
    """Return names and events with every type known.

    Report each type that no use determines. ``given`` holds the types that the invoking chart
    passes, ``slots`` the invocations of this chart.
    """
    uses = _Uses(names, events, slots=slots)
    content = tuple(places(document, tree)) if document.datamodel != "fsmkit" else ()
    for _ in range(2):
        is_settled = False
        for _ in range(MOST_ROUNDS):
            before = uses.known()
            for place in content:
                uses.record_block(place)
            uses.record_whole_payloads()
            uses.record_finals(tree)
            uses.record_invokes(tree)
            if given is not None:
                uses.record_given(given)
            uses.learn()
            is_settled = before == uses.known()
            if is_settled:
                break
        before = uses.known()
        uses.assume_numbers()
        if is_settled and before == uses.known():
            break  # another round would find the same
    uses.report_reads(findings)
    names = uses.names
    for data in names.data:
        if data.name in names.untyped:
            findings.add(
                "untyped-data",
                f"the type of `{data.name}` cannot be inferred: a whole number is assumed",
                data.span,
                help="give it a start value",
            )
    return names.with_types(dict.fromkeys(names.untyped, lang.INT32)), uses.events


@dataclass
class _Uses:
    names: Names
    events: Events
    slots: tuple[Slot, ...] = ()
    types: dict[str, lang.Type] = field(default_factory=dict)
    fields: dict[str, dict[str, lang.Type]] = field(default_factory=dict)
    read: dict[tuple[str, str], Text] = field(default_factory=dict)
    """By event and field: the first read of an undeclared field."""
    used: dict[tuple[str, str], dict[lang.Type, Text]] = field(default_factory=dict)
    """By event and field: the types inferred from uses, each with the first such use."""
    whole: list[tuple[str, Read]] = field(default_factory=list)
    """By event: the reads of its payload as one value, in the current round."""
    hints: dict[str, lang.Type] = field(default_factory=dict)
    """The types of variables that only their reads determine."""
    scopes: dict[tuple[int, ...], lang.Scope] = field(default_factory=dict)
    """By the current events, until more is known."""

    def known(self) -> tuple[object, ...]:
        """Return the types inferred so far, to compare them after the next round."""
        fields = {event: dict(known) for event, known in self.fields.items()}
        return dict(self.types), fields, dict(self.hints)

    def record_block(self, place: Place) -> None:
        """Record the types that one handler assigns and sends."""
        matched = self._matched(place)
        if place.invoke is not None:
            taken = {slot.index for slot in self.slots if slot.invoke is place.invoke}
            matched = tuple(e.index for e in self.events.all if e.invocation in taken)
        if (scope := self.scopes.get(matched)) is None:
            scope = self.scopes[matched] = replace(
                self.names.scope,
                event_fields=self.events.common_fields(matched),
                event_facts=self.events.common_facts(matched),
            )
        for statement in stmt.statements(place.block):
            self._use(statement, scope)
        of_host = bool(matched) and all(self._comes_from_host(index) for index in matched)
        sought = self.names.untyped - self.types.keys()
        if not of_host and not sought:
            return
        for read in reads(place, scope, self._expected, sought):
            if read.is_variable and read.type is not None:
                known = self.hints.get(read.name, read.type)
                self.hints[read.name] = join_uses(known, read.type) or known
            elif of_host and not read.is_variable:
                for index in matched:
                    event = self.events.all[index].name
                    if read.is_whole:
                        self.whole.append((event, read))
                    else:
                        self._read(event, read)

    def record_whole_payloads(self) -> None:
        """Record the types of payloads that are one value: no field of them is read.

        A use without a known type does not decide whether the payload is one value.
        """
        with_fields = {event for event, name in self.read if name != WHOLE_PAYLOAD}
        for event, read in self.whole:
            if event not in with_fields and read.type is not None:
                self._read(event, read)
        self.whole.clear()

    def record_finals(self, tree: Tree) -> None:
        """Record the types of final states' data, the payload of their parent's done event."""
        for node in tree.nodes:
            if node.state.done_data:
                event = done_event(tree, node)
                self._join(event, node.state.done_data, self.names.scope)

    def record_invokes(self, tree: Tree) -> None:
        """Record the type of the variables that ids of invocations are stored in."""
        for node in tree.nodes:
            for invoke in node.state.invokes:
                if invoke.id_location is not None:
                    self._assign(invoke.id_location.value.strip(), lang.SYMBOL)

    def record_given(self, given: InvocationContext) -> None:
        """Record the types that the invoking machine passes in data and events."""
        for name, type_ in given.data:
            self._assign(name, type_)
        for event, fields in given.events:
            if event in self.events.implied:
                known = self.fields.setdefault(event, {})
                for part in fields:
                    own = known.get(part.name, part.type)
                    known[part.name] = join_types(own, part.type) or own

    def assume_numbers(self) -> None:
        """Give the type `int32` to each event field that is read but has no inferred type.

        A variable to which nothing typed is assigned has the type inferred from its reads.
        """
        for name in self.hints.keys() & self.names.untyped - self.types.keys():
            self.types[name] = self.hints[name]
        for event, name in self.read:
            self.fields.setdefault(event, {}).setdefault(name, lang.INT32)
        self.learn()

    def report_reads(self, findings: Findings) -> None:
        """Report the fields that the host must supply, with their types."""
        for (event, name), at in self.read.items():
            what = (
                f"the payload of `{event}`"
                if at.value.strip("() \t\n") == PAYLOAD
                else (f"the field `{name}` of `{event}`")
            )
            others = {
                other: place
                for other, place in self.used.get((event, name), {}).items()
                if self.fields[event][name] == lang.SYMBOL and other not in (lang.SYMBOL, lang.BOOL)
            }
            findings.add(
                "assumed-field",
                f"nothing declares {what}: it is taken to be `{self.fields[event][name]}`",
                at,
                secondary=[(place, f"used as `{other}` here") for other, place in others.items()],
                help=f"declare the event: `{event}({name} {self.fields[event][name]})`",
            )

    def learn(self) -> None:
        """Apply the recorded types, so that the next round knows them."""
        names, events = self.names.with_types(self.types), self._learned()
        if (names, events) != (self.names, self.events):
            self.names, self.events = names, events
            self.scopes.clear()

    def _learned(self) -> Events:
        return replace(
            self.events,
            all=tuple(
                replace(e, fields=tuple(lang.Field(n, t) for n, t in self.fields[e.name].items()))
                if e.name in self.fields and e.invocation is None
                else e
                for e in self.events.all
            ),
        )

    def _comes_from_host(self, index: int) -> bool:
        event = self.events.all[index]
        return event.invocation is None and event.name in self.events.matched

    def _read(self, event: str, read: Read) -> None:
        self.read.setdefault((event, read.name), read.at)
        if read.type is not None:
            self.used.setdefault((event, read.name), {}).setdefault(read.type, read.at)
            fields = self.fields.setdefault(event, {})
            known = fields.get(read.name, read.type)
            fields[read.name] = join_uses(known, read.type) or known

    def _expected(self, text: Text, scope: lang.Scope) -> lang.Type | None:
        """Return the type of the operand beside a use; for an untyped variable, its hint."""
        return type_of(text, scope) or self.hints.get(text.value.strip())

    def _matched(self, place: Place) -> tuple[int, ...]:
        transition = place.transition
        if transition is None or transition.trigger is not Trigger.EVENT:
            return ()
        matched = {i for e in transition.events for i in self.events.matching(e.value)}
        return tuple(sorted(matched))

    def _use(self, statement: stmt.WrittenStatement, scope: lang.Scope) -> None:
        match statement:
            case stmt.Assign(location, value, operator=operator):
                name = location.value.strip()
                if self._is_sought(name):
                    text = _joined(location, operator, value) if operator else value
                    self._assign(name, type_of(text, scope))
            case stmt.Raise(event, arguments):
                self._send(event.value, arguments, scope)
            case stmt.DocSend(event=event, arguments=arguments, name_list=listed):
                name = "" if event is None else event.value
                named = tuple(stmt.DocArgument(n, n) for n in listed)
                self._send(name, (*arguments, *named), scope)
                if statement.id_location is not None:
                    self._assign(statement.id_location.value.strip(), lang.SYMBOL)
            case stmt.ForEach(array, item, index):
                type_, _ = scope.variables.get(array.value, (None, None))
                if isinstance(type_, lang.ArrayType):
                    self._assign(item.value, type_.element)
                    if index is not None:
                        self._assign(index.value, general_type(lang.IntType(0, type_.length - 1)))
            case _:
                pass

    def _is_sought(self, name: str) -> bool:
        return name in self.names.inferred or name in self.names.untyped or name in self.types

    def _assign(self, name: str, type_: lang.Type | None) -> None:
        if type_ is None or not self._is_sought(name):
            return
        known = self.types.get(name)
        if known is None and name in self.names.scope.variables:
            known = self.names.scope.variables[name][0]
        self.types[name] = type_ if known is None else join_types(known, type_) or known

    def _send(self, event: str, arguments: tuple[stmt.DocArgument, ...], scope: lang.Scope) -> None:
        if event in self.events.implied:
            self._join(event, arguments, scope)

    def _join(self, event: str, arguments: tuple[stmt.DocArgument, ...], scope: lang.Scope) -> None:
        fields = self.fields.setdefault(event, {})
        for argument in arguments:
            type_ = type_of(argument.value, scope)
            if type_ is not None:
                known = fields.get(argument.name.value, type_)
                fields[argument.name.value] = join_types(known, type_) or known


def type_of(text: Text, scope: lang.Scope) -> lang.Type | None:
    """Return the type a variable needs that takes this value; None while it is not known."""
    findings = Findings()
    typed = lang.type_expression(text, scope, findings)
    if typed is None or findings.has_errors or typed.type is None:
        return None
    return general_type(typed.type)


def _joined(location: Text, operator: str, value: Text) -> Text:
    """Return ``location operator (value)``, each character at the place it came from."""
    before = [location.span_of(i, i + 1).start for i in range(len(location.value))]
    inside = [value.span_of(i, i + 1).start for i in range(len(value.value))]
    joint = f" {operator} ("
    offsets = (
        *before,
        *([value.span.start] * len(joint)),
        *inside,
        max(value.span.start, value.span.end - 1),
    )
    text = f"{location.value}{joint}{value.value})"
    span = Span(location.span.source, location.span.start, value.span.end)
    return Text(text, span, offsets)
