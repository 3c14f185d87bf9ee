"""The XML format of Rhapsody's archives (``.rpyx``, ``.sbsx``, ``.clsx``), as nodes.

Objects are elements whose fields are elements with a ``type``. The parts of an object follow it in
the archive: its ``AggregatesList`` has their ids, and their kind decides the field that holds them.
Fields of handles have an additional ``h``. So the nodes are those of the text format.
"""

from __future__ import annotations

from fsmkit.diagnostics import Findings, Source, Text
from fsmkit.foreign.rhapsody.archive import Node
from fsmkit.scxml.nodes import Element, read_nodes

ROOT = "RhapsodyArchive"
PARTS = {
    "IState": "States", "ITransition": "Transitions", "IDefaultDrvdTrans": "Transitions",
    "IStateChart": "StateCharts", "IAttribute": "Attrs", "IArgument": "Args",
    "IPrimitiveOperation": "Operations", "ITriggered": "Operations",
    "ILiteralSpecification": "ValueSpecifications", "IEvent": "Events", "IClass": "Classes",
}  # fmt: skip
"""The containers of the parts of an object, by kind; connectors have many kinds."""
SINGLE = {"ILabel": "_itsLabel", "IGuard": "_itsGuard", "IAction": "_itsAction"}
"""The field of each kind of part that an object has once."""
TRIGGERS = frozenset({"IInterfaceItemTrigger", "ITimeout", "ITrigger"})
CONNECTORS, OTHERS = "Connectors", "Others"
LINE_END = "%0D\n"


def read_xml(source: Source, findings: Findings) -> list[Node]:
    """Return the objects that are part of no other; none, with a finding, if it is damaged."""
    root = read_nodes(source, findings)
    if root is None:
        return []
    model = next((one for one in root.children if one.name == "RHAPSODY-MODEL"), None)
    if root.name != ROOT or model is None:
        findings.add("foreign-syntax", f"`{source.name}` is not an archive of Rhapsody",
                     root.span, help="save the unit in Rhapsody again")  # fmt: skip
        return []
    nodes = [_node(one) for one in model.children]
    known = {node.word("_id"): node for node in nodes if node.word("_id")}
    parts: set[int] = set()
    for node in nodes:
        for part in node.fields.pop("AggregatesList", ()):
            found = known.get(part.value) if isinstance(part, Text) else None
            if found is not None and found is not node and id(found) not in parts:
                parts.add(id(found))
                _add(node, found)
    return [node for node in nodes if id(node) not in parts]


def _add(whole: Node, part: Node) -> None:
    """Add a part to the field of an object that holds parts of its kind."""
    if part.kind in SINGLE or part.kind in TRIGGERS:
        whole.fields[SINGLE.get(part.kind, "_itsTrigger")] = [part]
        return
    name = PARTS.get(part.kind, CONNECTORS if part.word("_connectorType") else OTHERS)
    container = whole.node(name)
    if container is None:
        container = Node("IRPYRawContainer", {"value": []}, part.span)
        whole.fields[name] = [container]
    container.fields["value"].append(part)


def _node(element: Element) -> Node:
    """Return an object; objects directly inside it, as in a container, are its field `value`."""
    fields: dict[str, list[Node | Text]] = {}
    for child in element.children:
        if child.name == "AggregatesList":
            fields.setdefault(child.name, []).extend(map(_text, child.children))
        elif _type(child) == "e":
            fields.setdefault("value", []).append(_node(child))
        else:
            name = child.name
            if element.name.endswith("Handle") and name.startswith("_h"):
                name = f"_{name[2:]}"
            inner = [_node(one) for one in child.children]
            fields[name] = [*inner] if inner else [text] if (text := _text(child)).value else []
    return Node(element.name, fields, element.span)


def _type(element: Element) -> str:
    found = element.get("type")
    return "" if found is None else found.value


def _text(element: Element) -> Text:
    """Return the text of a field; its lines end with an encoded carriage return."""
    text = element.text
    return text.with_value(text.value.replace(LINE_END, "\n")) if LINE_END in text.value else text
