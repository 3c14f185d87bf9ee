"""Writing of a Document as YAML that reads back as an equal Document."""

from __future__ import annotations

from itertools import groupby

from fsmkit.document import keys
from fsmkit.document.document import (
    DocEvent,
    DocFunction,
    DocMember,
    DocOperation,
    DocType,
    Document,
)
from fsmkit.language.statements.writing import write_body
from fsmkit.yaml.layout import Short, Tree, render
from fsmkit.yaml.properties import write_environment, write_properties
from fsmkit.yaml.state_writer import StateWriter
from fsmkit.yaml.transition_writer import initial
from fsmkit.yaml.writing import mapping, signature, targets, type_of, write_keys


def write_document(document: Document) -> str:
    """Return a document as YAML; `FsmkitError` (``not-expressible``) names inexpressible parts."""
    return render(chart(document))


def chart(document: Document) -> dict[str, Tree]:
    """Return a document as the mapping of a chart."""
    writer = StateWriter(document, chart)
    root = document.root
    own: dict[str, Tree] = {"chart": document.name.value, **declarations(document)}
    if document.entries:
        entries = mapping((one.name, targets(one.targets)) for one in document.entries)
        own["entries"] = Short(entries)
    if document.properties:
        own["properties"] = write_properties(document.properties)
    if document.environment is not None:
        own["environment"] = write_environment(document.environment)
    if root.initial is not None:
        own["initial"] = initial(root.initial)
    if root.children or document.extends is None:
        own["states"] = writer.states(root.children, "state")
    if document.refine:
        own["refine"] = writer.states(document.refine, "state")
    return write_keys(document, keys.CHART, own)


def declarations(document: Document) -> dict[str, Tree]:
    """Return the declarations of a chart without variables and empty parts."""
    capacities = mapping((one.name, one.value.value) for one in document.capacities)
    parts: dict[str, dict[str, Tree] | list[Tree]] = {
        "types": mapping((one.name, _type(one)) for one in document.types),
        "constants": mapping((one.name, one.value.value) for one in document.constants),
        "operations": [_operation(one) for one in document.operations],
        "functions": {
            signature(f.name, f.parameters, f.result, is_called=True): _body(f)
            for f in document.functions
        },
        "events": _events(document.events),
    }
    tree: dict[str, Tree] = {key: part for key, part in parts.items() if part}
    if capacities:
        tree["capacity"] = Short(capacities)
    return tree


def _operation(one: DocOperation) -> Tree:
    written = signature(one.name, one.parameters, one.result)
    parts = write_keys(one, keys.OPERATION)
    return Short({written: Short(parts)}) if parts else written


def _body(function: DocFunction) -> str:
    text = write_body(function.body)
    return f"{text}\n" if "\n" in text else text


def _type(declared: DocType) -> Tree:
    if declared.fields:
        return Short(mapping((one.name, type_of(one)) for one in declared.fields))
    if declared.same is not None:
        return declared.same.value
    return Short([_member(member) for member in declared.members])


def _member(member: DocMember) -> str:
    number = "" if member.number is None else f" = {member.number}"
    return f"{member.name}{number}"


def _events(events: tuple[DocEvent, ...]) -> dict[str, Tree] | list[Tree]:
    """Return events by direction, in several groups only if their order requires it."""
    groups: list[tuple[str, list[Tree]]] = [
        (direction.value, [signature(one.name, one.fields, one.reply) for one in group])
        for direction, group in groupby(events, key=lambda one: one.direction)
    ]
    if len({direction for direction, _ in groups}) == len(groups):
        return dict(groups)
    return [{direction: signatures} for direction, signatures in groups]
