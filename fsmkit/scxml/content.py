"""Reading of executable content into statements (SCXML 4, 5.4, 5.8, 6.2, 6.3).

Invalid content becomes `Fail`: executing it raises ``error.execution``, and elaboration reports it.
"""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.diagnostics import Findings, Severity, Text
from fsmkit.language.statements import tree as stmt
from fsmkit.language.statements.reading import read_statements
from fsmkit.scxml.context import Context, words
from fsmkit.scxml.names import CONTENT, EXTENSION_CONTENT, PREFIX, XML
from fsmkit.scxml.nodes import Element

KNOWN = (*CONTENT, *(f"{PREFIX}:{name}" for name in EXTENSION_CONTENT))


def read_block(element: Element, context: Context) -> stmt.Block:
    """Return the statements in an element."""
    return _statements(element.children, element, context)


def _statements(elements: Iterable[Element], parent: Element, context: Context) -> stmt.Block:
    found: list[stmt.WrittenStatement] = []
    for element in elements:
        word = context.word(element)
        if word in KNOWN:
            context.check(element, word)
            found += _statement(word, element, context)
        elif word:
            context.unknown_element(element, word, parent, KNOWN)
            reason = f"`<{word}>` is not executable content"
            found.append(stmt.Fail(reason, element.span))
        else:
            context.findings.add(
                "foreign-content",
                f"`<{element.name}>` of the namespace `{element.namespace}` is not executed",
                element.span,
                help="declare an operation, and call it here",
            )
    return tuple(found)


def _statement(word: str, element: Element, context: Context) -> stmt.Block:
    span = element.span
    match word:
        case "assign":
            return (_assign(element, context),)
        case "raise":
            event = context.given(element, "event")
            if event is None:
                return _lacks(element, "event", context)
            arguments = read_params(element, context)
            if isinstance(arguments, stmt.Fail):
                return (arguments,)
            return (stmt.Raise(event, arguments, span),)
        case "if":
            return (_if(element, context),)
        case "foreach":
            return _foreach(element, context)
        case "log":
            value = context.given(element, "expr")
            return (stmt.Log(element.get("label"), () if value is None else (value,), span),)
        case "script":
            return read_script(element, context)
        case "send":
            return _send(element, context)
        case "cancel":
            id_, id_expr = context.either(element, "sendid", "sendidexpr")
            if id_ is None and id_expr is None:
                return _lacks(element, "sendid", context)
            return (stmt.DocCancel(id_, id_expr, span),)
        case "fk:super":
            return (stmt.Super(span),)
        case "fk:unreadable":
            reason = element.get("reason")
            return (stmt.Fail("" if reason is None else reason.value, span),)
        case _:
            value = context.given(element, "expr")
            if value is None:
                return _lacks(element, "expr", context)
            kind = stmt.HANDLER_KEYWORDS.get(word.removeprefix(f"{PREFIX}:"), stmt.CallOperation)
            return (kind(value, span),)


def _lacks(element: Element, name: str, context: Context) -> stmt.Block:
    return (stmt.Fail(f"`<{context.word(element)}>` has no `{name}`", element.span),)


def _assign(element: Element, context: Context) -> stmt.WrittenStatement:
    location = context.given(element, "location")
    value = context.given(element, "expr")
    inline = context.inline(element)
    if value is not None and inline is not None:
        context.conflict(inline, "`expr` and content are both given; `expr` counts")
    value = value or inline
    if location is None:
        return stmt.Fail("`<assign>` has no `location`", element.span)
    if value is None:
        return stmt.Fail("`<assign>` has no `expr`", element.span)
    return stmt.Assign(location, value, element.span)


def _if(element: Element, context: Context) -> stmt.WrittenStatement:
    condition = context.given(element, "cond")
    if condition is None:
        return stmt.Fail("`<if>` has no `cond`", element.span)
    branches: list[stmt.Branch[Text, stmt.WrittenStatement]] = []
    part: list[Element] = []
    current: Text | None = condition
    for child in element.children:
        word = context.word(child)
        if word not in ("elseif", "else"):
            part.append(child)
            continue
        context.check(child, word)
        if current is None:
            return stmt.Fail(f"`<{word}>` follows `<else>`", child.span)
        branches.append(stmt.Branch(current, _statements(part, element, context)))
        part = []
        current = context.given(child, "cond") if word == "elseif" else None
        if current is None and word == "elseif":
            return stmt.Fail("`<elseif>` has no `cond`", child.span)
    branches.append(stmt.Branch(current, _statements(part, element, context)))
    return stmt.If(tuple(branches), element.span)


def _foreach(element: Element, context: Context) -> stmt.Block:
    array, item = context.given(element, "array"), context.given(element, "item")
    if array is None or item is None:
        return _lacks(element, "array" if array is None else "item", context)
    index = context.given(element, "index")
    return (stmt.ForEach(array, item, index, read_block(element, context), element.span),)


def read_script(element: Element, context: Context) -> stmt.Block:
    """Return the statements of a script (SCXML 5.8).

    A script whose file cannot be read makes the whole chart invalid.
    """
    text = script_text(element, context)
    return () if text is None else script_block(text, element, context)


def script_text(element: Element, context: Context) -> Text | None:
    """Return the text of a script, or of its file; None if that cannot be read."""
    src = context.given(element, "src")
    if src is None:
        return element.text
    loaded = context.load(src)
    if loaded is None:
        context.unloaded(src)
    return loaded


def script_block(text: Text, element: Element, context: Context) -> stmt.Block:
    """Return the statements in the text of a script."""
    if context.is_strict:
        return read_statements(text, context.findings)
    attempt = Findings()
    block = read_statements(text, attempt)
    error = next((d for d in attempt if d.severity is Severity.ERROR), None)
    if error is None:
        context.findings.extend(attempt)
        return block
    span = element.span if error.primary is None else error.primary.span
    return (stmt.Fail(error.message, span, advice=error.help or stmt.ADVICE),)


def _send(element: Element, context: Context) -> stmt.Block:
    event, event_expr = context.either(element, "event", "eventexpr")
    if event is None and event_expr is None:
        return _lacks(element, "event", context)
    found = {"event": event, "event_expr": event_expr}
    for name, computed in stmt.SENT[1:]:
        both = context.either(element, name, computed.replace("_", ""))
        found[name], found[computed] = both
    arguments = read_params(element, context)
    if isinstance(arguments, stmt.Fail):
        return (arguments,)
    found["content"], found["content_expr"] = read_content(element, context)
    listed = words(element.get("namelist"))
    return (stmt.DocSend(element.span, arguments=arguments, name_list=listed, **found),)


def read_params(
    element: Element, context: Context, others: tuple[str, ...] = ()
) -> tuple[stmt.DocArgument, ...] | stmt.Fail:
    """Return the params of an element (SCXML 5.7), or the reason why one is invalid.

    ``others`` names the children that the caller reads.
    """
    own = {"send": ("param", "content"), "raise": ("fk:param", "param")}
    found = []
    for word, child in context.children(element, own.get(element.name, ("param", *others))):
        if word not in ("param", "fk:param"):
            continue
        name = context.given(child, "name")
        value, location = context.either(child, "expr", "location")
        value = value or location
        if name is None or value is None:
            lack = "name" if name is None else "expr"
            return stmt.Fail(f"`<param>` has no `{lack}`", child.span)
        found.append(stmt.DocArgument(name, value))
    return tuple(found)


def read_content(element: Element, context: Context) -> tuple[Text | None, Text | None]:
    """Return the literal and the expression of ``content`` (SCXML 5.6)."""
    literal = expression = None
    for child in element.children:
        if context.word(child) != "content":
            continue
        value = context.given(child, "expr")
        if value is not None:
            expression = expression or value
        elif literal is None:
            literal = _literal(child)
    return literal, expression


def _literal(element: Element) -> Text:
    """Return literal content, with its elements as source text."""
    if element.children:
        inner = element.inner
        return Text(inner.source.text[inner.start : inner.end], inner).strip()
    keeps = element.get("space", XML)
    is_kept = keeps is not None and keeps.value == "preserve"
    return element.text if is_kept else element.text.strip()
