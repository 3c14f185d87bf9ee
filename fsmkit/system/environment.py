"""Read the environment of a system file: events that may occur, and machines that will move.

``may: [feeder.estop, "feeder.fault(code in {jam, stall})"]`` for events, ``may: [feeder.blocked,
"feeder.temp in 0..99"]`` for inputs, ``will: [plant, feeder.resume]``, ``world: [plant]``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import fsmkit.language as lang
from fsmkit.chart.analysis.partition import COMBINED, Partition, Place, Use, Values
from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, Fix, Text
from fsmkit.diagnostics.fixes import add_nested_items, remove_entry
from fsmkit.document.document import Direction
from fsmkit.document.keys import ENVIRONMENT
from fsmkit.document.lists import split_items
from fsmkit.system.connections import find_machine, names_of_events, report_duplicate
from fsmkit.system.indices import INDEXED, expand_indices
from fsmkit.system.machine import FreeInput, Machine, Possible
from fsmkit.system.partition import field_of, partition_of
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Node, require_record, texts_of

ITEM = re.compile(rf"\s*({INDEXED})\s*(?:\.\s*([A-Za-z_][\w.]*)\s*(?:\((.*)\))?)?\s*", re.DOTALL)
INPUT = re.compile(rf"\s*({INDEXED})\s*\.\s*(([A-Za-z_]\w*)\s*(?:=(?!=)|in\b).*)", re.DOTALL)
ONE_OF = re.compile(r"\s*([A-Za-z_]\w*)\s+in\s*\{(.*)\}\s*", re.DOTALL)
RANGE = re.compile(r"\s*([A-Za-z_]\w*)\s+in\s+(\S+?)\s*\.\.\s*(\S+)\s*")
EXACTLY = re.compile(r"\s*([A-Za-z_]\w*)\s*=(?!=)(.*)", re.DOTALL)


Given = tuple[lang.Value, ...] | lang.IntType
"""The values that a file names: one by one, or from a least to a greatest."""


@dataclass(frozen=True, slots=True)
class Named:
    """An external event, and the field values that the file names."""

    machine: int
    event: int
    fair: bool
    values: Mapping[str, Given]


@dataclass(frozen=True, slots=True)
class Environment:
    """The machines of the environment, the external events and the free inputs.

    Events and inputs are keyed by machine and number; the values are the location in the file and
    the values named there.
    """

    machines: frozenset[int]
    named: tuple[Named, ...]
    inputs: Mapping[tuple[int, int], tuple[Text, Given | None]]
    freezes: Node | None = None
    """The nodes that may freeze, unread (see `system.freezes`)."""


def read_environment(
    node: Node | None, machines: tuple[Machine, ...], findings: Findings
) -> Environment:
    """Read the environment."""
    parts = require_record(node, ENVIRONMENT, "`environment`", findings) or {}
    own: set[int] = set()
    named: list[Named] = []
    inputs: dict[tuple[int, int], tuple[Text, Given | None]] = {}
    freezes = parts.pop("freezes", None)
    for key, value in parts.items():
        for text in texts_of(value, f"`{key}`", "what can happen", findings):
            for one in expand_indices(text, machines):
                if key == "world":
                    own |= _world(one, machines, findings)
                else:
                    _item(one, machines, key == "will", own, named, inputs, findings)
    return Environment(frozenset(own), tuple(named), inputs, freezes)


def _world(text: Text, machines: tuple[Machine, ...], findings: Findings) -> set[int]:
    """Return the named machine, if there is one, as a set."""
    match = ITEM.fullmatch(text.value)
    if match is None or match[2] is not None:
        findings.add(
            "broken-connection",
            "of the world are whole machines",
            text,
            help="write `world: [plant]`; events and inputs belong under `may` or `will`",
        )
        return set()
    found = find_machine(text.part(*match.span(1)), machines, findings)
    return set() if found is None else {found}


def _item(
    text: Text,
    machines: tuple[Machine, ...],
    fair: bool,
    own: set[int],
    named: list[Named],
    inputs: dict[tuple[int, int], tuple[Text, Given | None]],
    findings: Findings,
) -> None:
    match = ITEM.fullmatch(text.value) or INPUT.fullmatch(text.value)
    if match is None:
        findings.add(
            "broken-connection",
            "the environment has events of machines, and inputs that change",
            text,
            help="write `feeder.estop`, `feeder.fault(code in {jam})` or `feeder.temp in 0..99`",
        )
        return
    machine = find_machine(text.part(*match.span(1)), machines, findings)
    if machine is None:
        return
    if match[2] is None:
        own.add(machine)
        if not fair:
            findings.add(
                "machine-that-may",
                f"a machine of the environment, like `{match[1]}`, belongs under `will`",
                text,
                help="name it under `will`; what it may do are its `sometimes` transitions",
                fixes=_fix_moving(text, "will"),
            )
        return
    chart = machines[machine].chart
    name = text.part(*match.span(3 if match.re is INPUT else 2))
    place = next((n for n, i in enumerate(chart.inputs) if i.name == name.value), None)
    index = None if match.re is INPUT else chart.event_index.get(name.value)
    if place is not None and index is None:
        part = text.part(*match.span(2)) if match.re is INPUT else None
        values: dict[str, Given] = {}
        declared = lang.Field(name.value, chart.inputs[place].type)
        if part is not None:
            _argument(chart, (declared,), part, values, findings)
        if _is_free(machines[machine], declared, name, findings, fair=fair):
            if (machine, place) in inputs:
                report_duplicate("named", text, inputs[machine, place][0], findings)
            inputs[machine, place] = text, values.get(name.value)
        return
    if index is None or Direction.IN not in chart.events[index].directions:
        known = [*names_of_events(chart, Direction.IN), *(i.name for i in chart.inputs)]
        findings.add(
            "unknown-name",
            f"no event `{name}` enters `{machines[machine].name}`, nor has it such an input",
            name,
            help=f"use one of {', '.join(known)}" if known else None,
        )
        return
    arguments = text.part(*match.span(3)) if match[3] is not None else None
    values = {}
    for part in split_items(arguments) if arguments is not None else ():
        _argument(chart, chart.events[index].fields, part, values, findings)
    named.append(Named(machine, index, fair, values))


def _fix_moving(text: Text, key: str, item: str | None = None) -> tuple[Fix, ...]:
    """Return the fix that moves an item of the environment to the other key."""
    added = add_nested_items(text.span.source, "environment", key, [item or text.value.strip()])
    taken = [edit for fix in remove_entry(text) for edit in fix.edits]
    return (Fix(f"Move it under `{key}`", (*added, *taken)),) if added and taken else ()


def _is_free(
    machine: Machine, declared: lang.Field, name: Text, findings: Findings, *, fair: bool
) -> bool:
    """Return whether an input can be free; otherwise report why not."""
    if fair:
        findings.add(
            "input-that-will",
            f"the input `{name}` of `{machine.name}` may change, but never has to",
            name,
            help=f"name it under `may`: `may: [{machine.name}.{name}]`",
            fixes=_fix_moving(name, "may", f"{machine.name}.{name}"),
        )
    elif isinstance(declared.type, lang.ArrayType | lang.RecordType | lang.SymbolType):
        findings.add(
            "connection-mismatch",
            f"`{name}` cannot be a free input: `{declared.type}`",
            name,
            help="declare numbers, truth values or enumerations",
        )
    else:
        return True
    return False


def with_environment(system: System, environment: Environment, findings: Findings) -> System:
    """Return a system whose environment sends one value for each behaviour it can cause."""
    driven = {(link.target, link.input) for link in system.input_links}
    for at, (text, _) in environment.inputs.items():
        if at in driven:
            machine = system.machines[at[0]]
            findings.add(
                "duplicate-connection",
                f"an output sets `{machine.name}.{machine.chart.inputs[at[1]].name}` already",
                text,
                help="remove the connection, or this line",
                fixes=remove_entry(text),
            )
    partition = partition_of(system)
    possible: list[Possible] = []
    sampled: dict[str, Use] = {}
    for named in environment.named:
        machine = system.machines[named.machine]
        event = machine.chart.events[named.event]
        columns = []
        for part, field in enumerate(event.fields):
            place = field_of(named.machine, named.event, part)
            values = values_within(partition, field, place, named.values.get(field.name))
            if values.kept is not None:
                sampled[f"`{field.name}` of `{machine.name}.{event.name}`"] = values.kept
            columns.append(values.values)
        possible.extend(
            Possible(named.machine, named.event, payload, named.fair)
            for payload in product(*columns)
        )
    free = []
    for (number, input_), (_, given) in environment.inputs.items():
        machine = system.machines[number]
        declared = machine.chart.inputs[input_]
        place = Place(number, "variable", declared.name)
        values = values_within(partition, lang.Field(declared.name, declared.type), place, given)
        if values.kept is not None:
            sampled[f"the input `{machine.name}.{declared.name}`"] = values.kept
        any_start = declared.name in machine.any_start
        free.append(FreeInput(number, input_, values.values, any_start=any_start))
    for number, machine in enumerate(system.machines):
        for input_, declared in enumerate(machine.chart.inputs):
            if declared.name in machine.any_start and (number, input_) not in environment.inputs:
                free.append(FreeInput(number, input_, (), any_start=True))
    return replace(
        system,
        possible=tuple(possible),
        free_inputs=tuple(free),
        sampled=tuple(sampled.items()),
    )


def values_within(
    partition: Partition, field: lang.Field, place: Place, given: Given | None
) -> Values:
    """Return the values of a field to try, restricted to the given ones if there are any."""
    if isinstance(given, tuple):
        return Values(given)
    values = partition.values(given or field.type, place)
    if given is None or values.kept is None or given.hi - given.lo >= COMBINED:
        return values
    return Values(tuple(range(given.lo, given.hi + 1)))


def _argument(
    chart: Chart,
    fields: tuple[lang.Field, ...],
    text: Text,
    given: dict[str, Given],
    findings: Findings,
) -> None:
    one_of = ONE_OF.fullmatch(text.value)
    range_ = RANGE.fullmatch(text.value)
    exactly = EXACTLY.fullmatch(text.value)
    match = one_of or range_ or exactly
    if match is None:
        findings.add(
            "broken-connection",
            "a field is given as `name in {a, b}`, `name in lo..hi` or `name = value`",
            text.strip(),
            help="for instance `temp in 0..500`, `temp in {0, 500}`",
        )
        return
    field = next((f for f in fields if f.name == match[1]), None)
    if field is None:
        findings.add(
            "unknown-name", f"the event has no field `{match[1]}`", text.part(*match.span(1))
        )
        return
    groups = [2, 3] if match is range_ else [2]
    texts = [text.part(*match.span(group)) for group in groups]
    if match is one_of:
        texts = split_items(texts[0])
    values = [_value(chart, field, part.strip(), findings) for part in texts]
    found = [value for value in values if value is not None]
    if match is range_ and len(found) == 2:
        low, high = found
        if isinstance(low, int) and isinstance(high, int) and low <= high:
            given[field.name] = lang.IntType(low, high)
            return
    given[field.name] = tuple(found)


def _value(chart: Chart, field: lang.Field, text: Text, findings: Findings) -> lang.Value | None:
    scope = lang.Scope(
        constants=dict(chart.constants),
        types={str(type_): type_ for type_ in chart.types},
        tick=chart.capacities.tick,
    )
    expression = lang.type_expression(text, scope, findings, field.type)
    folded = None if expression is None else lang.fold(expression)
    if folded is not None and not isinstance(folded, lang.Literal):
        findings.add("connection-mismatch", "this must be a constant", text)
        return None
    return None if folded is None else folded.value
