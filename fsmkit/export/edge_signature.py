"""What a move of an automaton does, apart from where it comes from, where it goes, and its name.

Moves of one signature can share an option of a process, or an edge. A chart that stands open has a
hundred ways into each state of its error: one by one they are more than tools read.
"""

from __future__ import annotations

from collections.abc import Hashable

from fsmkit.export.network import Automaton, Move


def edge_signature(automaton: Automaton, move: Move) -> Hashable:
    """Return when a move may happen, what it tells others, and whether the machine stops by it."""
    stops = automaton.locals[move.source].running and not automaton.locals[move.target].running
    when = move.action, move.taken, move.needs_empty, move.from_outside
    return when, move.sent, move.faults, stops
