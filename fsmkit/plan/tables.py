"""The program of a machine as tables of numbers, for targets that read tables.

A *row* is an event and the transition that a state tries for it. A *path* lists the states that a
transition enters. It ends with 0, and a code greater than all states is a special step, which says
how many codes to skip: so the branches of histories need no code of their own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fsmkit.chart.chart import Transition
from fsmkit.document.document import Kind, Trigger
from fsmkit.plan.operations import Branch, Content, Enter, Ops, Restore
from fsmkit.plan.plan import Plan
from fsmkit.plan.restoring import restored_regions
from fsmkit.plan.selection import Selection

SUFFIX = 8
"""A path is searched for by this number of its last codes."""


@dataclass(frozen=True, slots=True)
class Row:
    """A candidate of a state; without a transition the state defers the event.

    ``event``: its number, or how many events there are for an eventless transition.
    """

    state: int
    event: int
    transition: Transition | None


@dataclass(frozen=True, slots=True)
class Skip:
    """Skip codes of a path unconditionally."""

    count: int


@dataclass(frozen=True, slots=True)
class SkipUnless:
    """Skip codes unless a history recorded a state in a region; None for any state."""

    history: int
    region: int
    state: int | None
    count: int


@dataclass(frozen=True, slots=True)
class EnterRecorded:
    """Enter the states that a deep history recorded of some regions.

    Each region comes with the state before its first.
    """

    history: int
    regions: tuple[tuple[int, int], ...]


Special = Content | Skip | SkipUnless | EnterRecorded


class Paths:
    """The paths of a machine in sequence; a path may be the end of another."""

    def __init__(self, plan: Plan) -> None:
        """Create no paths."""
        self._plan = plan
        self.codes: list[int] = []
        self.specials: dict[Special, int] = {}
        """The code of each special step."""
        self._known: dict[tuple[int | None, Ops], int] = {}
        self._ends: dict[tuple[int, ...], list[int]] = {}
        """Where paths end, by their last codes."""

    def add(self, ops: Ops, until: int | None = None) -> None:
        """Add the path of operations; ``until``: the code before it, where paths have one."""
        if (until, ops) not in self._known:
            path = [*([] if until is None else [until]), *self._encoded(ops), 0]
            self._known[until, ops] = self._find(path)

    def at(self, ops: Ops, until: int | None = None) -> int:
        """Return the index of the first code of a path that was added."""
        return self._known[until, ops]

    def append(self, codes: list[int]) -> None:
        """Add codes at the end, even if they are part of a path already."""
        first = len(self.codes) + 1
        self.codes += codes
        for end in range(first, len(self.codes) + 1):
            if self.codes[end - 1] == 0:
                self._note_end(end)

    def _note_end(self, end: int) -> None:
        for length in range(1, SUFFIX + 1):
            ends = self._ends.setdefault(tuple(self.codes[max(0, end - length) : end]), [])
            if length == SUFFIX or not ends:  # paths that end with a shorter suffix are equal
                ends.append(end)

    def _find(self, path: list[int]) -> int:
        """Return the first index of the codes of a path, which are appended if they are new."""
        for end in self._ends.get(tuple(path[-SUFFIX:]), ()):
            at = end - len(path)
            if at >= 0 and self.codes[at:end] == path:
                return at
        at = len(self.codes)
        self.append(path)
        return at

    def _encoded(self, ops: Ops) -> list[int]:
        found: list[int] = []
        for op in ops:
            match op:
                case Enter(state, defaults):
                    found += (state, *(self._special(Content(each)) for each in defaults))
                case Content():
                    found.append(self._special(op))
                case Branch(history, recorded, unrecorded):
                    region = self._plan.recorded_regions[history][0]
                    either = self._encoded(recorded), self._encoded(unrecorded)
                    found += self._branch(history, region, None, *either)
                case Restore():
                    found += self._restored(op)
        return found

    def _special(self, step: Special) -> int:
        return self.specials.setdefault(step, len(self._plan.parents) + len(self.specials))

    def _branch(
        self, history: int, region: int, state: int | None, first: list[int], second: list[int]
    ) -> list[int]:
        """Return one path if a history recorded a state, and then another if not."""
        if second:
            first = [*first, self._special(Skip(len(second)))]
        test = self._special(SkipUnless(history, region, state, len(first)))
        return [test, *first, *second]

    def _restored(self, restore: Restore) -> list[int]:
        history = restore.history
        if self._plan.chart.states[history].kind is Kind.SHALLOW_HISTORY:
            (resume,) = self._plan.resumed(restore)
            found: list[int] = []
            for child, ops in reversed(resume.cases):
                found = self._branch(history, resume.region, child, self._encoded(ops), found)
            return found
        regions = tuple(restored_regions(self._plan, restore))
        return [self._special(EnterRecorded(history, regions))]


@dataclass(frozen=True, slots=True)
class Tables:
    """The tables of a machine.

    They are compact for one region without histories and deferral. Then the number of a row takes
    its transition, so that rows need not name it, and a path starts with the domain.
    """

    plan: Plan
    is_compact: bool
    rows: tuple[tuple[Row, ...], ...]
    """By state, from that of number 1: what it tries, by priority."""
    taken: tuple[Transition, ...]
    """By the number that takes it, from 1: the transition."""
    numbers: dict[int, list[int]]
    """By transition: the numbers that take it."""
    paths: Paths

    def path_of(self, transition: int) -> int:
        """Return the index of a transition's path; 0 in compact tables if no state is entered."""
        domain = self.plan.variants[transition][-1].domain
        if self.is_compact and domain is None:
            return 0
        return self.path_at(self.plan.variants[transition][-1].entry, domain)

    def path_at(self, ops: Ops, domain: int | None) -> int:
        """Return the index of the path of operations below a domain."""
        return self.paths.at(ops, domain if self.is_compact else None)


def tables_of(plan: Plan, selection: Selection) -> Tables:
    """Return the tables of a machine; ``selection``: of candidates that are selected alike."""
    chart = plan.chart
    is_compact = plan.is_single and not any(s.is_history or s.defer for s in chart.states)
    rows = tuple(_rows(selection, state) for state in range(1, len(chart.states)))
    triggered = [t for t in chart.transitions if t.trigger is not Trigger.INITIAL]
    numbers: dict[int, list[int]] = {}
    if is_compact:
        taken = [row.transition for own in rows for row in own if row.transition is not None]
        tried = {transition.index for transition in taken}
        taken += (each for each in triggered if each.index not in tried)
    else:
        taken = [*chart.transitions]
    for number, transition in enumerate(taken, 1):
        numbers.setdefault(transition.index, []).append(number)
    paths = _paths(plan, triggered, is_compact=is_compact)
    return Tables(plan, is_compact, rows, tuple(taken), numbers, paths)


def _rows(selection: Selection, state: int) -> tuple[Row, ...]:
    """Return the candidates of a state; it defers only events without a certain candidate."""
    events = len(selection.plan.chart.events)
    own = selection.transitions_of(state, Trigger.EVENT)
    found = [Row(state, event, transition) for transition in own for event in transition.events]
    closed = {
        event for transition in own if transition.guard is None for event in transition.events
    }
    found += (
        Row(state, events, each) for each in selection.transitions_of(state, Trigger.EVENTLESS)
    )
    found += (Row(state, each, None) for each in selection.deferred_by(state) if each not in closed)
    return tuple(found)


def _paths(plan: Plan, triggered: Iterable[Transition], *, is_compact: bool) -> Paths:
    paths = Paths(plan)
    if is_compact:
        paths.append([0, 0])  # of a transition that stays, and the end of any path
    for transition in triggered:
        for variant in plan.variants[transition.index]:
            if not is_compact:
                paths.add(variant.entry)
            elif variant.domain is not None:
                paths.add(variant.entry, variant.domain)
    paths.add(plan.start, 0 if is_compact else None)
    return paths
