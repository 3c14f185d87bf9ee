"""Names for the local states of a machine, and what they mean.

A name is the active leaves, with a number where several local states have the same; the text adds
what tells those apart.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from fsmkit.chart.chart import OPEN_ENDED, Chart
from fsmkit.export.identifiers import word
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.snapshot import Delayed, Snapshot, Timeout, Timer
from fsmkit.texts import telling
from fsmkit.verify.report.counterexample import occurrence_text


def in_order(chart: Chart, snapshots: Sequence[Snapshot]) -> list[Snapshot]:
    """Return local states in the order of the chart; those that time runs through in sequence."""
    return sorted(snapshots, key=lambda snapshot: _key(chart, snapshot))


def _key(chart: Chart, snapshot: Snapshot) -> tuple[object, ...]:
    return (
        not snapshot.running,
        sorted(snapshot.configuration),
        [str(part) for part in _facts(chart, snapshot, with_times=False)],
        [-timer.deadline for timer in snapshot.timers],
        repr(snapshot.invoked),
    )


def names_and_texts(chart: Chart, snapshots: Sequence[Snapshot]) -> list[tuple[str, str]]:
    """Return for each local state an identifier, unique among them, and what it means."""
    groups: dict[str, list[Snapshot]] = {}
    for snapshot in snapshots:
        groups.setdefault(shown_leaves(chart, snapshot), []).append(snapshot)
    found: dict[Snapshot, tuple[str, str]] = {}
    used: set[str] = set()
    for leaves, group in groups.items():
        facts = [list(_facts(chart, snapshot)) for snapshot in group]
        common = set.intersection(*map(set, facts))
        for number, (snapshot, own) in enumerate(zip(group, facts, strict=True)):
            base = word(leaves)
            name = base if len(group) == 1 else f"{base}_{number}"
            while name in used:
                name += "_"
            used.add(name)
            more = ", ".join(fact for fact in own if fact not in common)
            found[snapshot] = name, f"{leaves} [{more}]" if more else leaves
    return [found[snapshot] for snapshot in snapshots]


@telling
def shown_leaves(chart: Chart, snapshot: Snapshot) -> str:
    """Return the active leaves, or that the machine has stopped."""
    if snapshot.fault is not None:
        return f"fault {snapshot.fault}"
    leaves = [chart.states[s].id for s in sorted(snapshot.configuration) if chart.states[s].is_leaf]
    active = "+".join(leaves) or "stopped"
    return active if snapshot.running else f"{active} finished"


def _facts(chart: Chart, snapshot: Snapshot, *, with_times: bool = True) -> Iterator[str]:
    """Yield what tells a local state from others with the same active states."""
    tick = chart.capacities.tick
    for variable, value in zip((*chart.data, *chart.outputs), snapshot.data, strict=True):
        yield f"{variable.name} = {show(value, variable.type, tick)}"
    for declared, value in zip(chart.inputs, snapshot.inputs, strict=True):
        yield f"{declared.name} = {show(value, declared.type, tick)}"
    for state, past in snapshot.history:
        ids = "+".join(chart.states[s].id for s in sorted(past) if chart.states[s].is_leaf)
        yield f"{chart.states[state].id}: {ids}"
    for timer in snapshot.timers:
        yield timer_text(chart, timer) + (_due(timer.deadline) if with_times else "")
    if snapshot.queue or snapshot.deferred:
        waiting = (*snapshot.deferred, *snapshot.queue)
        yield "waiting " + " ".join(occurrence_text(chart, o) for o in waiting)
    for invocation, child in zip(chart.invocations, snapshot.invoked, strict=True):
        if child is not None:
            inner = ", ".join(_facts(invocation.chart, child, with_times=with_times))
            yield f"{invocation.id}: {shown_leaves(invocation.chart, child)} ({inner})"


def _due(ticks: int) -> str:
    """Return when a timer is due; one without an end may be so later."""
    return f" in {ticks}" if ticks < OPEN_ENDED else f" in {ticks - OPEN_ENDED} or later"


@telling
def timer_text(chart: Chart, timer: Timer) -> str:
    """Return what is armed."""
    match timer.what:
        case Timeout(transition):
            return f"timeout of {chart.states[chart.transitions[transition].source].id}"
        case Delayed(occurrence):
            return f"delayed {occurrence_text(chart, occurrence)}"


def ranges(numbers: Collection[int]) -> Iterator[tuple[int, int]]:
    """Yield the first and last of each run of consecutive numbers."""
    first = last = -2
    for number in sorted(numbers):
        if number == last + 1:
            last = number
            continue
        if first >= 0:
            yield first, last
        first = last = number
    if first >= 0:
        yield first, last
