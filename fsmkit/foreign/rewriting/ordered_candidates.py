"""R9: the candidates of a state have an order of their own, not that of the document."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from fsmkit.document.document import DocState, DocTransition, Document, Kind
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import map_states

RULE = "R9"


def ordered_candidates(
    document: Document, recorder: Recorder, rank: Callable[[DocTransition], Any]
) -> Document:
    """Sort the transitions of each state by a rank; equal ranks keep their order.

    In a choice state, the first leg without a guard is the last one: later legs are never taken.
    """

    def change(state: DocState) -> DocState:
        found = tuple(sorted(state.transitions, key=rank))
        if state.kind is Kind.CHOICE:
            plain = [place for place, leg in enumerate(found) if leg.guard is None]
            found = found[: plain[0] + 1] if plain else found
        if found == state.transitions:
            return state
        moved = [new for new, old in zip(found, state.transitions, strict=False) if new is not old]
        for transition in moved:
            recorder.rewrite(RULE, transition.span)
        return replace(state, transitions=found)

    return map_states(document, change)
