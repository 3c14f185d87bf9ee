"""Aldebaran files (``.aut``), which mCRL2 and CADP read: a header, then a transition on each line.

``des (initial, transitions, states)``, then ``(from, "label", to)``; states are numbered from 0
(CADP, manual page AUT).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fsmkit.diagnostics import fail
from fsmkit.export.transition_system import Arrow, TransitionSystem
from fsmkit.texts.lines import one_line

HEADER = re.compile(r"des \((\d+), (\d+), (\d+)\)")
LINE = re.compile(r'\((\d+), "([^"]*)", (\d+)\)')


def written(system: TransitionSystem) -> Iterator[str]:
    """Yield the lines, each with its end."""
    yield f"des (0, {len(system.arrows)}, {system.states})\n"
    for arrow in system.arrows:
        label = one_line(arrow.label).replace('"', "'")
        yield f'({arrow.source}, "{label}", {arrow.target})\n'


def read(text: str) -> tuple[int, tuple[Arrow, ...]]:
    """Return how many states a file has, and its transitions.

    Raises `FsmkitError` (``bad-aldebaran``) where it is none, or its counts are wrong.
    """
    lines = text.splitlines()
    header = HEADER.fullmatch(lines[0]) if lines else None
    if header is None:
        raise fail("bad-aldebaran", "the first line is not `des (0, transitions, states)`")
    initial, count, states = map(int, header.groups())
    arrows = []
    for number, line in enumerate(lines[1:], 2):
        found = LINE.fullmatch(line)
        if found is None or max(int(found[1]), int(found[3])) >= states:
            raise fail("bad-aldebaran", f'line {number} is not `(from, "label", to)`')
        arrows.append(Arrow(int(found[1]), found[2], int(found[3])))
    if initial != 0 or len(arrows) != count:
        raise fail("bad-aldebaran", f"there are {len(arrows)} transitions, not {count}")
    return states, tuple(arrows)
