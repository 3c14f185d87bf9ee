"""Generate a suite of tests that covers all reachable transitions and states.

The paths are shortest ones to each new item. The longest are kept first, as they cover much on
their way; then paths are removed whose marks the others cover.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from fsmkit.chart.chart import Chart, Transition
from fsmkit.chart.format import format_trigger
from fsmkit.diagnostics import Findings
from fsmkit.document.document import Trigger
from fsmkit.emit.lines import one_line
from fsmkit.runtime.interpreter.snapshot import Entered, Taken
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.engines.python.oracle import explore_in_python
from fsmkit.verify.report.counterexample import Counterexample, TraceStep, write
from fsmkit.verify.report.verdict import Report
from fsmkit.verify.statespace.actions import state_note, transition_note
from fsmkit.verify.statespace.closed_system import ClosedSystem
from fsmkit.verify.statespace.exploration import End, Exploration, Figures, Trail


@dataclass(frozen=True, order=True, slots=True)
class Item:
    """An item to cover: a transition of a machine by number, or a state."""

    machine: int
    is_state: bool
    number: int


@dataclass(frozen=True, slots=True)
class Uncovered:
    """An item that no path covers, and why."""

    item: Item
    text: str
    reason: str


@dataclass(frozen=True)
class Cover:
    """Paths, and the items that they cover. ``wanted``: all items."""

    closed: ClosedSystem
    paths: tuple[Counterexample, ...]
    covered: frozenset[Item]
    wanted: frozenset[Item]
    uncovered: tuple[Uncovered, ...]

    @property
    def is_whole(self) -> bool:
        """Whether all reachable items are covered."""
        return not any(u.reason == NOT_SHOWN for u in self.uncovered)


NOT_SHOWN = "reached, but memory for its path ran out"


def cover(report: Report) -> Cover:
    """Return the suite of a report whose exploration used ``covers``."""
    closed, found = report.closed, report.exploration
    wanted = frozenset(_items(closed))
    with ExitStack() as stack:
        paths = _paths(closed, found, wanted, _trails(closed, found, stack))
    covered = frozenset[Item]().union(*(marks for _, marks in paths)) & wanted
    missed = tuple(_uncovered(closed, found, item) for item in sorted(wanted - covered))
    return Cover(closed, tuple(path for path, _ in paths), covered, wanted, missed)


def _trails(
    closed: ClosedSystem, found: Exploration, stack: ExitStack
) -> Callable[[tuple[int, ...]], Trail]:
    if found.engine == "python":
        return explore_in_python(closed)[1]
    engine = CEngine(closed, Findings())
    stack.callback(engine.close)
    return engine.trail


def _items(closed: ClosedSystem) -> Iterator[Item]:
    """Yield all items of the tested machines."""
    for machine in tested(closed):
        chart = closed.charts[machine]
        for transition in chart.transitions:
            if transition.trigger is not Trigger.INITIAL:
                yield Item(machine, is_state=False, number=transition.index)
        for state in chart.states[1:]:
            if not state.is_history:
                yield Item(machine, is_state=True, number=state.index)


def tested(closed: ClosedSystem) -> tuple[int, ...]:
    """Return the tested machines: those of neither the environment nor connections."""
    return tuple(
        n
        for n, machine in enumerate(closed.system.machines)
        if closed.is_open or not (machine.environment or machine.is_channel)
    )


# --- paths ---------------------------------------------------------------------------------------


def _paths(
    closed: ClosedSystem,
    found: Exploration,
    wanted: frozenset[Item],
    trail_of: Callable[[tuple[int, ...]], Trail],
) -> list[tuple[Counterexample, frozenset[Item]]]:
    ways = {item: mark.path for item in wanted if (mark := found.mark(_mark(closed, item)))}
    chosen: list[tuple[Counterexample, frozenset[Item]]] = []
    covered: set[Item] = set()
    for item in sorted(ways, key=lambda item: (-len(ways[item]), item)):
        if item in covered or not ways[item]:
            continue
        path = write(closed, trail_of(ways[item]))
        marks = frozenset(_marks(closed, path.steps)) & wanted
        chosen.append((path, marks))
        covered |= marks
    return _minimal_paths(chosen)


def _mark(closed: ClosedSystem, item: Item) -> int:
    note = state_note if item.is_state else transition_note
    return closed.first_marks[item.machine] + note(closed.charts[item.machine], item.number)


def _marks(closed: ClosedSystem, steps: Sequence[TraceStep]) -> Iterator[Item]:
    numbers = {machine.name: n for n, machine in enumerate(closed.system.machines)}
    for step in steps:
        for effect in step.done.effects if step.done is not None else ():
            match effect:
                case Taken(transition):
                    yield Item(numbers[step.machine], is_state=False, number=transition)
                case Entered(state):
                    yield Item(numbers[step.machine], is_state=True, number=state)
                case _:
                    pass


def _minimal_paths(
    paths: Sequence[tuple[Counterexample, frozenset[Item]]],
) -> list[tuple[Counterexample, frozenset[Item]]]:
    """Remove paths that cover nothing beyond the others, the shortest first."""
    kept = list(paths)
    for path in sorted(paths, key=lambda p: len(p[0].steps)):
        others = frozenset[Item]().union(*(marks for p, marks in kept if p is not path[0]))
        if path[1] <= others:
            kept = [p for p in kept if p[0] is not path[0]]
    return kept


# --- reports -------------------------------------------------------------------------------------


def _uncovered(closed: ClosedSystem, found: Exploration, item: Item) -> Uncovered:
    chart, figures = closed.charts[item.machine], found.machines[item.machine]
    seen = figures.states if item.is_state else figures.transitions
    if item.number in seen:
        reason = NOT_SHOWN
    elif found.end is not End.COMPLETE:
        reason = "not seen before the exploration ended"
    elif found.table is not None:
        reason = f"not seen, but {found.table.storage.value} storage may miss states"
    elif item.is_state:
        reason = _why_never_entered(chart, figures, item.number)
    else:
        reason = _why_never_taken(closed, item.machine, chart.transitions[item.number], figures)
    return Uncovered(item, text_of(closed, item), reason)


def _why_never_entered(chart: Chart, figures: Figures, state: int) -> str:
    parent = chart.states[state].parent
    if parent and parent not in figures.states:
        return f"`{chart.states[parent].id}` around it is never entered"
    coming = [t for t in chart.transitions if state in t.targets]
    return "no transition to it is ever taken" if coming else "no transition leads to it"


def _why_never_taken(
    closed: ClosedSystem, machine: int, transition: Transition, figures: Figures
) -> str:
    chart = closed.charts[machine]
    if transition.source and transition.source not in figures.states:
        return f"`{chart.states[transition.source].id}` is never entered"
    if closed.is_silent(machine, transition.index):
        return "it is a watchdog, assumed to be silent"
    if transition.events and not closed.is_open:
        sent = {link.event for link in closed.system.event_links if link.target == machine}
        sent |= {p.event for p in closed.possible if p.machine == machine}
        if not sent & set(transition.events) and not _raised(chart, transition):
            return "nothing in this system sends its event"
    samples = ", of the values that were tried" if closed.samples else ""
    return f"where its source is active it is never enabled, or another comes first{samples}"


def _raised(chart: Chart, transition: Transition) -> bool:
    """Whether the machine may raise an event of a transition: any that is not only external."""
    return any(
        {d.value for d in chart.events[event].directions} != {"in"} for event in transition.events
    )


def text_of(closed: ClosedSystem, item: Item) -> str:
    """Return a transition or a state in words, with its machine if there are several."""
    chart = closed.charts[item.machine]
    before = "" if closed.is_open else f"{closed.system.machines[item.machine].name}: "
    if item.is_state:
        return f"{before}state {chart.states[item.number].id}"
    transition = chart.transitions[item.number]
    source = chart.states[transition.source].id or chart.name
    targets = ", ".join(chart.states[t].id for t in transition.targets)
    goes = f" -> {targets}" if targets else ""
    return f"{before}{source} {format_trigger(transition, chart)}{goes}".replace("  ", " ")


def coverage_line(cover: Cover) -> str:
    """Return a line on the coverage."""
    steps = sum(len(path.steps) for path in cover.paths)
    return (
        f"{len(cover.paths)} paths of {steps} steps cover {len(cover.covered)} of "
        f"{len(cover.wanted)} transitions and states"
    )


def table(cover: Cover) -> str:
    """Return a page on the coverage in Markdown."""
    closed = cover.closed
    lines = [
        f"# Coverage of the tests of {closed.system.name}",
        "",
        f"{len(cover.paths)} paths, {sum(len(p.steps) for p in cover.paths)} steps.",
        "",
        "| machine | transitions taken | states entered |",
        "|---|---|---|",
    ]
    for machine in tested(closed):
        name = closed.system.machines[machine].name
        counts = [
            f"{_count(cover.covered, machine, kind)} of {_count(cover.wanted, machine, kind)}"
            for kind in (False, True)
        ]
        lines.append(f"| {name} | {counts[0]} | {counts[1]} |")
    if cover.uncovered:
        lines += ["", "| not covered | why |", "|---|---|"]
        lines += [f"| {_cell(u.text)} | {_cell(u.reason)} |" for u in cover.uncovered]
    lines += ["", "| path | takes for the first time |", "|---|---|"]
    known: set[Item] = set()
    for number, path in enumerate(cover.paths, 1):
        new = sorted(set(_marks(closed, path.steps)) & cover.wanted - known)
        known |= set(new)
        texts = "; ".join(text_of(closed, item) for item in new if not item.is_state)
        lines.append(f"| {name_of(number)} | {_cell(texts)} |")
    return "\n".join(lines) + "\n"


def name_of(number: int) -> str:
    """Return the name of a path, from 1."""
    return f"path_{number}"


def named_paths(cover: Cover) -> Mapping[str, tuple[str, Counterexample]]:
    """Return the paths by name, each with its purpose, for `verify.testgen.suites`."""
    return {
        name_of(number): (f"{len(path.steps)} steps", path)
        for number, path in enumerate(cover.paths, 1)
    }


def _count(items: frozenset[Item], machine: int, is_state: object) -> int:
    """Return the number of states (or transitions) of a machine among items."""
    return sum(item.machine == machine and item.is_state is is_state for item in items)


def _cell(text: str) -> str:
    return one_line(text).replace("|", "\\|")
