"""From a Document to YAML that reads back as an equal Document."""

from __future__ import annotations

from itertools import groupby

from fsmkit.document.document import DocEvent, DocType, Document
from fsmkit.yaml.layout import Prose, Short, Tree, render
from fsmkit.yaml.state_writer import StateWriter
from fsmkit.yaml.transition_writer import initial
from fsmkit.yaml.writing import data, mapping, signature, statements, type_of


def write_document(document: Document) -> str:
    """Return a document as YAML; `FsmkitError` (``not-expressible``) names what it cannot say."""
    return render(chart(document))


def chart(document: Document) -> dict[str, Tree]:
    """Return a document as the mapping of a chart."""
    writer = StateWriter(document, chart)
    root = document.root
    tree: dict[str, Tree] = {"chart": document.name.value}
    if document.extends is not None:
        tree["extends"] = document.extends.value
    if document.abstract:
        tree["abstract"] = "true"
    if document.doc:
        tree["doc"] = Prose(document.doc)
    if document.datamodel != "fsmkit":
        tree["datamodel"] = document.datamodel
    if document.late_binding:
        tree["binding"] = "late"
    tree |= declarations(document)
    if root.initial is not None:
        tree["initial"] = initial(root.initial)
    if root.children or document.extends is None:
        tree["states"] = writer.states(root.children, "state")
    if document.refine:
        tree["refine"] = writer.states(document.refine, "state")
    return tree


def declarations(document: Document) -> dict[str, Tree]:
    """Return what a chart declares, without what is empty."""
    capacities = mapping((one.name, one.value.value) for one in document.capacities)
    parts: dict[str, dict[str, Tree] | list[Tree]] = {
        "types": mapping((one.name, _type(one)) for one in document.types),
        "constants": mapping((one.name, one.value.value) for one in document.constants),
        "data": data(document.data),
        "inputs": data(document.inputs),
        "outputs": data(document.outputs),
        "operations": [
            signature(one.name, one.parameters, one.result) for one in document.operations
        ],
        "events": _events(document.events),
    }
    tree: dict[str, Tree] = {key: part for key, part in parts.items() if part}
    if capacities:
        tree["capacity"] = Short(capacities)
    if document.script:
        tree["script"] = statements(document.script)
    return tree


def _type(declared: DocType) -> Tree:
    if declared.fields:
        return Short(mapping((one.name, type_of(one)) for one in declared.fields))
    return Short([member.value for member in declared.members])


def _events(events: tuple[DocEvent, ...]) -> dict[str, Tree] | list[Tree]:
    """Return events by direction, in several groups where only that keeps their order."""
    groups: list[tuple[str, list[Tree]]] = [
        (direction.value, [signature(one.name, one.fields, one.reply) for one in group])
        for direction, group in groupby(events, key=lambda one: one.direction)
    ]
    if len({direction for direction, _ in groups}) == len(groups):
        return dict(groups)
    return [{direction: signatures} for direction, signatures in groups]
