"""Instances of used charts: copies of one chart whose numbers differ by a constant.

The states of a chart follow each other in document order. Copies of equal size therefore have state
numbers that differ by a constant; the same holds for transitions and events.
"""

from __future__ import annotations

from dataclasses import dataclass

from fsmkit.chart.chart import Chart
from fsmkit.document.document import Kind

MOST = 255
"""The greatest number of copies in a group, so that a copy's number fits in a byte."""
Shape = tuple[tuple[Kind, int, int], ...]
"""For each state of a copy: its kind, and its numbers of transitions and children."""


@dataclass(frozen=True, slots=True)
class Instance:
    """A position in a copy: equal in all copies of a group but for ``copy``."""

    group: int
    copy: int
    inner: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """Copies of one chart: their first states at equal distances, and their number of states."""

    bases: tuple[int, ...]
    size: int


@dataclass(frozen=True, slots=True)
class Instances:
    """The groups of copies of a chart."""

    chart: Chart
    groups: tuple[Group, ...]

    def state(self, state: int, *more: int) -> Instance | None:
        """Return the position of a state, or of an item of it; None outside of copies."""
        for number, group in enumerate(self.groups):
            for copy, base in enumerate(group.bases):
                if base <= state < base + group.size:
                    return Instance(number, copy, (state - base, *more))
        return None

    def transition(self, index: int) -> Instance | None:
        """Return the position of a transition, or None outside of copies."""
        source = self.chart.transitions[index].source
        own = self.chart.states[source].transitions
        return self.state(source, 1, own.index(index)) if index in own else None


def instances_of(chart: Chart) -> Instances:
    """Return the groups of copies."""
    kinds: dict[tuple[str, Shape], list[int]] = {}
    for copy in chart.copies:
        states = chart.states[copy.state : chart.states[copy.state].last_descendant + 1]
        shape = tuple((s.kind, len(s.transitions), len(s.children)) for s in states)
        kinds.setdefault((copy.chart, shape), []).append(copy.state)
    groups = []
    taken: set[int] = set()
    for (_, shape), found in sorted(kinds.items(), key=lambda each: each[1][0]):
        bases = [base for base in found if base not in taken]
        step = bases[1] - bases[0] if len(bases) > 1 else 0
        evenly = [base for n, base in enumerate(bases) if base == bases[0] + n * step]
        if 1 < len(evenly) <= MOST:
            groups.append(Group(tuple(evenly), len(shape)))
            taken |= {base + n for base in evenly for n in range(len(shape))}
    return Instances(chart, tuple(groups))
