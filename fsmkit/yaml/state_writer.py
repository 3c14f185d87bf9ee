"""States as YAML."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fsmkit.diagnostics import Text
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocInvoke, DocState, Document, Kind
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.transition_writer import initial, transitions
from fsmkit.yaml.writing import mapping, written

SMALL = 60
"""A state stands on one line if it is not longer."""


@dataclass
class StateWriter:
    """Writes the states of one document; those without an id get the one they mean."""

    document: Document
    chart: Callable[[Document], dict[str, Tree]]
    """Writes a chart that stands in an ``invoke``."""
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Collect the ids that are written."""
        pending = [*self.document.root.children, *self.document.refine]
        while pending:
            state = pending.pop()
            pending += state.children
            if state.id is not None:
                self.taken.add(state.id.value)

    def states(self, states: tuple[DocState, ...], parent: str) -> dict[str, Tree]:
        """Return states by name; ``parent`` is the id of their parent, ``state`` for the root."""
        named = [(self._id(state, parent, n), state) for n, state in enumerate(states, 1)]
        return mapping((name, Short(self._state(name, state), SMALL)) for name, state in named)

    def _id(self, state: DocState, parent: str, number: int) -> Text:
        """Return the id of a state, made as elaboration makes it where it has none."""
        if state.id is not None:
            return state.id
        made = f"{parent}.{number}"
        while made in self.taken:
            made += "_"
        self.taken.add(made)
        return Text(made, state.span)

    def _state(self, name: Text, state: DocState) -> dict[str, Tree]:
        own: dict[str, Tree] = {}
        is_history = state.kind in HISTORIES
        if is_history:
            own["history"] = state.kind.value.split()[0]
        if state.kind is Kind.FINAL:
            own["final"] = "true"
        if state.invokes:
            invokes: list[Tree] = [self._invoke(one) for one in state.invokes]
            own["invoke"] = invokes if len(invokes) > 1 else invokes[0]
        if done := written(state, keys.DONE):
            own["done"] = done
        if state.initial is not None:
            own["default" if is_history else "initial"] = initial(state.initial)
        tree = written(state, keys.STATE, own)
        tree |= transitions(state.transitions, is_choice=state.kind is Kind.CHOICE)
        if state.kind is Kind.PARALLEL or state.kind is Kind.COMPOUND or state.children:
            key = "regions" if state.kind is Kind.PARALLEL else "states"
            tree[key] = self.states(state.children, name.value)
        return tree

    def _invoke(self, invoke: DocInvoke) -> dict[str, Tree]:
        chart = {} if invoke.content is None else {"content": self.chart(invoke.content)}
        return written(invoke, keys.INVOKE, chart)
