"""Moves that one edge performs, and where they go from each of their local states.

A reader of JANI needs far longer for many edges than for the expressions of a few. So moves that
have one name and do the same but for their local states are one edge: its guard says from where,
and the local state after it is an expression of that before.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fsmkit.verify.export.deeds import deed
from fsmkit.verify.export.network import Automaton, Move


def edges_of(automaton: Automaton) -> tuple[tuple[Move, ...], ...]:
    """Return the moves of a machine by edges, in their order; all of an edge differ in source.

    So from a local state there are as many steps as there are moves.
    """
    found: dict[object, list[Move]] = {}
    counts: dict[object, int] = {}
    for move in automaton.moves:
        key = move.label, deed(automaton, move)
        ordinal = counts[move.source, key] = counts.get((move.source, key), -1) + 1
        found.setdefault((key, ordinal), []).append(move)
    return tuple(map(tuple, found.values()))


@dataclass(frozen=True, slots=True)
class Run:
    """Local states from ``first`` to ``last``, or some of them, and what comes after them.

    After all of them comes ``after``, or, if it ``shifts``, what is as far from that as they are
    from the first. Whatever else lies between may go anywhere.
    """

    first: int
    last: int
    after: int
    shifts: bool

    @property
    def shift(self) -> int:
        """How far the local states move on."""
        return self.after - self.first


def runs_of(maps: Mapping[int, int]) -> list[Run]:
    """Return the runs of a function on local states, as few as there can be."""
    found: list[Run] = []
    for before, after in sorted(maps.items()):
        run = found[-1] if found else None
        is_new = run is not None and run.first == run.last
        if run is not None and run.shift == after - before and (run.shifts or is_new):
            found[-1] = Run(run.first, before, run.after, shifts=True)
        elif run is not None and run.after == after and (not run.shifts or is_new):
            found[-1] = Run(run.first, before, run.after, shifts=False)
        else:
            found.append(Run(before, before, after, shifts=before == after))
    return found
