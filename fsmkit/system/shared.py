"""Shared data of a system file: each machine that names a variable has a copy of it.

``shared: {turn: 0..3 = 0}``. A chart declares shared variables under ``data`` like its own; the
system names the shared ones. An assignment in one machine updates all copies in the same step.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import fsmkit.language as lang
from fsmkit.chart.chart import Chart, Data
from fsmkit.chart.content import all_statements, samples_inputs, written
from fsmkit.diagnostics import Findings, Text
from fsmkit.diagnostics.fixes import remove_entry
from fsmkit.document.document import Kind, Trigger
from fsmkit.language.constants import start_value
from fsmkit.language.statements.reading import read_typed
from fsmkit.language.walk import nodes, root
from fsmkit.system.machine import InputLink, Machine, Slot
from fsmkit.yaml.nodes import Node, entries_of, require_text


def read_shared(
    node: Node | None, machines: tuple[Machine, ...], scope: lang.Scope, findings: Findings
) -> tuple[Machine, ...]:
    """Return the machines with their shared variables; types are read in ``scope``."""
    for name, value in entries_of(node, "`shared`", findings):
        text = require_text(value, f"the shared variable `{name}`", findings)
        init = None if text is None else _start_value(name, text, scope, findings)
        if init is not None:
            machines = _bind(name, init, machines, findings)
    return machines


def _start_value(
    name: Text, text: Text, scope: lang.Scope, findings: Findings
) -> lang.Literal | None:
    """Return the start value of a variable, with its type."""
    written, init = read_typed(text, findings)
    if written is None and init is None:
        return None
    type_ = None if written is None else lang.read_type(written, scope, findings)
    if written is not None and type_ is None:
        return None
    if init is not None:
        found = start_value(init, type_, scope, findings)
    else:
        found = None if type_ is None else lang.Literal(lang.default_value(type_), type_, name.span)
    if found is None:
        return None
    inner = found.type.element if isinstance(found.type, lang.ArrayType) else found.type
    if isinstance(inner, lang.RecordType | lang.SymbolType | lang.ArrayType):
        findings.add(
            "connection-mismatch",
            f"`{name}` cannot be shared: `{found.type}`",
            text,
            help="share numbers, truth values, enumerations, and arrays of them",
        )
        return None
    return found


def _bind(
    name: Text, init: lang.Literal, machines: tuple[Machine, ...], findings: Findings
) -> tuple[Machine, ...]:
    found = []
    for machine in machines:
        place = next((n for n, d in enumerate(machine.chart.data) if d.name == name.value), None)
        if place is None:
            found.append(machine)
            continue
        own = machine.chart.data[place]
        if own.type != init.type:
            findings.add(
                "connection-mismatch",
                f"`{name}` is `{init.type}` here, but `{own.type}` in `{machine.name}`",
                name,
                secondary=[(own.span, "declared here")],
                help="give both the same type",
            )
        slots = tuple(slots_of(machine.chart, own, place))
        chart = machine.chart if own.init == init else _with_start_value(machine.chart, place, init)
        found.append(replace(machine, chart=chart, shared=(*machine.shared, *slots)))
    if not any(slot.name == name.value for machine in found for slot in machine.shared):
        findings.add(
            "unshared-data",
            f"no machine uses `{name}`",
            name,
            help=f"declare `{name}` under `data` of a chart, and use it there",
            fixes=remove_entry(name),
        )
    return tuple(found)


def _with_start_value(chart: Chart, place: int, init: lang.Literal) -> Chart:
    changed = replace(chart.data[place], init=init)
    return replace(chart, data=(*chart.data[:place], changed, *chart.data[place + 1 :]))


def slots_of(chart: Chart, data: Data, place: int) -> list[Slot]:
    """Return the elements of a variable in a machine: of an array only those that it names.

    It names all of them if an index is not constant.
    """
    named = [
        n
        for n in nodes((chart.states, chart.transitions, chart.script))
        if (isinstance(n, lang.Variable) and n.name == data.name)
        or (isinstance(n, lang.Element) and n.array.name == data.name)
    ]
    if not named:
        return []
    if not isinstance(data.type, lang.ArrayType):
        return [Slot(data.name, place)]
    elements = [_known_index(n) for n in named if isinstance(n, lang.Element)]
    whole = len(named) - len(elements) > len(elements) or None in elements
    indices = range(data.type.length) if whole else sorted(set(elements) - {None})  # type: ignore[type-var]
    return [Slot(data.name, place, index) for index in indices if index is not None]


def _known_index(element: lang.Element) -> int | None:
    index = lang.fold(element.index)
    array = element.array.type
    if not isinstance(index, lang.Literal) or not isinstance(index.value, int):
        return None
    length = array.length if isinstance(array, lang.ArrayType) else 0
    return int(index.value) if 0 <= index.value < length else None


def shared_links(machines: Sequence[Machine]) -> tuple[InputLink, ...]:
    """Return the wires from each assigned copy to all others.

    Shared variables are counted after the outputs, and after the inputs, of a machine.
    """
    holders: dict[tuple[str, int | None], list[tuple[int, int]]] = {}
    for number, machine in enumerate(machines):
        for place, slot in enumerate(machine.shared):
            holders.setdefault((slot.name, slot.element), []).append((number, place))
    changed = [_written(machine.chart) for machine in machines]
    return tuple(
        InputLink(
            source,
            len(machines[source].chart.outputs) + place,
            target,
            len(machines[target].chart.inputs) + other,
        )
        for (name, _), found in holders.items()
        for source, place in found
        if name in changed[source]
        for target, other in found
        if target != source
    )


def _written(chart: Chart) -> frozenset[str]:
    """Return the names of all variables that a chart assigns."""
    return frozenset(root(p).name for s in all_statements(chart) for p in written(s))


# --- values ---------------------------------------------------------------------------------------


def slot_value(slot: Slot, data: tuple[lang.Value, ...]) -> lang.Value:
    """Return the value of a shared variable in the data of a machine."""
    value = data[slot.data]
    if slot.element is None:
        return value
    assert isinstance(value, tuple)  # noqa: S101  (an array)
    return value[slot.element]


def with_slot(
    slot: Slot, data: tuple[lang.Value, ...], value: lang.Value
) -> tuple[lang.Value, ...]:
    """Return the data of a machine with another value of a shared variable."""
    if slot.element is not None:
        array = data[slot.data]
        assert isinstance(array, tuple)  # noqa: S101  (an array)
        value = (*array[: slot.element], value, *array[slot.element + 1 :])
    return (*data[: slot.data], value, *data[slot.data + 1 :])


def written_value(
    machine: Machine, chart: Chart, data: tuple[lang.Value, ...], number: int
) -> lang.Value:
    """Return the value of a wire: an output, then a shared variable, then any of the data."""
    if number < len(chart.outputs):
        return data[len(chart.data) + number]
    number -= len(chart.outputs)
    if number >= len(machine.shared):
        return data[number - len(machine.shared)]
    return slot_value(machine.shared[number], data)


def kept_at_start(machine: Machine, data: tuple[lang.Value, ...]) -> Mapping[int, lang.Value]:
    """Return the data that a machine does not set to their start values when it starts."""
    return {slot.data: data[slot.data] for slot in machine.shared}


def type_of_slot(chart: Chart, slot: Slot) -> lang.Type:
    """Return the type of a shared variable, or of its element."""
    type_ = chart.data[slot.data].type
    return (
        type_.element if slot.element is not None and isinstance(type_, lang.ArrayType) else type_
    )


def reads_shared(machine: Machine, guards: Iterable[lang.Expr | None]) -> bool:
    """Whether a guard reads a shared variable."""
    names = {slot.name for slot in machine.shared}
    return any(
        isinstance(n, lang.Variable) and n.name in names for guard in guards for n in nodes(guard)
    )


def has_data_trigger(machine: Machine, chart: Chart) -> bool:
    """Whether an eventless guard reads external data, so that a change may enable it at once."""
    return samples_inputs(chart) or reads_shared(
        machine, [t.guard for t in chart.transitions if t.trigger is Trigger.EVENTLESS]
    )


def resting_states(chart: Chart, machine: Machine) -> frozenset[int]:
    """Return the leaves in which a machine may wait forever: marked, in a marked state, or final.

    A monitor may wait anywhere.
    """
    if machine.is_monitor:
        return frozenset(range(len(chart.states)))
    marked = [False] * len(chart.states)
    for state in chart.states:  # parents come before their children
        marked[state.index] = state.rest or (state.parent is not None and marked[state.parent])
    return frozenset(
        state.index for state in chart.states if state.kind is Kind.FINAL or marked[state.index]
    )
