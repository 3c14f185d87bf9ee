"""Reduce arrays in the explored C to the elements that a machine uses.

A machine holds all data that its chart declares, so N machines that share an array of N elements
hold N * N. An array is cut if every expression and statement of the chart, and every property,
names its elements by constant indices. The other elements keep their start values forever: no step
of the machine and no wire sets them, as a shared array is wired by the elements that a chart names
(`system.shared.slots_of`). So the map from whole local states to cut ones is one to one and
commutes with each step: the numbers of states and steps, and all paths, stay the same.

Only the C has cut charts. The interpreter, which replays each path and shows values, uses the
original charts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import is_
from typing import Any

from fsmkit.chart.chart import Chart, Data
from fsmkit.language import ArrayType, Element, IntType, Literal, Type, Value, Variable, fold
from fsmkit.language.walk import child_fields, child_getter
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.machine import Machine
from fsmkit.system.properties.condition import Atom
from fsmkit.system.properties.property import Property, evaluated
from fsmkit.verify.statespace.closed_system import ClosedSystem

Used = Mapping[str, tuple[int, ...]]
"""By the name of a variable that is cut: its elements that are kept, in their new order."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A closed system with the arrays of its machines cut, and conversions in both directions."""

    whole: ClosedSystem
    closed: ClosedSystem
    used: tuple[Used, ...]
    """For each machine."""

    def cut(self, machine: int, snapshot: Snapshot) -> Snapshot:
        """Convert a machine of the whole system to one of the cut system."""
        return self._convert(machine, snapshot, lambda _, value, kept: _kept(value, kept))

    def restored(self, machine: int, snapshot: Snapshot) -> Snapshot:
        """Convert a machine of the cut system to one of the whole system."""

        def restored(declared: Data, value: Value, kept: tuple[int, ...]) -> Value:
            whole = list(_elements(declared.init.value))
            for element, own in zip(kept, _elements(value), strict=True):
                whole[element] = own
            return tuple(whole)

        return self._convert(machine, snapshot, restored)

    def _convert(
        self,
        machine: int,
        snapshot: Snapshot,
        change: Callable[[Data, Value, tuple[int, ...]], Value],
    ) -> Snapshot:
        used = self.used[machine]
        if not used:
            return snapshot
        data = list(snapshot.data)
        for place, declared in enumerate(self.whole.charts[machine].data):
            if declared.name in used:
                data[place] = change(declared, data[place], used[declared.name])
        return replace(snapshot, data=tuple(data))


def cut_arrays(closed: ClosedSystem) -> Cut:
    """Return a closed system whose arrays are cut to the elements that each machine uses."""
    found = _Uses(closed)
    used = tuple(found.of(machine) for machine in range(len(closed.charts)))
    if not any(used):
        return Cut(closed, closed, used)
    made: dict[tuple[int, tuple[tuple[str, tuple[int, ...]], ...]], Chart] = {}
    charts = []
    for chart, own in zip(closed.charts, used, strict=True):
        key = id(chart), tuple(own.items())
        if key not in made:
            made[key] = _chart(chart, own) if own else chart
        charts.append(made[key])
    pairs = zip(closed.system.machines, used, strict=True)
    system = replace(
        closed.system,
        machines=tuple(_machine(machine, own) for machine, own in pairs),
        properties=tuple(_property(one, used) for one in closed.system.properties),
    )
    return Cut(closed, replace(closed, system=system, charts=tuple(charts)), used)


# --- uses -----------------------------------------------------------------------------------------


class _Uses:
    """The elements of arrays that charts and properties name."""

    def __init__(self, closed: ClosedSystem) -> None:
        self._closed = closed
        self._by_chart: dict[int, dict[str, list[int] | None]] = {}
        self._looked_at: dict[int, dict[str, list[int] | None]] = {}
        for property_ in evaluated(closed.system.properties):
            self._property(property_)
        for link in closed.system.input_links:
            chart = closed.charts[link.source]
            first = len(chart.outputs) + len(closed.system.machines[link.source].shared)
            if link.output >= first:  # a wire starts at any of the data
                name = chart.data[link.output - first].name
                self._looked_at.setdefault(link.source, {})[name] = None

    def _property(self, property_: Property) -> None:
        if property_.condition is None:
            return
        if property_.owner is not None:
            into = self._looked_at.setdefault(property_.owner, {})
            _note(property_.condition, into)
            return
        meant = {name: (atom.machine, atom.variable) for name, atom in property_.atoms}
        read: dict[str, list[int] | None] = {}
        _note(property_.condition, read)
        for name, elements in read.items():
            if name in meant:
                machine, variable = meant[name]
                _join(self._looked_at.setdefault(machine, {}), variable, elements)

    def of(self, machine: int) -> Used:
        """Return the arrays of a machine to cut, each with the remaining elements."""
        chart = self._closed.charts[machine]
        arrays = [d for d in chart.data if isinstance(d.type, ArrayType)]
        if not arrays or chart.invocations or chart.copies or self._closed.is_open:
            return {}
        if id(chart) not in self._by_chart:
            own: dict[str, list[int] | None] = {}
            _note(replace(chart, data=()), own)
            self._by_chart[id(chart)] = own
        found = {}
        for declared in arrays:
            named: dict[str, list[int] | None] = {}
            for source in (self._by_chart[id(chart)], self._looked_at.get(machine, {})):
                if declared.name in source:
                    _join(named, declared.name, source[declared.name])
            for slot in self._closed.system.machines[machine].shared:
                if slot.name == declared.name:
                    _join(named, slot.name, None if slot.element is None else [slot.element])
            elements = named.get(declared.name, [])
            assert isinstance(declared.type, ArrayType)  # noqa: S101
            if elements is not None and max(len(elements), 1) < declared.type.length:
                found[declared.name] = tuple(elements) or (0,)
        return found


def _join(into: dict[str, list[int] | None], name: str, elements: list[int] | None) -> None:
    known = into.setdefault(name, [])
    if elements is None or known is None:
        into[name] = None
    else:
        known += [element for element in elements if element not in known]


def _note(node: object, into: dict[str, list[int] | None]) -> None:
    """Record the elements of each variable that are named below a node; None: it is used whole.

    Elements are in the order of their first occurrence, so that charts which differ in indices only
    remain equal.
    """
    left: list[Any] = [node]
    while left:
        part = left.pop()
        kind = part.__class__
        if kind is tuple:
            left += part[::-1]
        elif kind is Element:
            index = _known_index(part)
            _join(into, part.array.name, None if index is None else [index])
            left.append(part.index)
        elif kind is Variable:
            _join(into, part.name, None)
        elif (take := child_getter(kind)) is not None:
            left += take(part)[::-1]


def _known_index(element: Element) -> int | None:
    """Return the index of an element if it is a constant within the array."""
    index = fold(element.index)
    array = element.array.type
    if not isinstance(index, Literal) or type(index.value) is not int:
        return None
    is_within = isinstance(array, ArrayType) and 0 <= index.value < array.length
    return index.value if is_within else None


# --- cutting --------------------------------------------------------------------------------------


def _chart(chart: Chart, used: Used) -> Chart:
    data = tuple(_data(declared, used) for declared in chart.data)
    changed: Chart = _renumber(chart, used)
    return replace(changed, data=data)


def _data(declared: Data, used: Used) -> Data:
    if declared.name not in used:
        return declared
    type_ = _type(declared.type, used[declared.name])
    value = _kept(declared.init.value, used[declared.name])
    return replace(declared, type=type_, init=replace(declared.init, value=value, type=type_))


def _type(whole: Type, elements: tuple[int, ...]) -> ArrayType:
    assert isinstance(whole, ArrayType)  # noqa: S101
    return replace(whole, length=len(elements))


def _kept(value: Value, elements: tuple[int, ...]) -> tuple[Value, ...]:
    whole = _elements(value)
    return tuple([whole[element] for element in elements])


def _elements(value: Value) -> tuple[Value, ...]:
    assert isinstance(value, tuple)  # noqa: S101
    return value


def _renumber(node: Any, used: Used) -> Any:
    """Return a node with the new indices of elements of cut arrays; unchanged without any."""
    kind = node.__class__
    if kind is tuple:
        parts = tuple([_renumber(part, used) for part in node])
        return node if all(map(is_, parts, node)) else parts
    if kind is Element and node.array.name in used:
        elements = used[node.array.name]
        index = _known_index(node)
        assert index is not None  # noqa: S101  (else it is not cut)
        place = elements.index(index)
        array = replace(node.array, type=_type(node.array.type, elements))
        literal = Literal(place, IntType(place, place), node.index.span)
        return replace(node, array=array, index=literal)
    changes = {}
    for name in child_fields(kind):
        part = getattr(node, name)
        changed = _renumber(part, used)
        if changed is not part:
            changes[name] = changed
    return replace(node, **changes) if changes else node


def _machine(machine: Machine, used: Used) -> Machine:
    if not used:
        return machine
    shared = tuple(
        replace(slot, element=used[slot.name].index(slot.element))
        if slot.name in used and slot.element is not None
        else slot
        for slot in machine.shared
    )
    return replace(machine, shared=shared)


def _property(property_: Property, used: Sequence[Used]) -> Property:
    goal = property_.goal
    if goal is not None:
        goal = replace(goal, expression=_renumber(goal.expression, _used_atoms(goal.atoms, used)))
    own = _used_atoms(property_.atoms, used)
    if property_.owner is not None:
        own = used[property_.owner]
    condition = property_.condition
    if condition is not None and own:
        condition = _renumber(condition, own)
    return replace(property_, condition=condition, goal=goal)


def _used_atoms(atoms: Sequence[tuple[str, Atom]], used: Sequence[Used]) -> Used:
    """Return the used parts of the variables of a condition."""
    return {
        name: used[atom.machine][atom.variable]
        for name, atom in atoms
        if atom.variable in used[atom.machine]
    }
