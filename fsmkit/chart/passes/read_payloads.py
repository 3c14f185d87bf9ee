"""Find the fields that handlers read of undeclared events that only the host sends.

A field is known by being read (``_event.data.x``), its type by what stands beside it: what it is
assigned to, compared or added with, or that it is a condition. The same is found of variables
that nothing else types, so that a field is typed by the uses of the variable that takes it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from fsmkit.chart.passes.number_states import Place
from fsmkit.diagnostics import Text
from fsmkit.document.document import DocTransition
from fsmkit.language import BOOL, SYMBOL, FloatType, IntType, Scope, Type, syntax
from fsmkit.language.binding.ecmascript import WHOLE_PAYLOAD
from fsmkit.language.constants import join_types
from fsmkit.language.statements import tree as stmt

TypeOf = Callable[[Text, Scope], Type | None]
JOINING = ("&&", "||")
PAYLOAD = "_event.data"
"""A payload that is one value, as it is read."""
EVENT = "_event"
"""Texts that every read of an event contains."""


@dataclass(frozen=True, slots=True)
class Read:
    """A read of a field: its name, its location and the type inferred from the use, if any."""

    name: str
    at: Text
    type: Type | None
    is_variable: bool = False
    is_whole: bool = False
    """Whether it is the payload as one value."""


def reads(
    place: Place, scope: Scope, type_of: TypeOf, sought: Collection[str] = ()
) -> Iterator[Read]:
    """Yield the reads of the payload and of the variables ``sought`` in one handler.

    ``type_of`` types the other operand of an expression.
    """
    wanted = re.compile("|".join([EVENT, *(re.escape(name) for name in sorted(sought))]))

    def expected_at(location: Text, value: Text) -> Type | None:
        return type_of(location, scope) if wanted.search(value.value) else None

    for text, expected in _texts(place.transition, stmt.statements(place.block), expected_at):
        if not wanted.search(text.value):
            continue
        try:
            node = syntax.parse(text.value)
        except syntax.SyntaxFault:
            continue
        yield from _Reader(text, scope, type_of, frozenset(sought)).look(node, expected)


def join_uses(first: Type, second: Type) -> Type | None:
    """Return the type of a value that is used as `first` and as `second`.

    Return None if one of the uses must fail. A value compared with a string is a string. A value
    that is used as a condition may be a number.
    """
    if SYMBOL in (first, second):
        return SYMBOL
    if first == BOOL and isinstance(second, IntType | FloatType):
        return second
    if second == BOOL and isinstance(first, IntType | FloatType):
        return first
    return join_types(first, second)


def _texts(
    transition: DocTransition | None,
    content: Iterator[stmt.WrittenStatement],
    expected_at: Callable[[Text, Text], Type | None],
) -> Iterator[tuple[Text, Type | None]]:
    """Yield each expression of a handler, with the type its place wants if it may read."""
    if transition is not None and transition.guard is not None:
        yield transition.guard, BOOL
    for statement in content:
        match statement:
            case stmt.Assign(location, value):
                yield value, expected_at(location, value)
            case stmt.If(branches):
                yield from ((b.condition, BOOL) for b in branches if b.condition is not None)
            case stmt.Raise(arguments=arguments) | stmt.DocSend(arguments=arguments):
                yield from ((argument.value, None) for argument in arguments)
            case stmt.DocCancel(id_expr=Text() as expr):
                yield expr, None
            case _:
                pass


@dataclass(frozen=True, slots=True)
class _Reader:
    text: Text
    scope: Scope
    type_of: TypeOf
    sought: frozenset[str] = frozenset()

    def look(self, node: syntax.Node, expected: Type | None) -> Iterator[Read]:
        match node:
            case syntax.MemberNode(
                base=syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data")
            ):
                yield Read(node.name, self._part(node), expected)
            case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"):
                yield Read(WHOLE_PAYLOAD, self._part(node), expected, is_whole=True)
            case syntax.NameNode(name=name) if name in self.sought:
                yield Read(name, self._part(node), expected, is_variable=True)
            case syntax.BinaryNode(op=op, left=left, right=right):
                joins = op in JOINING
                yield from self.look(left, BOOL if joins else self._type(right))
                yield from self.look(right, BOOL if joins else self._type(left))
            case syntax.UnaryNode(op="typeof"):
                pass
            case syntax.UnaryNode(op=op, operand=operand):
                yield from self.look(operand, BOOL if op == "!" else None)
            case syntax.ConditionalNode(test=test, then=then, otherwise=otherwise):
                yield from self.look(test, BOOL)
                yield from self.look(then, expected or self._type(otherwise))
                yield from self.look(otherwise, expected or self._type(then))
            case syntax.MemberNode() | syntax.ElementNode() | syntax.CallNode():
                # the use of a record, an array or an object does not determine its type
                for child in syntax.children(node):
                    if not self._is_field(child):
                        yield from self.look(child, None)
            case _:
                for child in syntax.children(node):
                    yield from self.look(child, None)

    def _is_field(self, node: syntax.Node) -> bool:
        while isinstance(node, syntax.MemberNode):
            if isinstance(node.base, syntax.NameNode) and node.base.name == "_event":
                return True
            node = node.base
        return False

    def _type(self, node: syntax.Node) -> Type | None:
        return self.type_of(self._part(node), self.scope)

    def _part(self, node: syntax.Node) -> Text:
        return self.text.part(node.start, node.end)
