"""Comparison of a network with the explorer: the stable states of both, with data and queues."""

from __future__ import annotations

import re

from fsmkit.export.identifiers import word
from fsmkit.export.uppaal.space import leaves
from fsmkit.export.uppaal.translate import translate
from fsmkit.language import ArrayType, Type, Value
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.statespace.closed_system import ClosedSystem
from tests.export.uppaal_meaning import Meaning
from tests.export.uppaal_rules import problems

Shown = tuple[object, ...]


def compared(closed: ClosedSystem, most: int = 10**6, *, paced: bool = True) -> tuple[int, int]:
    """Demand that both reach the same; return how many stable states and how many verdicts.

    ``paced``: time passes by a template of its own, as in the flat form; else by an urgent channel.
    """
    network = translate(closed, flat=True, paced=paced, draw=False)
    assert list(problems(network)) == []
    meaning = Meaning(network, 0 if closed.untimed else closed.unit)
    states = meaning.reached(most)
    oracle = Oracle(closed)
    found = oracle.run(livelock=False)
    snapshots = [oracle.snapshots(state) for state in oracle.reached]
    ours = {_of_snapshots(closed, meaning, s) for s in snapshots}
    names = [{_leaves(closed, m, s[m]) for s in snapshots} for m in range(len(closed.charts))]
    theirs = {_of_state(closed, meaning, names, s) for s in states if not meaning.is_committed(s)}
    assert theirs == ours, _difference(ours, theirs)
    evaluated = 0
    for number, (property_, query) in enumerate(
        zip(closed.system.properties, network.queries, strict=False)
    ):
        if not query.formula or "-->" in query.formula:
            continue
        kind = property_.kind.key
        mark = found.mark(0 if kind == "deadlock_free" else 1 + number)
        seen = mark is not None
        assert meaning.verdict(query.formula, states) is (seen is (kind == "reachable")), (
            property_.name, query.formula)  # fmt: skip
        evaluated += 1
    return len(ours), evaluated


def _difference(ours: set[Shown], theirs: set[Shown]) -> str:
    def some(found: set[Shown]) -> str:
        return "\n    ".join(map(str, sorted(found, key=str)[:3]))

    return (
        f"\n  only in the explorer ({len(ours - theirs)}):\n    {some(ours - theirs)}"
        f"\n  only in the network ({len(theirs - ours)}):\n    {some(theirs - ours)}"
    )


def _leaves(closed: ClosedSystem, machine: int, snapshot: Snapshot) -> str:
    states = closed.charts[machine].states
    active = (states[s] for s in sorted(snapshot.configuration))
    return "_".join(word(s.id) for s in active if s.is_leaf)


def _queue(snapshot: Snapshot) -> tuple[object, ...]:
    return tuple(
        (o.event, *(int(v) for v in o.payload if isinstance(v, int))) for o in snapshot.queue
    )


def _paths(closed: ClosedSystem, machine: int) -> list[tuple[str, Type]]:
    chart = closed.charts[machine]
    return [
        (path, type_)
        for v in (*chart.data, *chart.outputs)
        for path, type_, _ in leaves(v.name, v.type)
    ]


def _flat(value: Value | None) -> tuple[object, ...]:
    if isinstance(value, tuple):
        return tuple(part for item in value for part in _flat(item))
    return (int(value) if isinstance(value, int) else value,)


def _of_snapshots(closed: ClosedSystem, meaning: Meaning, found: tuple[Snapshot, ...]) -> Shown:
    shown: list[object] = []
    for machine, snapshot in enumerate(found):
        values = {}
        chart = closed.charts[machine]
        for variable, value in zip((*chart.data, *chart.outputs), snapshot.data, strict=True):
            for path, _, part in leaves(variable.name, variable.type, value):
                values[path] = _flat(part)
        # an array of which only elements are shared is compared where they are
        told = [
            values[path]
            for path, _ in _paths(closed, machine)
            if not _partial(closed, machine, path)
        ]
        shown.append(
            (_leaves(closed, machine, snapshot), snapshot.running, tuple(told), _queue(snapshot))
        )
    del meaning
    return tuple(shown)


def _partial(closed: ClosedSystem, machine: int, path: str) -> bool:
    slots = [s for s in closed.system.machines[machine].shared if s.name == path]
    data = next((d for d in closed.charts[machine].data if d.name == path), None)
    is_array = data is not None and isinstance(data.type, ArrayType)
    shared = {s.name for m in closed.system.machines for s in m.shared}
    return path in shared and is_array and data is not None and len(slots) < data.type.length  # type: ignore[union-attr]


def _of_state(
    closed: ClosedSystem, meaning: Meaning, names: list[set[str]], s: tuple[int, ...]
) -> Shown:
    shown: list[object] = []
    for machine, template in enumerate(meaning.network.templates[: len(closed.charts)]):
        name = template.locations[s[machine]].name
        fault = name.endswith("_fault") or "_fault_" in name
        name = re.sub(r"_(range|microsteps|internal|error)_fault(_\d+)?$", "", name)
        for shorter in (name, re.sub(r"_\d+$", "", name), name.rstrip("_")):
            if shorter in names[machine]:
                name = shorter
                break
        values = []
        for path, type_ in _paths(closed, machine):
            if _partial(closed, machine, path):
                continue
            at, one = next(
                meaning.places[scope, known]
                for known in (word(path), f"{word(path)}_", f"{word(path)}_2")
                for scope in (machine, -1)
                if (scope, known) in meaning.places
            )
            values.append(tuple(s[at : at + max(1, one.length)]))
            del type_
        states = closed.charts[machine].states
        top = {word(c.id) for c in states if c.parent == 0 and c.kind.value == "final"}
        running = not fault and name not in top
        shown.append((name, running, tuple(values), _network_queue(closed, meaning, machine, s)))
    return tuple(shown)


def _network_queue(
    closed: ClosedSystem, meaning: Meaning, machine: int, s: tuple[int, ...]
) -> tuple[object, ...]:
    instance = meaning.network.templates[machine].instance
    if (-1, f"{instance}_length") not in meaning.places:
        return ()
    length = s[meaning.places[-1, f"{instance}_length"][0]]
    at = meaning.places[-1, f"{instance}_events"][0]
    numbers = {}
    for event in closed.charts[machine].events:
        found = meaning.places.get((-1, word(f"{instance}_{event.name}")))
        if found is not None and found[1].constant:
            numbers[found[1].init[0]] = event
    shown = []
    for place in range(length):
        event = numbers[s[at + place]]
        lanes = [
            s[meaning.places[-1, f"{instance}_value_{n}"][0] + place]
            for n in range(1, 1 + len(event.fields))
        ]
        shown.append((event.index, *lanes))
    return tuple(shown)
