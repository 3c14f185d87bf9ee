"""Evaluate properties at a global state with the reference interpreter."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from fsmkit.chart.chart import Chart
from fsmkit.language import ContentError, RangeFault, Value, evaluate
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import Property


class World:
    """The environment of a condition: all machines at rest.

    ``owner``: the machine whose names the condition uses; None: its variables are ``atoms``.
    ``occurring``: the events, by machine and number, taken in the step to this state.
    """

    def __init__(
        self,
        charts: Sequence[Chart],
        snapshots: Sequence[Snapshot],
        *,
        owner: int | None = None,
        atoms: Iterable[tuple[str, Atom]] = (),
        occurring: Collection[tuple[int, int]] = (),
    ) -> None:
        self._charts = charts
        self._owner = owner
        self._atoms = dict(atoms)
        self._snapshots = snapshots
        self._occurring = occurring

    def variable(self, name: str) -> Value:
        """Return the value of an atom, or of a variable of the owner."""
        if self._owner is not None:
            return self._value(self._owner, name)
        atom: Atom = self._atoms[name]
        if atom.event is not None:
            return (atom.machine, atom.event) in self._occurring
        if atom.state is not None:
            return atom.state in self._snapshots[atom.machine].configuration
        return self._value(atom.machine, atom.variable)

    def _value(self, machine: int, name: str) -> Value:
        slot = index_of(self._charts[machine]).slots[name]
        snapshot = self._snapshots[machine]
        return snapshot.data[slot] if slot >= 0 else snapshot.inputs[-1 - slot]

    def event_field(self, name: str) -> Value:
        """Reject a field, since there is no current event."""
        raise ContentError(f"there is no event whose `{name}` could be read")

    def event_name(self) -> str:
        """Return the empty name: there is no current event."""
        return ""

    def event_type(self) -> str:
        """Return the empty type: there is no current event."""
        return ""

    def is_in(self, state: int) -> bool:
        """Whether a state of the owner is active."""
        return state in self._snapshots[self._owner or 0].configuration

    def call(self, operation: str, arguments: tuple[Value, ...]) -> Value | None:
        """Reject the call of an operation, which a property cannot make."""
        del arguments
        raise ContentError(f"a property cannot call `{operation}`")

    def range_error(self) -> None:
        """Ignore saturation."""


def evaluate_property(
    charts: Sequence[Chart],
    property_: Property,
    snapshots: Sequence[Snapshot],
    occurring: Collection[tuple[int, int]] = (),
) -> bool:
    """Whether to mark a state: it violates the property, or proves it reachable.

    ``occurring``: the events, by machine and number, taken in the step to it.

    A condition that cannot be evaluated (an index out of range, an argument of a function outside
    the range of a parameter with `fault`) counts as false.
    """
    if property_.condition is None:
        return False
    try:
        world = World(
            charts, snapshots, owner=property_.owner, atoms=property_.atoms, occurring=occurring
        )
        holds = bool(evaluate(property_.condition, world))
    except (ContentError, RangeFault):
        holds = False
    return holds is not property_.is_negated
