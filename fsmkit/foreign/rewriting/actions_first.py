"""R3: the action of a transition precedes the exits of the states that the transition leaves."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from fsmkit.diagnostics import Text
from fsmkit.document.document import (
    Direction,
    DocEvent,
    DocState,
    DocTransition,
    Document,
    Trigger,
)
from fsmkit.document.walk import states
from fsmkit.emit.identifiers import Namer
from fsmkit.foreign.imports import Recorder
from fsmkit.foreign.rewriting.tree import Tree, map_states
from fsmkit.language.statements.tree import Raise

RULE = "R3"


def actions_first(document: Document, recorder: Recorder) -> Document:
    """Execute the content of each transition before any exit handler.

    A transition whose exits have no content is unchanged. Any other is divided: the content and
    ``raise`` of a new internal event, without a target, then a transition for that event.
    """
    return _Rewriter(Tree(document), recorder).document()


@dataclass
class _Rewriter:
    tree: Tree
    recorder: Recorder
    namer: Namer = field(init=False)
    events: list[DocEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.namer = Namer(event.name.value for event in self.tree.document.events)

    def document(self) -> Document:
        """Return the rewritten document, with the new events."""
        changed = map_states(self.tree.document, self._state)
        return replace(changed, events=(*changed.events, *self.events))

    def _state(self, state: DocState) -> DocState:
        if state.id is None:
            return state
        found = [part for each in state.transitions for part in self._parts(state.id.value, each)]
        return replace(state, transitions=tuple(found))

    def _parts(self, source: str, transition: DocTransition) -> tuple[DocTransition, ...]:
        is_plain = not (transition.targets and transition.content and transition.events)
        if is_plain or not self._exits(source, transition.targets[0].value):
            return (transition,)
        trigger = transition.events[0]
        event = trigger.with_value(self.namer.name(f"{trigger.value}_t"))
        self.events.append(DocEvent(event, (), Direction.INTERNAL))
        self.recorder.rewrite(RULE, transition.span, event.value)
        content = (*(transition.content or ()), Raise(event, (), event.span))
        first = replace(transition, targets=(), content=content)
        return first, _moving(transition, event)

    def _exits(self, source: str, target: str) -> bool:
        """Return whether a transition may leave a state that has an exit handler."""
        left = list(states(*self.tree.states[source].children))
        if source not in self.tree.ancestors(target):
            left.append(self.tree.states[source])
            outer = {target, *self.tree.ancestors(target)}
            left += [self.tree.states[n] for n in self.tree.ancestors(source) if n not in outer]
        return any(handler for state in left for handler in state.exit)


def _moving(transition: DocTransition, event: Text) -> DocTransition:
    """Return the part of a transition that leaves and enters states."""
    return DocTransition(
        Trigger.EVENT, transition.span, events=(event,), targets=transition.targets
    )
