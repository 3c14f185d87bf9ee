"""Write a small transition system for Graphviz.

A state is a box with the active leaves of its machines.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.emit.dot import quoted, statement
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.transition_system import TransitionSystem, export_states
from fsmkit.system.system import System


def export(system: System, options: ExportOptions) -> ExportedModel:
    """Explore a system by the interpreter, then write its states and transitions."""
    return export_states(system, options, lines_of)


def lines_of(system: TransitionSystem) -> Iterator[str]:
    """Yield the lines, each with its end."""
    yield f"digraph {quoted(system.name)} {{\n"
    yield 'node [shape=box, style=rounded, fontname="Helvetica", fontsize=10];\n'
    yield 'edge [fontname="Helvetica", fontsize=9];\n'
    yield statement("0", label="", shape="point") + "\n"
    for number, shown in enumerate(system.configurations[1:], 1):
        yield statement(str(number), label=shown.replace(" ", "\n")) + "\n"
    for arrow in system.arrows:
        yield statement(f"{arrow.source} -> {arrow.target}", label=arrow.label) + "\n"
    yield "}\n"
