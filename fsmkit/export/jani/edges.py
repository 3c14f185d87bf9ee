"""Moves that one edge performs: they have one name, do the same, and change components alike."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from fsmkit.export.changes import Joint, joined
from fsmkit.export.components import Code
from fsmkit.export.network import Automaton


def edges_of(automaton: Automaton, codes: Sequence[Code]) -> tuple[Joint, ...]:
    """Return the moves of a machine by edges; all of an edge differ in source.

    So from a local state there are as many steps as there are moves.
    """
    keys: dict[int, Hashable] = {}
    counts: dict[Hashable, int] = {}
    for move in automaton.moves:
        key = move.label, automaton.signature(move)
        ordinal = counts[move.source, key] = counts.get((move.source, key), -1) + 1
        keys[id(move)] = key, ordinal
    return joined(automaton.moves, lambda move: keys[id(move)], codes)
