"""Edits that add a declaration to a chart, in either notation."""

from __future__ import annotations

import re

from fsmkit.diagnostics import Edit, Source, Span
from fsmkit.diagnostics.fixes import add_nested_items, is_xml
from fsmkit.scxml.names import EXTENSION
from fsmkit.yaml.layout import quoted

FIRST = re.compile(r"^(?:initial|refine|states)[ \t]*:", re.MULTILINE)
ROOT = re.compile(r"<(?:\w+:)?scxml\b(?:[^>\"']|\"[^\"]*\"|'[^']*')*>")
SPECIAL = re.compile(r"[,\[\]{}#&*!|>'\"%@`]|: ")
ESCAPED = {"&": "&amp;", "<": "&lt;", '"': "&quot;"}


def escape_xml(text: str) -> str:
    """Escape a string for an attribute or an element."""
    return "".join(ESCAPED.get(char, char) for char in text)


def declaration(source: Source, section: str, name: str, value: str) -> tuple[Edit, ...]:
    """Return the edit that declares a name; empty if the chart has no suitable location.

    Args:
        source: The source of the chart.
        section: ``constants``, ``data``, ``inputs``, ``functions``, ``operations``, ``in`` or
            ``internal``.
        name: The name; for functions, operations and events the signature.
        value: The value, the type with the initial value, or the body; may be empty.

    """
    if is_xml(source):
        return _in_xml(source, section, name, value)
    if section in ("in", "internal"):
        return add_nested_items(source, "events", section, [_plain(name)])
    written = _plain(name) if not value else f"{_plain(name)}: {_plain(value)}"
    found = re.search(rf"^{section}:[ \t]*([^\n]*)", source.text, re.MULTILINE)
    if found is None:
        first = FIRST.search(source.text)
        at = len(source.text) if first is None else first.start()
        both = f"[{written}]" if not value else f"{{{written}}}"
        return (Edit(Span(source, at, at), f"{section}: {both}\n"),)
    if found[1].startswith(("{", "[")):
        at = found.start(1) + 1
        is_empty = source.text[at : at + 1] in "]}"
        return (Edit(Span(source, at, at), written if is_empty else f"{written}, "),)
    below = re.compile(r"\n(?:[ \t]*(?:#[^\n]*)?\n)*([ \t]+)(?=\S)").match(source.text, found.end())
    indent = "  " if below is None else below[1]
    dash = "" if value else "- "
    return (Edit(Span(source, found.end(), found.end()), f"\n{indent}{dash}{written}"),)


def _plain(text: str) -> str:
    return quoted(text) if SPECIAL.search(text) else text


def _in_xml(source: Source, section: str, name: str, value: str) -> tuple[Edit, ...]:
    text = source.text
    root = ROOT.search(text)
    prefix = re.search(rf'xmlns:(\w+)\s*=\s*"{EXTENSION}"', text)
    if root is None or prefix is None:
        return ()
    p, name = prefix[1], escape_xml(name)
    type_, _, start = (part.strip() for part in value.partition("="))
    initial = f' expr="{escape_xml(start)}"' if start else ""
    elements = {
        "constants": f'<{p}:constant name="{name}" expr="{escape_xml(value)}"/>',
        "data": f'<data id="{name}" {p}:type="{escape_xml(type_)}"{initial}/>',
        "inputs": f'<{p}:input id="{name}" type="{escape_xml(type_)}"/>',
        "functions": f'<{p}:function signature="{name}">{escape_xml(value)}</{p}:function>',
        "operations": f'<{p}:operation signature="{name}"/>',
        "in": f'<{p}:event direction="in" signature="{name}"/>',
        "internal": f'<{p}:event direction="internal" signature="{name}"/>',
    }
    element = elements[section]
    word = re.match(r"<([\w:]+)", element)
    like = list(re.finditer(rf"^([ \t]*)<{word[1] if word else ''}\b[^\n]*\n", text, re.MULTILINE))
    if like:
        at, indent = like[-1].end(), like[-1][1]
        return (Edit(Span(source, at, at), f"{indent}{element}\n"),)
    if section == "data":
        element = f"<datamodel>{element}</datamodel>"
    return (Edit(Span(source, root.end(), root.end()), f"\n  {element}"),)
