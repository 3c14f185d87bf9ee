"""Aldebaran files (``.aut``), which mCRL2 and CADP read: a header, then a transition on each line.

``des (initial, transitions, states)``, then ``(from, "label", to)``; states are numbered from 0
(CADP, manual page AUT).
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.emit.lines import one_line
from fsmkit.export.exporter import Exported, ExportOptions
from fsmkit.export.transition_system import TransitionSystem, exported
from fsmkit.system.system import System


def export(system: System, options: ExportOptions) -> Exported:
    """Explore a system by the interpreter, then write its states and transitions."""
    return exported(system, options, written)


def written(system: TransitionSystem) -> Iterator[str]:
    """Yield the lines, each with its end."""
    yield f"des (0, {len(system.arrows)}, {system.states})\n"
    for arrow in system.arrows:
        label = one_line(arrow.label).replace('"', "'")
        yield f'({arrow.source}, "{label}", {arrow.target})\n'
