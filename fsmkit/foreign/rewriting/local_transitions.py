"""R1: transitions between a state and its descendants do not leave the outer state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.document.document import (
    HISTORIES,
    DocState,
    DocTransition,
    Document,
    Kind,
    Trigger,
)
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import (
    Tree,
    initial_to,
    is_composite,
    map_states,
    name_of,
)

RULE = "R1"


def local_transitions(document: Document, recorder: Recorder) -> Document:
    """Keep the outer state active in a transition between it and one of its descendants.

    A transition to a descendant becomes internal. A transition to an ancestor targets the initial
    state of the ancestor, with the initial content. If the initial state is no child of the
    ancestor, a choice state represents the initial pseudostate, because a direct transition might
    leave too little. Ancestors that are parallel stay targets.
    """
    return _Rewriter(Tree(document), recorder).document()


@dataclass
class _Rewriter:
    tree: Tree
    recorder: Recorder
    namer: Namer = field(init=False)
    starts: dict[str, str] = field(default_factory=dict)
    """The choice states that represent initial pseudostates, by the id of their parent."""

    def __post_init__(self) -> None:
        self.namer = self.tree.namer()

    def document(self) -> Document:
        """Return the rewritten document."""
        changed = map_states(self.tree.document, self._transitions)
        return map_states(changed, self._start)

    def _transitions(self, state: DocState) -> DocState:
        if state.id is None or not state.transitions:
            return state
        source = state.id.value
        found = tuple(self._transition(source, each) for each in state.transitions)
        return replace(state, transitions=found)

    def _transition(self, source: str, transition: DocTransition) -> DocTransition:
        if len(transition.targets) != 1:
            return transition
        target = transition.targets[0].value
        if self.tree.is_below(target, source) and is_composite(self.tree.states[source]):
            if transition.internal:
                return transition
            self.recorder.rewrite(RULE, transition.span)
            return replace(transition, internal=True)
        outer = self.tree.states.get(target)
        if outer is None or not self.tree.is_below(source, target) or not is_composite(outer):
            return transition
        return self._to_start(transition, outer)

    def _to_start(self, transition: DocTransition, outer: DocState) -> DocTransition:
        """Return a transition to the initial pseudostate of an ancestor."""
        name, initial = name_of(outer), outer.initial
        named = transition.targets[0]
        if initial is None:
            first = next(child for child in outer.children if child.kind not in HISTORIES)
            self.recorder.rewrite(RULE, transition.span)
            return replace(transition, targets=(named.with_value(name_of(first)),))
        target = initial.targets[0].value
        if self.tree.parent.get(target) == name and len(initial.targets) == 1:
            content = (*(transition.content or ()), *(initial.content or ())) or None
            self.recorder.rewrite(RULE, transition.span)
            return replace(transition, targets=(named.with_value(target),), content=content)
        is_new = name not in self.starts
        start = self.starts.setdefault(name, self.namer.name(f"{name}_start") if is_new else "")
        self.recorder.rewrite(RULE, transition.span, *([start] if is_new else []))
        return replace(transition, targets=(named.with_value(start),))

    def _start(self, state: DocState) -> DocState:
        """Return a state with its initial pseudostate as a choice, if a transition needs it."""
        name = None if state.id is None else self.starts.get(state.id.value)
        if name is None or state.initial is None:
            return state
        at = state.initial.targets[0].with_value(name)
        leg = replace(state.initial, trigger=Trigger.EVENTLESS)
        choice = DocState(at, Kind.CHOICE, state.initial.span, transitions=(leg,))
        return replace(state, children=(*state.children, choice), initial=initial_to(at))
