"""From YAML nodes to a Document: the chart and its declarations."""

from __future__ import annotations

from pathlib import PurePath

from fsmkit.diagnostics import Findings, Source, Span, Text
from fsmkit.model.declaration_text import read_signature, read_typed
from fsmkit.model.document import (
    Direction,
    DocCapacity,
    DocConstant,
    DocData,
    DocEvent,
    DocField,
    DocOperation,
    DocState,
    DocType,
    Document,
    Kind,
)
from fsmkit.yaml import keys
from fsmkit.yaml.nodes import (
    Mapping,
    Node,
    Scalar,
    Sequence,
    check_keys,
    demand_mapping,
    demand_sequence,
    demand_text,
    read_nodes,
)
from fsmkit.yaml.states import StateReader

DATAMODELS = ("fsmkit", "ecmascript", "null")


def read_document(source: Source, findings: Findings) -> Document | None:
    """Return the document of a YAML text, or None where an error was found."""
    root = read_nodes(source, findings)
    if root is None:
        return None
    mapping = demand_mapping(root, "a chart", findings)
    if mapping is None:
        return None
    document = _ChartReader(source, mapping, findings).document()
    return None if findings.has_errors else document


class _ChartReader:
    """Reads the mapping of a chart."""

    def __init__(self, source: Source, mapping: Mapping, findings: Findings) -> None:
        """Stand before the first key."""
        self._source = source
        self._mapping = mapping
        self._findings = findings
        self._values = {key.value: (key, value) for key, value in mapping.entries}

    def document(self) -> Document:
        """Return the document as far as it can be read."""
        findings = self._findings
        if "system" in self._values:
            findings.add(
                "not-a-chart", f"`{self._source.name}` describes a system, not a chart",
                self._values["system"][0], help="name one of the charts listed under `machines`",
            )  # fmt: skip
        check_keys(self._mapping, frozenset(keys.CHART), "a chart", findings)
        states = StateReader(findings)
        name = self._text("chart")
        if name is None:
            stem = PurePath(self._source.name).stem
            name = Text(stem, Span(self._source, 0, 0))
            if "chart" not in self._values and not findings.has_errors:
                findings.add(
                    "missing-key", "a chart needs a name", Span(self._source, 0, 1),
                    help=f"begin the file with `chart: {stem.capitalize()}`",
                )  # fmt: skip
        root = DocState(
            id=None,
            kind=Kind.COMPOUND,
            span=self._mapping.span,
            initial=states.initial(self._node("initial")),
            children=states.children(self._node("states")),
        )
        if (regions := self._values.get("regions")) is not None:
            findings.add(
                "unexpected-shape", "the root of a chart has no regions", regions[0],
                help="put the regions into one state under `states`",
            )  # fmt: skip
        return Document(
            source=self._source,
            name=name,
            root=root,
            extends=self._text("extends"),
            abstract=states.flag(self._node("abstract"), "abstract"),
            datamodel=self._one_of("datamodel", DATAMODELS),
            late_binding=self._one_of("binding", ("early", "late")) == "late",
            doc=self._doc(),
            types=self._types(),
            constants=tuple(
                DocConstant(key, text) for key, text in self._texts("constants", "a constant")
            ),
            data=self._data("data"),
            inputs=self._data("inputs"),
            outputs=self._data("outputs"),
            operations=self._operations(),
            events=self._events(),
            capacities=self._capacities(),
            script=tuple(s for block in states.blocks(self._node("script")) for s in block),
            refine=states.refinements(self._node("refine")),
        )

    def _node(self, key: str) -> Node | None:
        return self._values[key][1] if key in self._values else None

    def _text(self, key: str) -> Text | None:
        node = self._node(key)
        return None if node is None else demand_text(node, f"`{key}`", self._findings)

    def _doc(self) -> str:
        text = self._text("doc")
        return text.value.strip() if text else ""

    def _one_of(self, key: str, choices: tuple[str, ...]) -> str:
        text = self._text(key)
        if text is None:
            return choices[0]
        if text.value not in choices:
            self._findings.add(
                "unexpected-value", f"`{key}` cannot be `{text.value}`", text,
                help=f"use {', '.join(choices)}",
            )  # fmt: skip
        return text.value

    def _entries(self, key: str) -> tuple[tuple[Text, Node], ...]:
        node = self._node(key)
        mapping = None if node is None else demand_mapping(node, f"`{key}`", self._findings)
        return () if mapping is None else mapping.entries

    def _texts(self, key: str, what: str) -> list[tuple[Text, Text]]:
        pairs = []
        for name, node in self._entries(key):
            text = demand_text(node, what, self._findings)
            if text is not None:
                pairs.append((name, text))
        return pairs

    def _types(self) -> tuple[DocType, ...]:
        found = []
        for name, node in self._entries("types"):
            if isinstance(node, Sequence):
                texts = (demand_text(item, "a member", self._findings) for item in node.items)
                found.append(DocType(name, members=tuple(text for text in texts if text)))
            elif (mapping := demand_mapping(node, f"type `{name}`", self._findings)) is not None:
                fields = [
                    DocField(key, demand_text(value, "a field's type", self._findings))
                    for key, value in mapping.entries
                ]
                found.append(DocType(name, fields=tuple(fields)))
        return tuple(found)

    def _data(self, key: str) -> tuple[DocData, ...]:
        return tuple(
            DocData(name, *read_typed(text, self._findings))
            for name, text in self._texts(key, "a declaration")
        )

    def _operations(self) -> tuple[DocOperation, ...]:
        found = []
        for text in self._list("operations", self._node("operations")):
            signature = read_signature(text, self._findings)
            if signature is not None:
                found.append(DocOperation(signature.name, signature.fields, signature.result))
        return tuple(found)

    def _events(self) -> tuple[DocEvent, ...]:
        node = self._node("events")
        mapping = None if node is None else demand_mapping(node, "`events`", self._findings)
        if mapping is None:
            return ()
        check_keys(mapping, frozenset(keys.EVENTS), "`events`", self._findings)
        found = []
        for key, value in mapping.entries:
            if key.value not in keys.EVENTS:
                continue
            for text in self._list(key.value, value):
                signature = read_signature(text, self._findings)
                if signature is not None:
                    direction = Direction(key.value)
                    found.append(
                        DocEvent(signature.name, signature.fields, direction, signature.result)
                    )
        return tuple(found)

    def _list(self, key: str, node: Node | None) -> list[Text]:
        if node is None or (isinstance(node, Scalar) and not node.text.value):
            return []
        sequence = demand_sequence(node, f"`{key}`", self._findings)
        items = () if sequence is None else sequence.items
        texts = (demand_text(item, f"an entry of `{key}`", self._findings) for item in items)
        return [text for text in texts if text is not None]

    def _capacities(self) -> tuple[DocCapacity, ...]:
        node = self._node("capacity")
        if isinstance(node, Mapping):
            check_keys(node, frozenset(keys.CAPACITY), "`capacity`", self._findings)
        return tuple(DocCapacity(n, t) for n, t in self._texts("capacity", "a capacity"))
