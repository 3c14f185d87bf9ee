"""What only ECMAScript can ask, as far as it is decided when compiling.

System variables (SCXML 5.10), whether something is defined, and what counts as true.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fsmkit.language.arithmetic import exact
from fsmkit.language.folding import fold
from fsmkit.language.syntax import (
    BinaryNode,
    ElementNode,
    MemberNode,
    NameNode,
    Node,
    StringNode,
    UnaryNode,
)
from fsmkit.language.tree import (
    Binary,
    BinaryOp,
    Element,
    EventField,
    EventName,
    EventType,
    Expr,
    Literal,
    Member,
    Unary,
    UnaryOp,
    Variable,
)
from fsmkit.language.types import (
    BOOL,
    FLOAT64,
    SYMBOL,
    ArrayType,
    BoolType,
    FloatType,
    IntType,
    RecordType,
    SymbolType,
    Type,
)

if TYPE_CHECKING:
    from fsmkit.diagnostics import Span
    from fsmkit.language.binding.binder import Binder
    from fsmkit.language.names import Context
    from fsmkit.language.scope import Scope

EVENT_FIELDS = ("name", "type", "sendid", "origin", "origintype", "invokeid", "data")
"""The properties that every ``_event`` has (SCXML 5.10.1)."""
WHOLE_PAYLOAD = "data"
"""The field that holds a payload which is one value: that of ``content`` (SCXML 5.6)."""
SEND_ID = "_sendid"
"""The field that holds the id of what was sent, in a chart that asks for ``_event.sendid``."""
PROCESSOR = "http://www.w3.org/TR/scxml/#SCXMLEventProcessor"
PROCESSORS = ("scxml", PROCESSOR)
SESSION = "_sessionid"
NOTHING = ("undefined", "null")


def flag_of(name: str) -> str:
    """Return the name of the variable that tells whether another has been given a value."""
    return f"bound_{name}"


def location_of_session(session: str) -> str:
    """Return the target under which a session reaches itself (SCXML C.1)."""
    return f"#_scxml_{session}"


def truth(expr: Expr) -> Expr:
    """Return what a value counts as in a condition; itself where nothing is sure."""
    match expr.type:
        case IntType():
            zero = Literal(0, exact(0, 0), expr.span)
            return Binary(BinaryOp.NE, expr, zero, BOOL, expr.span)
        case FloatType() if isinstance(expr, Variable | EventField | Member | Element | Literal):
            zero = Literal(0.0, FLOAT64, expr.span)
            less = Binary(BinaryOp.LT, expr, zero, BOOL, expr.span)
            greater = Binary(BinaryOp.GT, expr, zero, BOOL, expr.span)
            return Binary(BinaryOp.OR, less, greater, BOOL, expr.span)
        case SymbolType():
            return Binary(BinaryOp.NE, expr, Literal("", SYMBOL, expr.span), BOOL, expr.span)
        case ArrayType() | RecordType() if isinstance(expr, Variable | EventField | Member):
            return Literal(True, BOOL, expr.span)
        case _:
            return expr


def bind_truth(binder: Binder, node: Node, hint: Type | None = None) -> Expr | None:
    """Type what is only asked for its truth: there a payload of several fields is an object."""
    match node:
        case MemberNode(base=NameNode(name="_event"), name="data") if (
            binder.context.is_ecmascript
            and WHOLE_PAYLOAD not in (binder.context.scope.event_fields or {})
        ):
            known = _is_defined(binder, node, binder.span(node))
            return binder.value(node, hint) if known is None else known
        case _:
            return binder.value(node, hint)


def bind_comparison(binder: Binder, node: BinaryNode) -> Expr | None:
    """Type ``typeof x == '...'`` and ``x == undefined``; None where it is neither."""
    for asked, answer in ((node.left, node.right), (node.right, node.left)):
        found: Expr | None = None
        match asked, answer:
            case UnaryNode(op="typeof", operand=operand), StringNode(value=kind):
                found = _is_of_kind(binder, operand, kind, binder.span(node))
            case _, NameNode(name="undefined" | "null"):
                found = _is_defined(binder, asked, binder.span(node))
                found = None if found is None else _not(found)
            case _:
                pass
        if found is not None:
            return _not(found) if node.op == BinaryOp.NE.value else found
    return None


def _is_of_kind(binder: Binder, node: Node, kind: str, span: Span) -> Expr | None:
    if isinstance(node, NameNode) and node.name in ("_event", "_ioprocessors"):
        return Literal(kind == "object", BOOL, span)
    if isinstance(node, NameNode) and not _is_known(binder, node.name):
        return Literal(kind == "undefined", BOOL, span)
    defined = _is_defined(binder, node, span)
    if kind == "undefined":
        return None if defined is None else _not(defined)
    value = binder.value(node)
    if value is None or value.type is None:
        return None
    if kind != _kind(value.type):
        return Literal(False, BOOL, span)
    return defined or Literal(True, BOOL, span)


def _is_known(binder: Binder, name: str) -> bool:
    scope = binder.context.scope
    known = name in scope.variables or name in scope.constants or flag_of(name) in scope.variables
    return known or name in ("_event", "_ioprocessors")


def _kind(type_: Type) -> str:
    """Return what ``typeof`` says of the values of a type."""
    match type_:
        case BoolType():
            return "boolean"
        case SymbolType():
            return "string"
        case ArrayType() | RecordType():
            return "object"
        case _:
            return "number"


def _is_defined(binder: Binder, node: Node, span: Span) -> Expr | None:
    """Return whether something has a value, None where that is not known when compiling."""
    scope = binder.context.scope
    match node:
        case NameNode(name=name) if flag_of(name) in scope.variables:
            type_, storage = scope.variables[flag_of(name)]
            return Variable(flag_of(name), type_, storage, span)
        case NameNode(name=name) if _is_known(binder, name):
            return Literal(True, BOOL, span)
        case MemberNode(base=NameNode(name="_event"), name="data"):
            fields = scope.event_fields
            if fields is None:
                return None
            return Literal(any(name != SEND_ID for name in fields), BOOL, span)
        case MemberNode(base=NameNode(name="_event"), name="name" | "type"):
            return Literal(True, BOOL, span)
        case MemberNode(base=NameNode(name="_event"), name="sendid") if _has_send_id(scope):
            return truth(EventField(SEND_ID, SYMBOL, span))
        case MemberNode(base=NameNode(name="_event"), name=name):
            facts = scope.event_facts
            return Literal(facts[name] is not None, BOOL, span) if name in facts else None
        case MemberNode(base=MemberNode(base=NameNode(name="_event"), name="data"), name=name):
            fields = scope.event_fields
            return None if fields is None else Literal(name in fields, BOOL, span)
        case _:
            return None


def _has_send_id(scope: Scope) -> bool:
    return SEND_ID in (scope.event_fields or ())


def _not(expr: Expr) -> Expr:
    if isinstance(expr, Literal):
        return Literal(not expr.value, BOOL, expr.span)
    return Unary(UnaryOp.NOT, expr, BOOL, expr.span)


def join(left: Expr, right: Expr, span: Span) -> Expr | None:
    """Return two strings that are known, or one and a whole number, as one string."""
    parts = fold(left), fold(right)
    if SYMBOL not in (left.type, right.type):
        return None
    texts = [
        str(part.value)
        for part in parts
        if isinstance(part, Literal) and isinstance(part.type, SymbolType | IntType)
    ]
    return Literal("".join(texts), SYMBOL, span) if len(texts) == len(parts) else None


def event_as_value(context: Context, span: Span) -> Expr:
    """Return ``_event`` as something to keep and compare: its name, which is told."""
    context.report(
        "event-as-name",
        "`_event` as a value is the name of the event",
        span,
        "compare `_event.name`, or keep the fields that are needed",
    )
    return EventName(span)


def bind_relation(binder: Binder, node: BinaryNode) -> Expr | None:
    """Type ``'name' in _event`` and ``x instanceof Array``; None where it is neither."""
    span = binder.span(node)
    match node:
        case BinaryNode(op="in", left=StringNode(value=name), right=NameNode(name="_event")):
            return Literal(name in EVENT_FIELDS, BOOL, span)
        case BinaryNode(op="instanceof", right=NameNode(name="Array")):
            left = binder.value(node.left)
            return None if left is None else Literal(isinstance(left.type, ArrayType), BOOL, span)
        case _:
            return None


def bind_system(binder: Binder, node: Node) -> Expr | None:
    """Type a system variable or a part of one; None where it is none, or not known here."""
    scope, span = binder.context.scope, binder.span(node)
    session = scope.constants.get(SESSION)
    if session is None:
        return None
    here = location_of_session(str(session.value))
    match node:
        case NameNode(name="_ioprocessors"):
            return Literal("_ioprocessors", SYMBOL, span)
        case MemberNode(
            base=ElementNode(base=NameNode(name="_ioprocessors"), index=StringNode(value=name))
            | MemberNode(base=NameNode(name="_ioprocessors"), name=name),
            name="location",
        ) if name in PROCESSORS:
            return Literal(here, SYMBOL, span)
        case MemberNode(base=NameNode(name="_event"), name="sendid") if _has_send_id(scope):
            return EventField(SEND_ID, SYMBOL, span)
        case MemberNode(base=NameNode(name="_event"), name=name):
            fact = scope.event_facts.get(name)
            if fact is None and name == "type":
                return EventType(span)
            return None if fact is None else Literal(fact, SYMBOL, span)
        case _:
            return None
