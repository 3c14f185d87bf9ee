"""States as YAML."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fsmkit.diagnostics import Text
from fsmkit.document.document import DocInvoke, DocState, Document, Kind
from fsmkit.yaml.layout import Prose, Short, Tree
from fsmkit.yaml.transition_writer import initial, transitions
from fsmkit.yaml.writing import arguments, data, handlers, mapping, statements

SMALL = 60
"""A state stands on one line if it is not longer."""
HISTORIES = {Kind.SHALLOW_HISTORY: "shallow", Kind.DEEP_HISTORY: "deep"}


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
        tree: dict[str, Tree] = {}
        is_history = state.kind in HISTORIES
        if state.doc:
            tree["doc"] = Prose(state.doc)
        if is_history:
            tree["history"] = HISTORIES[state.kind]
        if state.kind is Kind.FINAL:
            tree["final"] = "true"
        tree |= {key: "true" for key in ("abstract", "rest") if getattr(state, key)}
        if state.overrides:
            tree["override"] = Short([*sorted(state.overrides)])
        if state.data:
            tree["data"] = data(state.data)
        if state.defer:
            tree["defer"] = Short([event.value for event in state.defer])
        if state.invariant is not None:
            tree["invariant"] = state.invariant.value
        if state.entry:
            tree["entry"] = handlers(state.entry)
        if state.exit:
            tree["exit"] = handlers(state.exit)
        if state.invokes:
            invokes: list[Tree] = [self._invoke(one) for one in state.invokes]
            tree["invoke"] = invokes if len(invokes) > 1 else invokes[0]
        if state.done_data or state.done_content is not None:
            tree["done"] = _done(state)
        if state.initial is not None:
            tree["default" if is_history else "initial"] = initial(state.initial)
        tree |= transitions(state.transitions, is_choice=state.kind is Kind.CHOICE)
        if state.kind is Kind.PARALLEL or state.kind is Kind.COMPOUND or state.children:
            key = "regions" if state.kind is Kind.PARALLEL else "states"
            tree[key] = self.states(state.children, name.value)
        return tree

    def _invoke(self, invoke: DocInvoke) -> dict[str, Tree]:
        texts = {
            "id": invoke.id,
            "id_location": invoke.id_location,
            "type": invoke.type,
            "type_expr": invoke.type_expr,
            "src": invoke.src,
            "src_expr": invoke.src_expr,
        }
        tree: dict[str, Tree] = {key: text.value for key, text in texts.items() if text is not None}
        if invoke.autoforward:
            tree["autoforward"] = "true"
        if invoke.arguments:
            tree["with"] = arguments(invoke.arguments)
        if invoke.name_list:
            tree["names"] = Short([name.value for name in invoke.name_list])
        if invoke.content is not None:
            tree["content"] = self.chart(invoke.content)
        if invoke.content_expr is not None:
            tree["content_expr"] = invoke.content_expr.value
        if invoke.finalize is not None:
            tree["finalize"] = statements(invoke.finalize)
        return tree


def _done(state: DocState) -> dict[str, Tree]:
    tree: dict[str, Tree] = {}
    if state.done_data:
        tree["with"] = arguments(state.done_data)
    if state.done_content is not None:
        tree["content"] = state.done_content.value
    return tree
