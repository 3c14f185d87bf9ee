"""Writing of states as YAML."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import field as dataclass_field

from fsmkit.diagnostics import Text, fail
from fsmkit.document import keys
from fsmkit.document.document import HISTORIES, DocInvoke, DocState, Document, DocUse, Kind
from fsmkit.yaml.layout import Short, Tree
from fsmkit.yaml.states import ARRAY
from fsmkit.yaml.transition_writer import exit_point, initial, transitions
from fsmkit.yaml.writing import arguments, mapping, write_keys

SMALL = 60
"""A state is written on one line up to this length."""


@dataclass
class StateWriter:
    """Writes the states of one document; a state without an id gets its implied id."""

    document: Document
    chart: Callable[[Document], dict[str, Tree]]
    """Writes an inline chart of an ``invoke``."""
    taken: set[str] = dataclass_field(default_factory=set)

    def __post_init__(self) -> None:
        """Collect the written ids."""
        pending = [*self.document.root.children, *self.document.refine]
        while pending:
            state = pending.pop()
            pending += state.children
            if state.id is not None:
                self.taken.add(state.id.value)

    def states(self, states: tuple[DocState, ...], parent: str) -> dict[str, Tree]:
        """Return states by name; ``parent`` is the id of their parent, ``state`` for the root."""
        named = [(self._id(state, parent, n), state) for n, state in enumerate(states, 1)]
        return mapping(
            (_key(name, state), Short(self._state(name, state), SMALL)) for name, state in named
        )

    def _id(self, state: DocState, parent: str, number: int) -> Text:
        """Return the id of a state, or the id that elaboration would generate."""
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
        if state.use is not None:
            own |= _use(state.use)
        if done := write_keys(state, keys.DONE):
            own["done"] = done
        if state.initial is not None:
            own["default" if is_history else "initial"] = initial(state.initial)
        tree = write_keys(state, keys.STATE, own)
        tree |= transitions(state.transitions, is_choice=state.kind is Kind.CHOICE)
        if state.kind is Kind.PARALLEL or state.kind is Kind.COMPOUND or state.children:
            key = "regions" if state.kind is Kind.PARALLEL else "states"
            tree[key] = self.states(state.children, name.value)
        return tree

    def _invoke(self, invoke: DocInvoke) -> dict[str, Tree]:
        chart = {} if invoke.content is None else {"content": self.chart(invoke.content)}
        return write_keys(invoke, keys.INVOKE, chart)


def _key(name: Text, state: DocState) -> Text:
    """Return the key of a state; an array of copies includes its index."""
    if state.index_range is None:
        if ARRAY.fullmatch(name.value):
            raise fail(
                "not-expressible",
                f"the id `{name}` would be an array of copies in YAML",
                name,
                help="rename the state",
            )
        return name
    return Text(f"{name}[{state.index_range}]", name.span, ())


def _use(use: DocUse) -> dict[str, Tree]:
    """Return the keys of a using state."""
    tree: dict[str, Tree] = {}
    if use.chart is not None:
        tree["use"] = Short(write_keys(use, keys.USE)) if use.reset else use.chart.value
    elif use.reset:
        tree["use"] = Short(write_keys(use, keys.USE))
    for key, field in keys.USED.items():
        if pairs := getattr(use, field):
            tree[key] = Short(arguments(pairs))
    if use.exits:
        tree["exits"] = mapping((one.name, exit_point(one.transitions)) for one in use.exits)
    return tree
