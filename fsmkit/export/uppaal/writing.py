"""Write a network as XML, with elements in the order of UPPAAL's parser (UTAP, templ())."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lxml import etree

from fsmkit.emit import notating
from fsmkit.emit.lines import one_line
from fsmkit.emit.xml import characters
from fsmkit.export.uppaal.layout import labels
from fsmkit.export.uppaal.network import (
    Declarations,
    Declared,
    Edge,
    Function,
    Label,
    Location,
    Network,
    Point,
    Query,
    Sort,
    Template,
)

DOCTYPE = (
    "<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.6//EN' "
    "'http://www.it.uu.se/research/group/darts/uppaal/flat-1_6.dtd'>"
)

WRITTEN = (Label.SELECT, Label.GUARD, Label.SYNC, Label.UPDATE, Label.COMMENT)


@notating
def write(network: Network) -> str:
    """Return the content of a file."""
    root = etree.Element("nta")
    lines = [
        *(f"// {one_line(line)}".rstrip() for line in network.remark),
        *_declared(network.declarations),
    ]
    etree.SubElement(root, "declaration").text = "\n".join(lines)
    for template in network.templates:
        _template(root, template)
    instances = [f"{t.instance} = {t.name}();" for t in network.templates]
    names = ", ".join(t.instance for t in network.templates)
    etree.SubElement(root, "system").text = "\n".join([*instances, f"system {names};"])
    if network.queries:
        _queries(root, network.queries)
    etree.indent(root, "\t")
    text = etree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{DOCTYPE}\n{text}\n'


def _queries(root: etree._Element, queries: Sequence[Query]) -> None:
    """Write the queries; UPPAAL's parser accepts neither an empty list nor an empty text."""
    found = etree.SubElement(root, "queries")
    for query in queries:
        one = etree.SubElement(found, "query")
        etree.SubElement(one, "formula").text = query.formula or None
        etree.SubElement(one, "comment").text = characters(query.comment) or None


def _template(root: etree._Element, template: Template) -> None:
    found = etree.SubElement(root, "template")
    etree.SubElement(found, "name").text = template.name
    if template.declarations:
        etree.SubElement(found, "declaration").text = "\n".join(_declared(template.declarations))
    for location in template.locations:
        _location(found, location)
    etree.SubElement(found, "init", ref=template.initial)
    for edge in template.edges:
        _edge(found, edge)


def _location(template: etree._Element, location: Location) -> None:
    found = _put(template, "location", location.at, id=location.id)
    _color(found, location.color)
    if location.name:
        _put(found, "name", location.name_at).text = location.name
    _label(found, "invariant", " && ".join(location.invariant), location.invariant_at)
    if location.urgent:
        etree.SubElement(found, "urgent")
    if location.committed:
        etree.SubElement(found, "committed")


def _edge(template: etree._Element, edge: Edge) -> None:
    found = etree.SubElement(template, "transition")
    etree.SubElement(found, "source", ref=edge.source)
    etree.SubElement(found, "target", ref=edge.target)
    _color(found, edge.color)
    places, texts = dict(edge.labels_at), labels(edge)
    for kind in WRITTEN:
        _label(found, kind.value, texts.get(kind, ""), places.get(kind))
    for nail in edge.nails:
        _put(found, "nail", nail)


def _color(element: etree._Element, color: str) -> None:
    if color:
        element.set("color", color)


def _label(parent: etree._Element, kind: str, text: str, at: Point | None) -> None:
    if text:
        _put(parent, "label", at, kind=kind).text = characters(text)


def _put(parent: etree._Element, tag: str, at: Point | None, **attributes: str) -> etree._Element:
    found = etree.SubElement(parent, tag, attributes)
    if at is not None:
        found.set("x", str(at[0]))
        found.set("y", str(at[1]))
    return found


def _declared(declarations: Declarations) -> Iterator[str]:
    for one in declarations:
        yield one.text if isinstance(one, Function) else declaration(one)


def declaration(one: Declared) -> str:
    """Return the line that declares a name."""
    kind = one.sort.value
    if one.sort is Sort.INT:
        kind += f"[{one.lo},{one.hi}]"
    array = f"[{one.length}]" if one.length else ""
    text = f"{'const ' if one.constant else ''}{kind} {one.name}{array}"
    if one.init:
        values = [_value(one, value) for value in one.init]
        text += f" = {{{', '.join(values)}}}" if one.length else f" = {values[0]}"
    return f"{text};" + (f"  // {one_line(one.comment)}" if one.comment else "")


def _value(one: Declared, value: int) -> str:
    return ("true" if value else "false") if one.sort is Sort.BOOL else str(value)
