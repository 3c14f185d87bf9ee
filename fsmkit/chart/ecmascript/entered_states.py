"""The possible current events at the entry of a state: those of the transitions into it.

An upper bound: guards are not looked at, and a history may hold anything below its parent.
"""

from __future__ import annotations

from collections.abc import Iterable

from fsmkit.document.document import HISTORIES, DocState, DocTransition, Document, Kind, Trigger
from fsmkit.document.walk import states


class EnteredStates:
    """The states that can be entered from others, including those after eventless transitions.

    States are known by identity.
    """

    def __init__(self, document: Document) -> None:
        self._parents: dict[int, DocState] = {}
        self._by_name: dict[str, DocState] = {}
        self._transitions: dict[tuple[str, ...], list[DocState]] = {}
        for state in states(document.root):
            self._parents |= {id(child): state for child in state.children}
            if state.id is not None:
                self._by_name[state.id.value] = state
        for state in states(document.root):
            for transition in state.transitions:
                if transition.trigger is Trigger.EVENT:
                    events = tuple(event.value for event in transition.events)
                    self._transitions.setdefault(events, []).extend(self._targets([transition]))
        self.at_start = self._entered([document.root])
        """The states that may be entered without a current event."""

    def descriptors(self, candidates: Iterable[DocState]) -> dict[int, tuple[str, ...]]:
        """Return, by identity of a state, the descriptors of the events that can enter it."""
        found: dict[int, list[str]] = {id(state): [] for state in candidates}
        if found:
            for events, targets in self._transitions.items():
                for state in self._entered(targets) & found.keys():
                    found[state] += events
        return {state: tuple(events) for state, events in found.items()}

    def _entered(self, targets: Iterable[DocState]) -> frozenset[int]:
        """Return the states entered with the targets: also ancestors and default entries."""
        entered: set[int] = set()
        around: set[int] = set()
        left = list(targets)
        while left:
            state = left.pop()
            if id(state) in entered:
                continue
            entered.add(id(state))
            left += self._targets(t for t in state.transitions if t.trigger is not Trigger.EVENT)
            if state.kind in HISTORIES and id(state) in self._parents:
                left += states(self._parents[id(state)])
            elif state.kind is Kind.PARALLEL:
                left += state.children
            elif state.initial is not None:
                left += self._targets([state.initial])
            else:
                left += state.children[:1]
            above = self._parents.get(id(state))
            while above is not None and id(above) not in around:
                around.add(id(above))
                left += self._targets(
                    t for t in above.transitions if t.trigger is not Trigger.EVENT
                )
                if above.kind is Kind.PARALLEL:
                    left += above.children
                above = self._parents.get(id(above))
        return frozenset(entered | around)

    def _targets(self, transitions: Iterable[DocTransition]) -> list[DocState]:
        names = (target.value for transition in transitions for target in transition.targets)
        return [self._by_name[name] for name in names if name in self._by_name]
