"""Expressions that only ECMAScript has, decided at compile time where possible.

These are system variables (SCXML 5.10), tests whether a name is defined, and the truth of values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fsmkit.language import syntax, tree, types
from fsmkit.language.arithmetic import exact
from fsmkit.language.folding import fold

if TYPE_CHECKING:
    from fsmkit.diagnostics import Span
    from fsmkit.language.binding.binder import Binder
    from fsmkit.language.names import Context
    from fsmkit.language.scope import Scope

EVENT_FIELDS = ("name", "type", "sendid", "origin", "origintype", "invokeid", "data")
"""The properties of every ``_event`` (SCXML 5.10.1)."""
WHOLE_PAYLOAD = "data"
"""The field that holds a payload of one value, as ``content`` sends it (SCXML 5.6)."""
SEND_ID = "_sendid"
"""The field that holds the id of a sent event, in a chart that reads ``_event.sendid``."""
PROCESSOR = "http://www.w3.org/TR/scxml/#SCXMLEventProcessor"
PROCESSORS = ("scxml", PROCESSOR)
SESSION = "_sessionid"
NOTHING = ("undefined", "null")


def flag_of(name: str) -> str:
    """Return the name of the variable that records whether `name` has a value."""
    return f"bound_{name}"


def location_of_session(session: str) -> str:
    """Return the target through which a session sends to itself (SCXML C.1)."""
    return f"#_scxml_{session}"


def truth(expr: tree.Expr) -> tree.Expr:
    """Return the truth value of an expression, or `expr` itself if it is not decided."""
    match expr.type:
        case types.IntType():
            zero = tree.Literal(0, exact(0, 0), expr.span)
            return tree.Binary(tree.BinaryOp.NE, expr, zero, types.BOOL, expr.span)
        case types.FloatType() if isinstance(
            expr, tree.Variable | tree.EventField | tree.Member | tree.Element | tree.Literal
        ):
            zero = tree.Literal(0.0, types.FLOAT64, expr.span)
            less = tree.Binary(tree.BinaryOp.LT, expr, zero, types.BOOL, expr.span)
            greater = tree.Binary(tree.BinaryOp.GT, expr, zero, types.BOOL, expr.span)
            return tree.Binary(tree.BinaryOp.OR, less, greater, types.BOOL, expr.span)
        case types.SymbolType():
            return tree.Binary(
                tree.BinaryOp.NE,
                expr,
                tree.Literal("", types.SYMBOL, expr.span),
                types.BOOL,
                expr.span,
            )
        case types.ArrayType() | types.RecordType() if isinstance(
            expr, tree.Variable | tree.EventField | tree.Member
        ):
            return tree.Literal(True, types.BOOL, expr.span)
        case _:
            return expr


def bind_truth(
    binder: Binder, node: syntax.Node, hint: types.Type | None = None
) -> tree.Expr | None:
    """Type an operand of which only the truth counts. A payload of several fields is an object."""
    match node:
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data") if (
            binder.context.is_ecmascript
            and WHOLE_PAYLOAD not in (binder.context.scope.event_fields or {})
        ):
            known = _is_defined(binder, node, binder.span(node))
            return binder.value(node, hint) if known is None else known
        case _:
            return binder.value(node, hint)


def bind_comparison(binder: Binder, node: syntax.BinaryNode) -> tree.Expr | None:
    """Type ``typeof x == '...'`` and ``x == undefined``; return None for other comparisons."""
    for asked, answer in ((node.left, node.right), (node.right, node.left)):
        found: tree.Expr | None = None
        match asked, answer:
            case syntax.UnaryNode(op="typeof", operand=operand), syntax.StringNode(value=kind):
                found = _is_of_kind(binder, operand, kind, binder.span(node))
            case _, syntax.NameNode(name="undefined" | "null"):
                found = _is_defined(binder, asked, binder.span(node))
                found = None if found is None else _not(found)
            case _:
                pass
        if found is not None:
            return _not(found) if node.op == tree.BinaryOp.NE.value else found
    return None


def _is_of_kind(binder: Binder, node: syntax.Node, kind: str, span: Span) -> tree.Expr | None:
    if isinstance(node, syntax.NameNode) and node.name in ("_event", "_ioprocessors"):
        return tree.Literal(kind == "object", types.BOOL, span)
    if isinstance(node, syntax.NameNode) and not _is_known(binder, node.name):
        return tree.Literal(kind == "undefined", types.BOOL, span)
    defined = _is_defined(binder, node, span)
    if kind == "undefined":
        return None if defined is None else _not(defined)
    value = binder.value(node)
    if value is None or value.type is None:
        return None
    if kind != _kind(value.type):
        return tree.Literal(False, types.BOOL, span)
    return defined or tree.Literal(True, types.BOOL, span)


def _is_known(binder: Binder, name: str) -> bool:
    scope = binder.context.scope
    known = name in scope.variables or name in scope.constants or flag_of(name) in scope.variables
    return known or name in ("_event", "_ioprocessors")


def _kind(type_: types.Type) -> str:
    """Return the ``typeof`` string for the values of a type."""
    match type_:
        case types.BoolType():
            return "boolean"
        case types.SymbolType():
            return "string"
        case types.ArrayType() | types.RecordType():
            return "object"
        case _:
            return "number"


def _is_defined(binder: Binder, node: syntax.Node, span: Span) -> tree.Expr | None:
    """Return whether a node has a value; None if that is not known at compile time."""
    scope = binder.context.scope
    match node:
        case syntax.NameNode(name=name) if flag_of(name) in scope.variables:
            type_, storage = scope.variables[flag_of(name)]
            return tree.Variable(flag_of(name), type_, storage, span)
        case syntax.NameNode(name=name) if _is_known(binder, name):
            return tree.Literal(True, types.BOOL, span)
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"):
            fields = scope.event_fields
            if fields is None:
                return None
            return tree.Literal(any(name != SEND_ID for name in fields), types.BOOL, span)
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="name" | "type"):
            return tree.Literal(True, types.BOOL, span)
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="sendid") if _has_send_id(
            scope
        ):
            return truth(tree.EventField(SEND_ID, types.SYMBOL, span))
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name=name):
            facts = scope.event_facts
            return (
                tree.Literal(facts[name] is not None, types.BOOL, span) if name in facts else None
            )
        case syntax.MemberNode(
            base=syntax.MemberNode(base=syntax.NameNode(name="_event"), name="data"), name=name
        ):
            fields = scope.event_fields
            return None if fields is None else tree.Literal(name in fields, types.BOOL, span)
        case _:
            return None


def _has_send_id(scope: Scope) -> bool:
    return SEND_ID in (scope.event_fields or ())


def _not(expr: tree.Expr) -> tree.Expr:
    if isinstance(expr, tree.Literal):
        return tree.Literal(not expr.value, types.BOOL, expr.span)
    return tree.Unary(tree.UnaryOp.NOT, expr, types.BOOL, expr.span)


def join(left: tree.Expr, right: tree.Expr, span: Span) -> tree.Expr | None:
    """Return the concatenation of two constant strings, or of a string and a constant integer."""
    parts = fold(left), fold(right)
    if types.SYMBOL not in (left.type, right.type):
        return None
    texts = [
        str(part.value)
        for part in parts
        if isinstance(part, tree.Literal)
        and isinstance(part.type, types.SymbolType | types.IntType)
    ]
    return tree.Literal("".join(texts), types.SYMBOL, span) if len(texts) == len(parts) else None


def event_as_value(context: Context, span: Span) -> tree.Expr:
    """Return ``_event`` as a value: the name of the event, with a finding."""
    context.report(
        "event-as-name",
        "`_event` as a value is the name of the event",
        span,
        "compare `_event.name`, or keep the fields that are needed",
    )
    return tree.EventName(span)


def bind_relation(binder: Binder, node: syntax.BinaryNode) -> tree.Expr | None:
    """Type ``'name' in _event`` and ``x instanceof Array``; return None for other relations."""
    span = binder.span(node)
    match node:
        case syntax.BinaryNode(
            op="in", left=syntax.StringNode(value=name), right=syntax.NameNode(name="_event")
        ):
            return tree.Literal(name in EVENT_FIELDS, types.BOOL, span)
        case syntax.BinaryNode(op="instanceof", right=syntax.NameNode(name="Array")):
            left = binder.value(node.left)
            return (
                None
                if left is None
                else tree.Literal(isinstance(left.type, types.ArrayType), types.BOOL, span)
            )
        case _:
            return None


def bind_system(binder: Binder, node: syntax.Node) -> tree.Expr | None:
    """Type a system variable or a part of one; return None for other nodes or unknown values."""
    scope, span = binder.context.scope, binder.span(node)
    session = scope.constants.get(SESSION)
    if session is None:
        return None
    here = location_of_session(str(session.value))
    match node:
        case syntax.NameNode(name="_ioprocessors"):
            return tree.Literal("_ioprocessors", types.SYMBOL, span)
        case syntax.MemberNode(
            base=syntax.ElementNode(
                base=syntax.NameNode(name="_ioprocessors"), index=syntax.StringNode(value=name)
            )
            | syntax.MemberNode(base=syntax.NameNode(name="_ioprocessors"), name=name),
            name="location",
        ) if name in PROCESSORS:
            return tree.Literal(here, types.SYMBOL, span)
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name="sendid") if _has_send_id(
            scope
        ):
            return tree.EventField(SEND_ID, types.SYMBOL, span)
        case syntax.MemberNode(base=syntax.NameNode(name="_event"), name=name):
            fact = scope.event_facts.get(name)
            if fact is None and name == "type":
                return tree.EventType(span)
            return None if fact is None else tree.Literal(fact, types.SYMBOL, span)
        case _:
            return None
