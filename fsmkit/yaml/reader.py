"""Reading of the YAML nodes of a chart and its declarations into a Document."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from fsmkit.diagnostics import Edit, Findings, Fix, Source, Span, Text
from fsmkit.document import document as doc
from fsmkit.document import keys
from fsmkit.language.statements.reading import read_body, read_signature
from fsmkit.language.statements.tree import DocField, DocSignature
from fsmkit.yaml import nodes
from fsmkit.yaml.fields import Fields, names
from fsmkit.yaml.properties import read_environment, read_properties
from fsmkit.yaml.states import StateReader
from fsmkit.yaml.transitions import read_initial


def read_document(source: Source, findings: Findings) -> doc.Document | None:
    """Return the document of a YAML text, or None where an error was found."""
    root = nodes.read_nodes(source, findings)
    return None if root is None else document_of(root, findings)


def document_of(root: nodes.Node, findings: Findings) -> doc.Document | None:
    """Return the document of the outermost node, or None where an error was found."""
    mapping = nodes.require_mapping(root, "a chart", findings)
    if mapping is None:
        return None
    if any(key.value == "system" for key, _ in mapping.entries):
        findings.add(
            "not-a-chart",
            f"`{root.span.source.name}` describes a system, not a chart",
            mapping.entries[0][0],
            help="name one of the charts listed under `machines`",
        )
        return None
    document = read_chart(mapping, findings)
    return None if findings.has_errors else document


def read_chart(mapping: nodes.Mapping, findings: Findings) -> doc.Document:
    """Return the document of a chart's mapping, as far as it can be read."""
    fields = Fields(mapping, keys.CHART, "a chart", findings)
    reader = StateReader(findings, lambda inner: read_chart(inner, findings))
    source = mapping.span.source
    root = doc.DocState(
        id=None,
        kind=doc.Kind.COMPOUND,
        span=mapping.span,
        initial=read_initial(fields, "initial", findings),
        children=reader.states(fields, "states"),
    )
    return doc.Document(
        source=source,
        name=_name(fields, source, findings),
        root=root,
        types=tuple(_types(fields, findings)),
        functions=tuple(_functions(fields, findings)),
        constants=tuple(doc.DocConstant(*pair) for pair in fields.text_entries("constants")),
        operations=tuple(_operations(fields, findings)),
        events=tuple(_events(fields, findings)),
        capacities=_capacities(fields, findings),
        entries=tuple(
            doc.DocEntry(name, names(node, f"`{name}`", findings))
            for name, node in fields.entries("entries")
        ),
        properties=tuple(read_properties(fields, findings)),
        environment=read_environment(fields, findings),
        refine=reader.states(fields, "refine"),
        **fields.read(),
    )


def _name(fields: Fields, source: Source, findings: Findings) -> Text:
    name = fields.text("chart")
    if name is not None and name.value:
        return name
    stem = PurePath(source.name).stem
    if name is not None or "chart" not in fields:
        findings.add(
            "missing-key",
            "a chart needs a name",
            name or Span(source, fields.span.start, fields.span.start + 1),
            help=f"start with `chart: {stem.capitalize()}`",
            fixes=_named(source, fields, stem.capitalize()),
        )
    return Text(stem, Span(source, 0, 0))


def _named(source: Source, fields: Fields, name: str) -> tuple[Fix, ...]:
    """Return the fix that names a chart."""
    if not name.isidentifier() or "chart" in fields or source.text[:1] in "{[":
        return ()
    start = fields.span.start
    edit = Edit(Span(source, start, start), f"chart: {name}\n")
    return (Fix(f"Name the chart `{name}`", (edit,), is_sure=True),)


def _types(fields: Fields, findings: Findings) -> Iterator[doc.DocType]:
    for name, node in fields.entries("types"):
        if isinstance(node, nodes.Sequence) and node.items:
            texts = (nodes.require_text(item, "a member", findings) for item in node.items)
            members = tuple(doc.read_member(text) for text in texts if text is not None)
            yield doc.DocType(name, members=members)
        elif isinstance(node, nodes.Mapping) and node.entries:
            yield doc.DocType(name, fields=tuple(_record(node, findings)))
        elif isinstance(node, nodes.Scalar) and node.text.value.strip():
            yield doc.DocType(name, same=node.text.strip())
        else:
            findings.add(
                "unexpected-shape",
                f"the type `{name}` is neither an enumeration nor a record nor a range",
                node.span,
                help="list the members `[a, b]`, give the fields `{x: 0..9}`, or write `0..100`",
            )


def _record(mapping: nodes.Mapping, findings: Findings) -> Iterator[DocField]:
    for key, node in mapping.entries:
        text = nodes.require_text(node, f"the type of `{key}`", findings)
        if text is not None:
            yield DocField(key.strip(), text)


def _functions(fields: Fields, findings: Findings) -> Iterator[doc.DocFunction]:
    datamodel = fields.text("datamodel")
    is_loose = datamodel is not None and datamodel.value == "ecmascript"
    for name, node in fields.entries("functions"):
        signature = read_signature(name, findings, is_loose=is_loose)
        text = nodes.require_text(node, f"the body of `{name}`", findings)
        if signature is not None and text is not None:
            body = read_body(text, findings)
            yield doc.DocFunction(signature.name, signature.fields, signature.result, body)


def _signatures(fields: Fields, key: str, findings: Findings) -> Iterator[DocSignature]:
    for text in fields.texts(key):
        signature = read_signature(text, findings)
        if signature is not None:
            yield signature


def _operations(fields: Fields, findings: Findings) -> Iterator[doc.DocOperation]:
    """Yield the operations: a signature, or a signature with its keys."""
    for item in nodes.items_of(fields.node("operations"), "`operations`", findings):
        given: dict[str, Any] = {}
        text: Text | None
        match item:
            case nodes.Mapping(((text, nodes.Mapping() as parts),)):
                given = Fields(parts, keys.OPERATION, "an operation", findings).read()
            case _:
                text = nodes.require_text(item, "an entry of `operations`", findings)
        signature = None if text is None else read_signature(text, findings)
        if signature is not None:
            yield doc.DocOperation(signature.name, signature.fields, signature.result, **given)


def _events(fields: Fields, findings: Findings) -> Iterator[doc.DocEvent]:
    """Read the events by direction; a list of such mappings keeps any order."""
    node = fields.node("events")
    is_list = isinstance(node, nodes.Sequence) and not any(
        isinstance(i, nodes.Scalar) for i in node.items
    )
    for item in node.items if is_list and isinstance(node, nodes.Sequence) else (node,):
        inner = _inner(item, "events", keys.EVENTS, findings)
        for key in () if inner is None else inner.order:
            if inner is not None and key in keys.EVENTS:
                for one in _signatures(inner, key, findings):
                    yield doc.DocEvent(one.name, one.fields, doc.Direction(key), one.result)


def _capacities(fields: Fields, findings: Findings) -> tuple[doc.DocCapacity, ...]:
    _inner(fields.node("capacity"), "capacity", keys.CAPACITY, findings)
    return tuple(doc.DocCapacity(*pair) for pair in fields.text_entries("capacity"))


def _inner(
    node: nodes.Node | None, key: str, known: keys.Keys, findings: Findings
) -> Fields | None:
    if node is None or (mapping := nodes.require_mapping(node, f"`{key}`", findings)) is None:
        return None
    return Fields(mapping, known, f"`{key}`", findings)
