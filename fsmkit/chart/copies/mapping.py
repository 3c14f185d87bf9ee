"""Map the names in a typed tree: variables, operations, events, types, states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache
from typing import Any

from fsmkit.chart import statements as stmt
from fsmkit.chart.chart import Event
from fsmkit.diagnostics import Span
from fsmkit.document.document import Direction
from fsmkit.language import (
    ArrayType,
    Call,
    Convert,
    Element,
    EnumType,
    EventField,
    Expr,
    Field,
    FunctionBody,
    InState,
    Literal,
    Numbers,
    RecordType,
    Storage,
    Type,
    Variable,
    default_value,
)
from fsmkit.language.conversion import convert
from fsmkit.language.walk import rewrite

TYPES = (EnumType, RecordType, ArrayType)


@dataclass(frozen=True, slots=True)
class Mapper:
    """The names of a used chart in one copy.

    ``variables`` maps each variable to the expression that replaces a read. ``places`` holds the
    variables that can be written. ``operations`` maps an operation to its name, or to the call that
    replaces it and the names of its parameters. ``events`` maps indices; ``outward`` those of bound
    events.
    """

    prefix: str
    base: int
    """The index of the using state: a state of the used chart is so much further here."""
    slot: int
    """The same for invocations."""
    types: Mapping[Type, Type]
    variables: Mapping[str, Expr]
    operations: Mapping[str, str | tuple[tuple[str, ...], Call]]
    events: Mapping[int, int]
    bound: frozenset[int]
    """The events of the used chart that are bound."""
    before: tuple[Event, ...]
    after: tuple[Event, ...]
    """The events of the used chart, and of this one."""
    constants: frozenset[str] = frozenset()
    functions: dict[str, FunctionBody] = field(default_factory=dict)
    """The functions of the used chart, as they are here, by their names there."""
    report: Callable[[str, Span], None] = field(default=lambda _message, _span: None)
    """Reports a construct that a copy cannot express, with its location."""

    def name(self, inner: str) -> str:
        """Return the name in this chart of an element of the used chart."""
        return f"{self.prefix}.{inner}"

    def type(self, type_: Type) -> Type:
        """Return a type in the types of this chart."""
        return mapped_type(type_, self.types)

    def fields(self, declared: tuple[Field, ...]) -> tuple[Field, ...]:
        """Return fields or parameters in the types of this chart."""
        return tuple(Field(part.name, self.type(part.type)) for part in declared)

    def function(self, function: FunctionBody) -> FunctionBody:
        """Return a function as it is in the copy."""
        mapped: FunctionBody = _Content(self, ()).value(function)
        return mapped

    def block(self, block: stmt.Block, at: tuple[int, ...] = ()) -> stmt.Block:
        """Return a handler; ``at``: the events, of this chart, that it handles."""
        mapped: stmt.Block = _Content(self, at).value(block)
        return mapped

    def expr(self, expr: Expr, at: tuple[int, ...] = ()) -> Expr:
        """Return an expression."""
        mapped: Expr = _Content(self, at).value(expr)
        return mapped


def mapped_type(type_: Type, types: Mapping[Type, Type]) -> Type:
    """Return a type in which some declared ones are others."""
    if not types or not isinstance(type_, TYPES):
        return type_
    if type_ in types:
        return types[type_]
    if isinstance(type_, ArrayType):
        return replace(type_, element=mapped_type(type_.element, types))
    if isinstance(type_, RecordType):
        parts = tuple(replace(f, type=mapped_type(f.type, types)) for f in type_.fields)
        return replace(type_, fields=parts)
    return type_


@cache
def _rest(kind: type[Any]) -> tuple[str, ...] | None:
    """Return the fields of a class that may hold nodes or types; None if it is not a node."""
    if not is_dataclass(kind) or kind in (Span, *TYPES) or issubclass(kind, Type):
        return None
    plain = ("str", "int", "bool", "Span", "UnaryOp", "BinaryOp", "Function", "Storage")
    return tuple(
        one.name for one in fields(kind) if str(one.type).removesuffix(" | None") not in plain
    )


@dataclass(frozen=True, slots=True)
class _Content:
    mapper: Mapper
    at: tuple[int, ...]

    def value(self, node: Any) -> Any:
        """Return a node as it is in the copy."""
        m = self.mapper
        match node:
            case tuple():
                return tuple([self.value(each) for each in node])
            case Variable(storage=Storage.LOCAL):
                return replace(node, name=m.name(node.name), type=m.type(node.type))
            case FunctionBody():
                return self._function(node)
            case Variable():
                found = m.variables.get(node.name, node)
                return replace(found, span=node.span) if isinstance(found, Variable) else found
            case Literal():
                name = m.name(node.name) if node.name in m.constants else node.name
                return replace(node, type=m.type(node.type), name=name)
            case InState():
                return replace(node, state=node.state + m.base, id=m.name(node.id))
            case EventField():
                return self._event_field(node)
            case Call():
                return self._call(node)
            case stmt.CallOperation(call):
                made = self._call(call)
                while isinstance(made, Convert):
                    made = made.operand
                return replace(node, call=made)
            case Element():
                return replace(
                    node,
                    array=self.place(node.array),
                    index=self.value(node.index),
                    type=m.type(node.type),
                )
            case stmt.Assign(location, value):
                place, made = self.place(location), self.value(value)
                return replace(node, location=place, value=_stored(made, place.type))
            case stmt.ForEach():
                return replace(
                    node,
                    array=self.place(node.array),
                    item=self.place(node.item),
                    index=None if node.index is None else self.place(node.index),
                    body=self.value(node.body),
                )
            case stmt.Raise(event, arguments):
                made = self._arguments(event, arguments, node.span)
                return replace(node, event=m.events[event], arguments=made)
            case stmt.Send():
                return self._send(node)
            case stmt.Cancel(id=name):
                return replace(node, id=m.name(name))
            case stmt.Log(label, values):
                return replace(
                    node, label=m.name(label) if label else label, values=self.value(values)
                )
            case stmt.Invoke(slot, arguments):
                return replace(node, invocation=slot + m.slot, arguments=self.value(arguments))
            case _:
                return self._rebuilt(node)

    def _rebuilt(self, node: Any) -> Any:
        names = _rest(node.__class__)
        if names is None:
            return self.mapper.type(node) if isinstance(node, TYPES) else node
        new = {}
        for name in names:
            old = getattr(node, name)
            made = self.value(old)
            if made is not old:
                new[name] = made
        return replace(node, **new) if new else node

    def place(self, location: Any) -> Any:
        """Return the mapped location of an assignment or of a loop: a variable or a part of one."""
        if isinstance(location, Numbers) or (
            isinstance(location, Variable) and location.storage is Storage.LOCAL
        ):
            return self.value(location)
        if isinstance(location, Variable):
            found = self.mapper.variables.get(location.name, location)
            while isinstance(found, Convert):
                found = found.operand
            return replace(found, span=location.span)
        if isinstance(location, Element):
            return self.value(location)
        return replace(
            location,
            record=self.place(location.record),
            type=self.mapper.type(location.type),
        )

    def _function(self, function: FunctionBody) -> FunctionBody:
        """Return the function of this chart for one of the used chart; each is built once."""
        known = self.mapper.functions
        if function.name not in known:
            rebuilt: FunctionBody = self._rebuilt(function)
            known[function.name] = replace(rebuilt, name=self.mapper.name(function.name))
        return known[function.name]

    def _event_field(self, node: EventField) -> Expr:
        """Return a field of the current event, which may be of a narrower type here."""
        wanted = self.mapper.type(node.type)
        kinds = {
            part.type
            for event in self.at
            for part in self.mapper.after[event].fields
            if part.name == node.name
        } or {wanted}
        if len(kinds) > 1:
            self.mapper.report(f"`{node.name}` has several types among the events", node.span)
        found = EventField(node.name, next(iter(kinds)), node.span)
        return convert(found, wanted)

    def _call(self, node: Call) -> Any:
        m = self.mapper
        arguments = tuple(self.value(argument) for argument in node.arguments)
        result = None if node.type is None else m.type(node.type)
        found = m.operations[node.operation]
        if isinstance(found, str):
            return Call(found, arguments, result, node.span)
        names, pattern = found
        given = dict(zip(names, arguments, strict=True))

        def argument(part: Expr) -> Expr | None:
            return given.get(part.name) if isinstance(part, Variable) else None

        made = replace(rewrite(pattern, argument), span=node.span)
        assert isinstance(made, Call)  # noqa: S101  (a pattern is a call)
        return made if result is None or made.type is None else convert(made, result)

    def _arguments(self, event: int, given: tuple[Expr, ...], span: Span) -> tuple[Expr, ...]:
        """Return the payload of an event, in the order that its fields have here."""
        m = self.mapper
        names = [part.name for part in m.before[event].fields]
        values = dict(zip(names, self.value(given), strict=True))
        found = []
        for part in m.after[m.events[event]].fields:
            if part.name in values:
                found.append(_stored(values[part.name], part.type))
            else:
                if event in m.bound:
                    m.report(f"nothing fills the field `{part.name}`", span)
                found.append(Literal(default_value(part.type), part.type, span))
        return tuple(found)

    def _send(self, node: stmt.Send) -> Any:
        """Return a sent event; a bound one gets the destination of the event of this chart."""
        m = self.mapper
        event = m.events[node.event]
        made = replace(
            node,
            event=event,
            arguments=self._arguments(node.event, node.arguments, node.span),
            delay=None if node.delay is None else self.value(node.delay),
            id=None if node.id is None else m.name(node.id),
            invocations=tuple(slot + m.slot for slot in node.invocations),
        )
        if node.destination is not stmt.Destination.PORT or node.event not in m.bound:
            return made
        if Direction.OUT in m.after[event].directions:
            return made
        if m.after[event].directions == {Direction.INTERNAL} and node.delay is None:
            return stmt.Raise(event, made.arguments, node.span)
        return replace(made, destination=stmt.Destination.SELF, peer=None)


def _stored(expr: Expr, type_: Type) -> Expr:
    """Return a value converted to a type, or itself if it has that type."""
    return expr if expr.type == type_ else convert(expr, type_)
