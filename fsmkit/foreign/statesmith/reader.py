"""Reads diagrams of StateSmith."""

from __future__ import annotations

from functools import lru_cache

from fsmkit.diagnostics import Diagnostic, Findings, Source, Span
from fsmkit.foreign.imports import Import
from fsmkit.foreign.statesmith import plantuml
from fsmkit.foreign.statesmith.build import import_vertex
from fsmkit.foreign.statesmith.drawio import read_drawio
from fsmkit.foreign.statesmith.graph import Diagram
from fsmkit.foreign.statesmith.machine import MachineReader, machine_nodes
from fsmkit.foreign.statesmith.yed import read_yed
from fsmkit.scxml.nodes import decode as decode_xml
from fsmkit.yaml.encoding import decode as decode_text

LARGEST = 1 << 23
"""Characters of a file; a larger one is a mistake, or an attack."""


def decode(content: bytes, name: str, findings: Findings) -> Source | None:
    """Return the text of a file: XML names its encoding, PlantUML is UTF-8 or UTF-16."""
    is_xml = name.lower().endswith((".drawio", ".svg", ".graphml"))
    return (decode_xml if is_xml else decode_text)(content, name, findings)


def machines(source: Source, findings: Findings) -> tuple[str, ...]:
    """Return the names of the machines in a file."""
    if len(source.text) > LARGEST:
        findings.add(
            "foreign-syntax", f"`{source.name}` has more than {LARGEST >> 20} Mi characters",
            Span(source, 0, 1), help="divide the diagram",
        )  # fmt: skip
        return ()
    if _is_plantuml(source):
        return tuple(dict.fromkeys(name for name, _, _ in plantuml.diagrams(source)))
    diagram = _diagram(source, findings)
    return () if diagram is None else tuple(machine_nodes(diagram))


def import_machine(source: Source, machine: str, findings: Findings) -> Import | None:
    """Return a machine of a file, or None after reporting why it cannot be read."""
    if _is_plantuml(source):
        diagram: Diagram | None = plantuml.read_plantuml(source, machine, findings)
    else:
        diagram = _diagram(source, Findings())  # `machines` reported what is wrong with it
    if diagram is None:
        return None
    node, page = machine_nodes(diagram)[machine]
    reader = MachineReader(diagram, findings)
    return import_vertex(reader, reader.read(node, page), source, findings)


def _is_plantuml(source: Source) -> bool:
    return not source.name.lower().endswith((".drawio", ".svg", ".graphml"))


def _diagram(source: Source, findings: Findings) -> Diagram | None:
    diagram, found = _read_xml(source)
    findings.extend(found)
    return diagram


@lru_cache(maxsize=1)
def _read_xml(source: Source) -> tuple[Diagram | None, tuple[Diagnostic, ...]]:
    """Return the diagram of an XML file, which is read once for all of its machines."""
    findings = Findings()
    is_yed = source.name.lower().endswith(".graphml")
    diagram = (read_yed if is_yed else read_drawio)(source, findings)
    return diagram, tuple(findings)
