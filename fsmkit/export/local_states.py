"""Name the local states of a machine, and describe them.

A name is the active leaves, with a number if several local states have the same; the description
adds the distinguishing facts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from fsmkit.chart.chart import OPEN_ENDED, Chart
from fsmkit.document.document import Kind
from fsmkit.emit import plain, telling
from fsmkit.export.identifiers import Names, word
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Delayed, Snapshot, Timeout, Timer
from fsmkit.verify.report.counterexample import occurrence_text

Key = tuple[str, object]
"""A component: its name, and what distinguishes it from others of that name."""
ARMED_FIRST: Key = ("armed_first", None)
"""The order in which timers were armed: a component only if the others do not imply it."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A component in one local state. ``rank`` orders its values."""

    rank: tuple[int, float | str]
    text: str


def in_order(chart: Chart, snapshots: Sequence[Snapshot]) -> list[Snapshot]:
    """Return local states in the order of the chart; those that differ in time in sequence."""
    return sorted(snapshots, key=lambda snapshot: _key(chart, snapshot))


def _key(chart: Chart, snapshot: Snapshot) -> tuple[object, ...]:
    return (
        not snapshot.running,
        sorted(snapshot.configuration),
        [*_texts(chart, snapshot, untimed=True)],
        [-timer.deadline for timer in snapshot.timers],
        repr(snapshot.invoked),
    )


def names_and_texts(chart: Chart, snapshots: Sequence[Snapshot]) -> list[tuple[str, str]]:
    """Return for each local state a unique identifier, and its description."""
    groups: dict[str, list[Snapshot]] = {}
    for snapshot in snapshots:
        groups.setdefault(shown_leaves(chart, snapshot), []).append(snapshot)
    found: dict[Snapshot, tuple[str, str]] = {}
    names = Names()
    for leaves, group in groups.items():
        facts = [list(_texts(chart, snapshot)) for snapshot in group]
        common = set.intersection(*map(set, facts))
        for number, (snapshot, own) in enumerate(zip(group, facts, strict=True)):
            base = word(leaves)
            name = names.take(base if len(group) == 1 else f"{base}_{number}")
            more = ", ".join(fact for fact in own if fact not in common)
            found[snapshot] = name, f"{leaves} [{more}]" if more else leaves
    return [found[snapshot] for snapshot in snapshots]


def _texts(chart: Chart, snapshot: Snapshot, *, untimed: bool = False) -> Iterator[str]:
    for (name, _), fact in facts_of(chart, snapshot, untimed=untimed):
        if name != ARMED_FIRST[0]:
            yield f"{plain(name)}: {plain(fact.text)}"


@telling
def shown_leaves(chart: Chart, snapshot: Snapshot) -> str:
    """Return the active leaves, or that the machine has stopped."""
    if snapshot.fault is not None:
        return f"fault {snapshot.fault}"
    leaves = [chart.states[s].id for s in sorted(snapshot.configuration) if chart.states[s].is_leaf]
    active = "+".join(leaves) or "stopped"
    return active if snapshot.running else f"{active} finished"


def facts_of(
    chart: Chart, snapshot: Snapshot, *, untimed: bool = False
) -> Iterator[tuple[Key, Fact]]:
    """Yield the components of a local state; ``untimed``: without the deadlines of timers."""
    if not snapshot.running:
        why = Fact((0, snapshot.fault or ""), snapshot.fault or "finished")
        yield ("stopped", None), why
    yield from _regions(chart, snapshot)
    tick = chart.capacities.tick
    declared = (*chart.data, *chart.outputs, *chart.inputs)
    for variable, value in zip(declared, (*snapshot.data, *snapshot.inputs), strict=True):
        rank = value if isinstance(value, int | float) else repr(value)
        text = show(value, variable.type, tick)
        yield (variable.name, variable), Fact((isinstance(rank, str), rank), text)
    for state, past in snapshot.history:
        ids = "_".join(chart.states[s].id for s in sorted(past) if chart.states[s].is_leaf)
        yield ("past of " + chart.states[state].id, None), Fact((0, repr(sorted(past))), ids)
    yield from _timers(chart, snapshot, untimed=untimed)
    if snapshot.queue or snapshot.deferred:
        waiting = (snapshot.deferred, snapshot.queue)
        text = " then ".join(" ".join(occurrence_text(chart, o) for o in part) for part in waiting)
        yield ("waiting", None), Fact((0, repr(waiting)), text)
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            yield (invocation.id + " runs", None), Fact((0, 0), "here")
            for (name, what), fact in facts_of(invocation.chart, child, untimed=untimed):
                yield (invocation.id + " " + name, (invocation.id, what)), fact


def _regions(chart: Chart, snapshot: Snapshot) -> Iterator[tuple[Key, Fact]]:
    """Yield the state of each active region: a leaf, or one that is divided further."""
    for state in sorted(snapshot.configuration):
        parent = chart.states[state].parent
        if parent is not None and chart.states[parent].kind is not Kind.PARALLEL:
            continue
        inner = state
        while chart.states[inner].kind is not Kind.PARALLEL:
            active = [s for s in chart.states[inner].children if s in snapshot.configuration]
            if not active:
                break
            (inner,) = active
        name = "state" if parent is None else chart.states[state].id
        yield (name, state), Fact((0, inner), chart.states[inner].id)


def _timers(chart: Chart, snapshot: Snapshot, *, untimed: bool) -> Iterator[tuple[Key, Fact]]:
    """Yield the remaining time of each timer (untimed: that it is armed), and their order."""
    order: list[Key] = []
    armed: list[Timeout | Delayed] = []
    for timer in snapshot.timers:
        alike = sum(what == timer.what for what in armed)
        armed.append(timer.what)
        key = timer_text(chart, timer), (timer.what, alike)
        left = timer.deadline - snapshot.now
        due = f"in {left}" if left < OPEN_ENDED else f"in {left - OPEN_ENDED} or later"
        yield key, Fact((0, left), "armed" if untimed else due)
        order.append(key)
    yield ARMED_FIRST, Fact((0, repr(order)), " ".join(name for name, _ in order) or "none")


@telling
def timer_text(chart: Chart, timer: Timer) -> str:
    """Return a description of a timer."""
    match timer.what:
        case Timeout(transition):
            return f"timeout of {chart.states[chart.transitions[transition].source].id}"
        case Delayed(occurrence):
            return f"delayed {occurrence_text(chart, occurrence)}"
