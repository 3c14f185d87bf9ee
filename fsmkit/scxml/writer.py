"""Writing of a Document as SCXML that reads back as an equal Document."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from lxml import etree

from fsmkit.diagnostics import Text
from fsmkit.document import keys
from fsmkit.document.document import (
    DocData,
    DocEntry,
    DocInvoke,
    DocMember,
    DocState,
    DocTransition,
    Document,
    DocUse,
    Kind,
    Trigger,
)
from fsmkit.document.keys import Form, Key, Keys
from fsmkit.language.statements.tree import DocField
from fsmkit.language.statements.writing import write_body
from fsmkit.scxml.markup import add, extension, joined, ours, put
from fsmkit.scxml.names import EXTENSION, PREFIX, SCXML
from fsmkit.scxml.properties import add_environment, add_properties
from fsmkit.scxml.writing_content import add_content, add_params, add_script, add_statements

TAGS = {
    Kind.PARALLEL: "parallel",
    Kind.FINAL: "final",
    Kind.SHALLOW_HISTORY: "history",
    Kind.DEEP_HISTORY: "history",
}


def write_document(document: Document) -> str:
    """Return the text of a document; comments and the layout of the source are not kept."""
    namespaces: Any = {None: SCXML, PREFIX: EXTENSION}  # published types omit None
    root = etree.Element(f"{{{SCXML}}}scxml", nsmap=namespaces)
    _add_chart(root, document)
    etree.indent(root, "  ")
    etree.cleanup_namespaces(root)
    text = etree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _add_chart(root: etree._Element, document: Document) -> None:
    put(root, "version", "1.0")
    put(root, "name", document.name)
    put(root, "datamodel", document.datamodel)
    _put_keys(root, document, keys.CHART)
    _add_doc(root, document.doc)
    add_declarations(root, document)
    add_entries(root, document.entries)
    add_properties(root, document.properties)
    if document.environment is not None:
        add_environment(root, document.environment)
    if document.script:
        add_script(root, document.script)
    _add_initial(root, document.root.initial)
    for state in document.root.children:
        add_state(root, state)
    for state in document.refine:
        element = add(root, extension("refine"))
        put(element, "state", state.id)
        _fill_state(element, state, Kind.COMPOUND if state.children else Kind.ATOMIC)


def _add_doc(parent: etree._Element, doc: str) -> None:
    if doc:
        add(parent, extension("doc"), doc)


# --- keys -------------------------------------------------------------------------------------


def _put_keys(element: etree._Element, part: object, rows: Keys) -> None:
    """Write the keys of a part as attributes, those of SCXML first."""
    given = [row for row in rows.values() if row.form in ATTRIBUTE and row.is_given(part)]
    for row in sorted(given, key=lambda row: (row.scxml or "").startswith(f"{PREFIX}:")):
        if row.scxml is not None:
            name = row.scxml.removeprefix(f"{PREFIX}:")
            qualified = name if name == row.scxml else ours(element, name)
            put(element, qualified, ATTRIBUTE[row.form](getattr(part, row.field), row))


ATTRIBUTE: Mapping[Form, Callable[[Any, Key], Text | str | None]] = {
    Form.TEXT: lambda value, _: value,
    Form.NAME: lambda value, _: value,
    Form.FLAG: lambda _, __: "true",
    Form.CHOICE: lambda value, row: row.word(value),
    Form.MARKS: lambda value, _: " ".join(sorted(value)),
    Form.NAMES: lambda value, _: joined(value),
    Form.TARGETS: lambda value, _: joined(value),
    Form.IDS: lambda value, _: joined(value),
}
"""The writers of forms as attributes."""


def _add_keys(element: etree._Element, part: object, *rows: Key) -> None:
    """Write the keys of a part as elements."""
    for row in rows:
        if not row.is_given(part) or row.scxml is None:
            continue
        word = row.scxml.strip("<>")
        local = word.removeprefix(f"{PREFIX}:")
        name = word if word == local else extension(local)
        match row.form, getattr(part, row.field):
            case Form.DATA, variables if word == "datamodel":
                add_variables(add(element, name), "data", extension("type"), variables)
            case Form.DATA, variables:
                add_variables(element, name, "type", variables)
            case Form.HANDLERS, blocks:
                for block in blocks:
                    add_statements(add(element, name), block)
            case _, block:
                add_statements(add(element, name), block)


def add_variables(
    parent: etree._Element, name: str, type_name: str, variables: Iterable[DocData]
) -> None:
    """Write variables as elements of a name, with the type in the attribute ``type_name``."""
    for variable in variables:
        element = add(parent, name)
        put(element, "id", variable.name)
        put(element, type_name, variable.type)
        put(element, "expr", variable.init)


# --- declarations -----------------------------------------------------------------------------


def add_entries(root: etree._Element, entries: Iterable[DocEntry]) -> None:
    """Write entry points."""
    for entry in entries:
        element = add(root, extension("entry"))
        put(element, "name", entry.name)
        put(element, "target", joined(entry.targets))


def add_declarations(root: etree._Element, document: Document) -> None:
    """Write the declarations of a chart, except its entry points and properties."""
    for type_ in document.types:
        element = add(root, extension("type"))
        put(element, "name", type_.name)
        put(element, "members", joined(map(_member, type_.members)))
        put(element, "is", type_.same)
        for field in type_.fields:
            part = add(element, extension("field"))
            put(part, "name", field.name)
            put(part, "type", field.type)
    for constant in document.constants:
        element = add(root, extension("constant"))
        put(element, "name", constant.name)
        put(element, "expr", constant.value)
    _add_keys(root, document, keys.CHART["inputs"], keys.CHART["outputs"])
    for operation in document.operations:
        parts = _parameters(operation.parameters, "()")
        signature = operation.name.value + parts + _result(operation.result)
        element = add(root, extension("operation"))
        put(element, "signature", signature)
        _put_keys(element, operation, keys.OPERATION)
    for function in document.functions:
        parts = _parameters(function.parameters, "()")
        signature = function.name.value + parts + _result(function.result)
        element = add(root, extension("function"), write_body(function.body))
        put(element, "signature", signature)
    for event in document.events:
        element = add(root, extension("event"))
        put(element, "direction", event.direction.value)
        signature = event.name.value + _parameters(event.fields, "") + _result(event.reply)
        put(element, "signature", signature)
    for capacity in document.capacities:
        put(add(root, extension("capacity")), capacity.name.value, capacity.value)
    _add_keys(root, document, keys.CHART["data"])


def _member(member: DocMember) -> Text:
    """Return a member as one word."""
    if member.number is None:
        return member.name
    return Text(f"{member.name}={member.number}", member.name.span)


def _parameters(fields: Iterable[DocField], otherwise: str) -> str:
    parts = (f"{f.name}" if f.type is None else f"{f.name} {f.type}" for f in fields)
    inside = ", ".join(parts)
    return f"({inside})" if inside else otherwise


def _result(type_: Text | None) -> str:
    return "" if type_ is None else f" -> {type_}"


# --- states -----------------------------------------------------------------------------------


def add_state(parent: etree._Element, state: DocState) -> None:
    """Write a state with all inside it."""
    name = TAGS.get(state.kind, "state")
    element = add(parent, name)
    put(element, "id", state.id)
    usual = state.kind
    if name == "state":
        usual = Kind.COMPOUND if state.children else Kind.ATOMIC
    if name == "history":
        put(element, "type", "deep" if state.kind is Kind.DEEP_HISTORY else "shallow")
    _fill_state(element, state, usual)


def _fill_state(element: etree._Element, state: DocState, usual: Kind) -> None:
    """Write a state without its name; its kind only if the element does not imply it."""
    if state.kind is not usual:
        put(element, ours(element, "kind"), state.kind.value)
    put(element, ours(element, "for"), state.index_range)
    _put_keys(element, state, keys.STATE)
    _add_doc(element, state.doc)
    _add_keys(element, state, keys.STATE["data"])
    if etree.QName(element).localname == "history":
        if state.initial is not None:
            add_transition(element, state.initial)
    else:
        is_in_use = state.use is not None and _is_attribute(state.initial)
        if state.use is not None:
            _add_use(element, state.use, state.initial if is_in_use else None)
        _add_initial(element, None if is_in_use else state.initial)
    _add_keys(element, state, keys.STATE["entry"], keys.STATE["exit"])
    for transition in state.transitions:
        add_transition(element, transition)
    for invoke in state.invokes:
        _add_invoke(element, invoke)
    for child in state.children:
        add_state(element, child)
    if state.done_data or state.done_content is not None:
        done = add(element, "donedata")
        add_params(done, state.done_data)
        add_content(done, None, state.done_content)


def _add_initial(element: etree._Element, initial: DocTransition | None) -> None:
    """Write an attribute if it suffices, else an element (SCXML 3.6)."""
    if initial is None:
        return
    if _is_attribute(initial):
        put(element, "initial", joined(initial.targets))
    else:
        add_transition(add(element, "initial"), initial)


def _is_attribute(initial: DocTransition | None) -> bool:
    return initial is not None and bool(initial.targets) and initial.content is None


def _add_use(parent: etree._Element, use: DocUse, initial: DocTransition | None) -> None:
    """Write the chart that fills a state."""
    element = add(parent, extension("use"))
    _put_keys(element, use, keys.USE)
    _add_initial(element, initial)
    for word, field in keys.USED.items():
        for pair in getattr(use, field):
            one = add(element, extension(word))
            put(one, "name", pair.name)
            put(one, "to" if word == "bind" else "expr", pair.value)
    for exit_ in use.exits:
        for transition in exit_.transitions:
            one = add(element, extension("exit"))
            put(one, "name", exit_.name)
            _put_keys(one, transition, keys.EXIT)
            if transition.content:
                add_statements(one, transition.content)
            elif transition.content is not None:
                add(one, "script")


def add_transition(parent: etree._Element, transition: DocTransition) -> None:
    """Write a transition of a state, or the one of an initial state or a history."""
    element = add(parent, "transition")
    put(element, "event", joined(transition.events))
    marks: Mapping[str, str | Text | None] = {
        "after": transition.delay if transition.trigger is Trigger.AFTER else None,
        "every": transition.delay if transition.trigger is Trigger.EVERY else None,
        "sometimes": "true" if transition.trigger is Trigger.SOMETIMES else None,
    }
    for name, value in marks.items():
        put(element, extension(name), value)
    _put_keys(element, transition, keys.TRANSITION)
    if transition.content:
        add_statements(element, transition.content)
    elif transition.content is not None:
        add(element, "script")


def _add_invoke(parent: etree._Element, invoke: DocInvoke) -> None:
    element = add(parent, "invoke")
    _put_keys(element, invoke, keys.INVOKE)
    add_params(element, invoke.arguments)
    add_content(element, None, invoke.content_expr)
    if invoke.content is not None:
        _add_chart(add(add(element, "content"), "scxml"), invoke.content)
    _add_keys(element, invoke, keys.INVOKE["finalize"])
