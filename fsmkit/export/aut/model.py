"""Write Aldebaran files (``.aut``) for mCRL2 and CADP: a header, then a transition per line.

``des (initial, transitions, states)``, then ``(from, "label", to)``; states are numbered from 0
(CADP, manual page AUT).
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.emit.lines import one_line
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.transition_system import TransitionSystem, export_states
from fsmkit.system.system import System


def export(system: System, options: ExportOptions) -> ExportedModel:
    """Explore a system by the interpreter, then write its states and transitions."""
    return export_states(system, options, lines_of)


def lines_of(system: TransitionSystem) -> Iterator[str]:
    """Yield the lines, each with its end."""
    yield f"des (0, {len(system.arrows)}, {system.states})\n"
    for arrow in system.arrows:
        label = one_line(arrow.label).replace('"', "'")
        yield f'({arrow.source}, "{label}", {arrow.target})\n'
