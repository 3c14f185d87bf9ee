"""Writing of statements as executable content (SCXML 4)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import assert_never

from lxml import etree

from fsmkit.diagnostics import Text
from fsmkit.document.statement_text import statements_text
from fsmkit.language.statements import tree as stmt
from fsmkit.scxml.markup import add, extension, joined, put
from fsmkit.scxml.names import XML


def add_statements(parent: etree._Element, block: stmt.Block) -> None:
    """Write statements into a handler."""
    for statement in block:
        _add_statement(parent, statement)


def add_script(parent: etree._Element, block: stmt.Block) -> None:
    """Write statements as the text of one ``script``."""
    add(parent, "script", statements_text(block))


def _add_statement(parent: etree._Element, statement: stmt.WrittenStatement) -> None:
    match statement:
        case stmt.Assign(location, value, operator=""):
            element = add(parent, "assign")
            put(element, "location", location)
            put(element, "expr", value)
        case stmt.Raise(event, arguments):
            element = add(parent, "raise")
            put(element, "event", event)
            add_params(element, arguments, extension("param"))
        case stmt.DocSend():
            _add_send(parent, statement)
        case stmt.DocCancel(id_, id_expr):
            element = add(parent, "cancel")
            put(element, "sendid", id_)
            put(element, "sendidexpr", id_expr)
        case stmt.Log(label, values) if len(values) < 2:
            element = add(parent, "log")
            put(element, "label", label)
            put(element, "expr", values[0] if values else None)
        case stmt.If():
            _add_if(parent, statement)
        case stmt.ForEach(array, item, index, body):
            element = add(parent, "foreach")
            put(element, "array", array)
            put(element, "item", item)
            put(element, "index", index)
            add_statements(element, body)
        case stmt.Return() | stmt.Local():
            add_script(parent, (statement,))
        case stmt.KeywordStatement(value):
            put(add(parent, extension(statement.word)), "expr", value)
        case stmt.Super():
            add(parent, extension("super"))
        case stmt.Fail(reason):
            put(add(parent, extension("unreadable")), "reason", reason)
        case stmt.Assign() | stmt.CallOperation() | stmt.Log():
            # other tools read these as ECMAScript, too
            add_script(parent, (statement,))
        case _:
            assert_never(statement)


def _add_if(parent: etree._Element, statement: stmt.If[Text, stmt.WrittenStatement]) -> None:
    element = add(parent, "if")
    for number, branch in enumerate(statement.branches):
        if number == 0:
            put(element, "cond", branch.condition)
        elif branch.condition is not None:
            put(add(element, "elseif"), "cond", branch.condition)
        else:
            add(element, "else")
        add_statements(element, branch.body)


def _add_send(parent: etree._Element, send: stmt.DocSend) -> None:
    element = add(parent, "send")
    for name in chain(*stmt.SENT):
        put(element, name.replace("_", ""), getattr(send, name))
    put(element, "namelist", joined(send.name_list))
    add_params(element, send.arguments)
    add_content(element, send.content, send.content_expr)


def add_params(
    element: etree._Element, arguments: Iterable[stmt.DocArgument], name: str = "param"
) -> None:
    """Write named values (SCXML 5.7)."""
    for argument in arguments:
        param = add(element, name)
        put(param, "name", argument.name)
        put(param, "expr", argument.value)


def add_content(element: etree._Element, literal: Text | None, expression: Text | None) -> None:
    """Write a payload without names (SCXML 5.6)."""
    if expression is not None:
        put(add(element, "content"), "expr", expression)
    if literal is not None:
        content = add(element, "content", literal)
        if literal.value != literal.value.strip():
            content.set(f"{{{XML}}}space", "preserve")
