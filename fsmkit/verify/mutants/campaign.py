"""Mutants of a system, judged one after the other: found, equivalent, surviving, or undecided."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError, Span, fail
from fsmkit.document.document import Kind
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.mutants.difference import Difference, Sameness, compare
from fsmkit.verify.mutants.operators import NEEDED, Documents
from fsmkit.verify.mutants.subject import Mutant, Subject
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.resources.deadline import Deadline, TimeUp
from fsmkit.verify.statespace.exploration import End, Figures

MOST_PAIRS = 200_000
"""Pairs of sets of states that a comparison looks at, at most."""
COMPARING = 30.0
"""Seconds that a comparison takes at most."""
PATIENCE, LEAST = 5, 60.0
"""A mutant may take so many times the seconds of the original, and so many seconds more."""


NEVER = {
    "transition": "it is never taken",
    "handler": "it is never executed",
    "source": "its state is never entered",
}
"""Why a change has no effect, by `NEEDED`."""
LASTING = frozenset({Kind.ATOMIC, Kind.COMPOUND, Kind.PARALLEL})
"""The kinds of states that an exploration sees entered."""


class Fate(Enum):
    """What became of a mutant."""

    FOUND = "found"
    """A property is violated, or something that `check` reports of every system."""
    EQUIVALENT = "equivalent"
    """In this system it does as the original does."""
    SURVIVING = "surviving"
    """Every property holds."""
    UNDECIDED = "undecided"
    """Time or memory ended before any property was violated."""


@dataclass(frozen=True, slots=True)
class Judged:
    """A mutant and its fate.

    ``by``: names of violated properties; the search ends at the first. ``why``: of an equivalent
    one how that is known, of an undecided one what ended. ``difference``: of a surviving one what
    a comparison with the original found.
    """

    mutant: Mutant
    fate: Fate
    by: tuple[str, ...] = ()
    why: str = ""
    states: int = 0
    difference: Difference | None = None


@dataclass(frozen=True)
class Campaign:
    """What came of all mutants.

    ``possible``: how many changes there are, those included that mean nothing; ``same`` of those
    tried mean the same as the original or as another mutant, ``broken`` cannot be elaborated, and
    neither are among the ``judged``. ``left``: changes that were not tried.
    """

    subject: Subject
    original: Report
    documents: Mapping[str, Documents]
    judged: tuple[Judged, ...]
    possible: int
    same: int
    broken: int
    left: int
    ended: str = ""
    """Why there are not as many mutants as were wanted; empty if there are."""

    def of(self, machine: str) -> tuple[Judged, ...]:
        """Return the mutants of a machine."""
        return tuple(each for each in self.judged if each.mutant.machine == machine)

    @property
    def survivors(self) -> tuple[Judged, ...]:
        """The mutants that no property finds."""
        return tuple(each for each in self.judged if each.fate is Fate.SURVIVING)


WORST = (Fate.EQUIVALENT, Fate.UNDECIDED, Fate.SURVIVING, Fate.FOUND)
"""Of several systems with the same mutant the last of these counts."""


def merged(first: Campaign, other: Campaign) -> Campaign:
    """Return the mutants of a system with what another one found of those that it has, too."""
    later = {each.mutant.identity: each for each in other.judged}

    def both(own: Judged) -> Judged:
        its = later.get(own.mutant.identity, own)
        if WORST.index(its.fate) <= WORST.index(own.fate):
            return own
        by = tuple(f"{other.subject.system.name}.{name}" for name in its.by)
        return replace(its, mutant=own.mutant, by=by)

    return replace(first, judged=tuple(map(both, first.judged)), ended=first.ended or other.ended)


def score(judged: tuple[Judged, ...]) -> float | None:
    """Return the share of mutants that were found, of those that can be; None if there is none."""
    found = sum(each.fate is Fate.FOUND for each in judged)
    surviving = sum(each.fate is Fate.SURVIVING for each in judged)
    return found / (found + surviving) if found + surviving else None


Progress = Callable[[int, int, str], None]
"""Called with how many mutants are judged, how many are wanted, and the one that comes next."""


def judge_mutants(
    subject: Subject,
    options: ExplorationOptions,
    *,
    count: int = 0,
    seed: int = 0,
    part: slice = slice(None),
    properties: frozenset[str] = frozenset(),
    among: Collection[tuple[object, ...]] | None = None,
    deadline: Deadline | None = None,
    progress: Progress | None = None,
) -> Campaign:
    """Seed mistakes and return, of each, whether a property finds it.

    Args:
        subject: The system, or chart, whose properties are judged.
        options: How to explore it and each mutant.
        count: How many mutants to judge (0: all there are).
        seed: Of the order in which they are taken.
        part: The changes to be tried, of that order.
        properties: The properties that shall find them (empty: all).
        among: By `Mutant.identity` those that are judged (None: all).
        deadline: When to end, with what is known until then.
        progress: Called before each mutant.

    Raises:
        FsmkitError: ``unproved-original`` where the exploration of the original does not end, so
            that nothing is known to hold.

    """
    deadline = deadline or Deadline(options.timeout)
    with tempfile.TemporaryDirectory(prefix="fsmkit-", ignore_cleanup_errors=True) as folder:
        options = replace(options, objects=Path(folder), timeout=0, shows=False)
        original = check(
            subject.system, Findings(), options=options, properties=properties, deadline=deadline
        )
        if original.exploration.end not in (End.COMPLETE, End.DECIDED):
            raise fail(
                "unproved-original",
                f"the exploration of `{subject.system.name}` did not end, so nothing is proved "
                "that a mutant could break",
                help="allow more with `--timeout` or `--memory`, or check a smaller system",
            )
        judge = _Judge(subject, options, properties, original, deadline)
        documents = subject.documents()
        ahead = subject.mutants(documents, seed)[part]
        if among is not None:
            ahead = [mutant for mutant in ahead if mutant.identity in among]
        wanted = count or len(ahead)
        tally = _Tally()
        try:
            for mutant in ahead:
                if len(tally.judged) == wanted:
                    break
                if deadline.left <= 0:
                    tally.ended = "the time was over"
                    break
                if progress is not None:
                    progress(len(tally.judged), wanted, f"{mutant.machine}: {mutant.operator}")
                judge.tally(mutant, tally)
        except KeyboardInterrupt:
            tally.ended = "it was interrupted"
        except TimeUp:
            tally.ended = "the time was over"
    return Campaign(
        subject,
        original,
        documents,
        tuple(tally.judged),
        possible=len(ahead),
        same=tally.same,
        broken=tally.broken,
        left=len(ahead) - tally.tried,
        ended=tally.ended,
    )


@dataclass
class _Tally:
    judged: list[Judged] = field(default_factory=list)
    tried: int = 0
    same: int = 0
    broken: int = 0
    ended: str = ""


class _Judge:
    """Judges mutants of one system."""

    def __init__(
        self,
        subject: Subject,
        options: ExplorationOptions,
        properties: frozenset[str],
        original: Report,
        deadline: Deadline,
    ) -> None:
        self._subject = subject
        bad = {r.name for r in original.results if r.verdict is Verdict.VIOLATED}
        self._bad = bad
        held = frozenset(r.name for r in original.results if r.verdict is Verdict.HOLDS)
        self._options = replace(options, ends_at=held)
        self._properties = properties
        self._original = original
        self._deadline = deadline
        self._seconds = PATIENCE * original.exploration.seconds + LEAST
        self._known: dict[str, set[Chart]] = {}

    def tally(self, mutant: Mutant, tally: _Tally) -> None:
        """Judge a mutant, unless it means nothing new."""
        tally.tried += 1
        try:
            system = self._subject.changed(mutant)
        except FsmkitError:
            tally.broken += 1
            return
        if mutant.documents is not None and not self._is_new(mutant, system):
            tally.same += 1
            return
        tally.judged.append(self._judged(mutant, system))

    def _is_new(self, mutant: Mutant, system: System) -> bool:
        """Whether the chart of a mutant is another than the original, and than all before it."""
        known = self._known.setdefault(mutant.machine, set())
        changed = False
        for before, after in zip(self._subject.system.machines, system.machines, strict=False):
            if before.chart != after.chart and after.chart not in known:
                known.add(after.chart)
                changed = True
        return changed

    def _judged(self, mutant: Mutant, system: System) -> Judged:
        if self._is_unneeded(mutant):
            why = f"in this system {NEVER[NEEDED[mutant.operator]]}"
            return Judged(mutant, Fate.EQUIVALENT, why=why)
        limit = Deadline(min(self._seconds, self._deadline.left))
        try:
            report = check(
                system,
                Findings(),
                options=self._options,
                properties=self._properties,
                deadline=limit,
            )
        except FsmkitError as error:
            why = next(iter(error.diagnostics)).message
            return Judged(mutant, Fate.UNDECIDED, why=why)
        states = report.exploration.states
        violated = [r.name for r in report.results if r.verdict is Verdict.VIOLATED]
        by = tuple(name for name in violated if name not in self._bad)
        if by:
            return Judged(mutant, Fate.FOUND, by, states=states)
        if report.exploration.end is not End.COMPLETE:
            why = report.exploration.why or report.exploration.end.value
            return Judged(mutant, Fate.UNDECIDED, why=why, states=states)
        found = self._compared(system)
        if found.sameness is Sameness.EQUIVALENT:
            why = f"no run differs ({found.pairs:,} pairs of states)"
            return Judged(mutant, Fate.EQUIVALENT, why=why, states=states)
        return Judged(mutant, Fate.SURVIVING, states=states, difference=found)

    def _compared(self, system: System) -> Difference:
        limit = Deadline(min(COMPARING, self._deadline.left))
        original, mutant = (
            self._options.closed(each, zones=False) for each in (self._subject.system, system)
        )
        return compare(original, mutant, limit, MOST_PAIRS)

    def _is_unneeded(self, mutant: Mutant) -> bool:
        """Whether the original never comes to what was changed (see `NEEDED`)."""
        if mutant.operator not in NEEDED or mutant.owner is None:
            return False
        if self._original.exploration.end is not End.COMPLETE or self._original.closed.samples:
            return False
        return not any(
            _comes_to(chart, figures, mutant.owner, NEEDED[mutant.operator])
            for chart, figures in self._places(mutant.machine)
        )

    def _places(self, machine: str) -> Iterator[tuple[Chart, Figures]]:
        machines = self._original.closed.system.machines
        for instance, figures in zip(machines, self._original.exploration.machines, strict=True):
            if machine in (instance.name, instance.place and instance.place[0]):
                yield instance.chart, figures


def _comes_to(chart: Chart, figures: Figures, owner: Span, needed: str) -> bool:
    """Whether a machine comes to a place as a change there needs it; true if there is none.

    Of what is no state for long, such as a choice, it is not known whether it is entered.
    """
    transitions = [t for t in chart.transitions if t.span == owner]
    states = [s.index for s in chart.states if s.span == owner]
    if needed == "source":
        states += [t.source for t in transitions]
        lasting = {s.index for s in chart.states if s.kind in LASTING}
        return not states or any(s in figures.states or s not in lasting for s in states)
    if not transitions and not states:
        return True
    return any(t.index in figures.transitions for t in transitions) or any(
        s in figures.states for s in states
    )
