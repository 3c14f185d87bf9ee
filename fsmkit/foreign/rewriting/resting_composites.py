"""R2: a composite state without an initial transition may be active without a child."""

from __future__ import annotations

from dataclasses import replace

from fsmkit.document.document import DocState, Document, Kind
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import Tree, initial_to, is_composite, map_states

RULE = "R2"
SUFFIX = "_self"


def resting_composites(document: Document, recorder: Recorder) -> Document:
    """Give each targeted composite state without an initial state a leaf to rest in.

    A transition to a shallow history targets each state that the history may record.
    """
    tree = Tree(document)
    targets, namer = tree.targets(), tree.namer()
    for name, state in tree.states.items():
        if state.kind is Kind.SHALLOW_HISTORY and name in targets and name in tree.parent:
            recorded = tree.states[tree.parent[name]].children
            targets |= {one.id.value for one in recorded if one.id is not None}

    def change(state: DocState) -> DocState:
        if state.id is None or state.initial is not None or not is_composite(state):
            return state
        if state.id.value not in targets:
            return state
        leaf = state.id.with_value(namer.name(state.id.value + SUFFIX))
        recorder.rewrite(RULE, state.span, leaf.value)
        resting = DocState(leaf, Kind.ATOMIC, state.span)
        return replace(state, children=(resting, *state.children), initial=initial_to(leaf))

    return map_states(document, change)
