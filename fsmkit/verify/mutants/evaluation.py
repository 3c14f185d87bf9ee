"""Evaluate mutants: by the properties of each system, then by comparison with the original."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, FsmkitError, Span, fail
from fsmkit.document.document import Kind
from fsmkit.system.system import System
from fsmkit.verify.engines.c.local_states import local_states
from fsmkit.verify.explore import ExplorationOptions, check
from fsmkit.verify.mutants.contrast import Contrast
from fsmkit.verify.mutants.difference import Difference, Sameness, compare
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.operators import NEEDED, Documents
from fsmkit.verify.mutants.same_steps import LocalBehaviour, is_observable
from fsmkit.verify.mutants.subject import Mutant, Subject
from fsmkit.verify.report.verdict import Report, Verdict
from fsmkit.verify.resources.deadline import Deadline, TimeUp
from fsmkit.verify.statespace.exploration import End, Figures

MOST_PAIRS = 200_000
"""Pairs of sets of states that a comparison looks at, at most."""
COMPARING, LOOKING = 30.0, 5.0
"""Seconds that a comparison takes at most; if a system has more states than `MOST_PAIRS`, so that
a difference may be found, but equivalence is never proved."""
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


@dataclass(frozen=True, slots=True)
class _Holding:
    """A system all of whose properties hold with a mutant."""

    evaluator: Evaluator
    system: System
    states: int
    local: tuple[str, ...]
    """A step in which it differs from the original; empty: none is known."""


def evaluate(places: Iterable[tuple[Evaluator, Mutant, System]]) -> Evaluated:
    """Return the fate of a mutant, which is the first of the given ones, in its systems.

    The first system with a violated property decides. If all hold, the mutant is compared with
    the original in one system after the other, until they differ.
    """
    first: Mutant | None = None
    holding: list[_Holding] = []
    equivalent = undecided = ""
    failed = False
    for evaluator, own, system in places:
        found = evaluator.evaluated(own, system)
        name = evaluator.subject.system.name
        first, is_first = first or own, first is None
        if isinstance(found, _Holding):
            holding.append(found)
        elif found.fate is Fate.FOUND:
            by = found.by if is_first else tuple(f"{name}.{each}" for each in found.by)
            return replace(found, mutant=first, by=by)
        elif found.fate is Fate.EQUIVALENT:
            equivalent = equivalent or found.why
        else:
            undecided = undecided or (found.why if is_first else f"`{name}`: {found.why}")
            failed = failed or found.failed
    assert first is not None  # noqa: S101  (there is a first system)
    names = tuple(each.evaluator.subject.system.name for each in holding)
    states = holding[0].states if holding else 0
    contrast: Contrast | None = None
    for each in holding:
        comparison = each.evaluator.compared(each.system, is_known=bool(each.local))
        if comparison.sameness is Sameness.EQUIVALENT:
            equivalent = equivalent or f"no run differs ({comparison.pairs:,} pairs of states)"
            continue
        found_here = replace(Contrast.of(comparison), local=each.local)
        if contrast is None or not contrast.local:
            contrast = found_here
        if comparison.sameness is Sameness.DIFFERENT:
            contrast = found_here
            break
    if contrast is not None:
        return Evaluated(
            first, Fate.SURVIVING, states=states, systems=names, contrast=contrast, failed=failed
        )
    if undecided:
        return Evaluated(first, Fate.UNDECIDED, why=undecided, states=states, failed=failed)
    return Evaluated(first, Fate.EQUIVALENT, why=equivalent, states=states)


class Evaluator:
    """Evaluates mutants by one system, whose original is explored when it is first needed."""

    def __init__(
        self,
        subject: Subject,
        options: ExplorationOptions,
        properties: frozenset[str],
        deadline: Deadline,
    ) -> None:
        """Take a system, its exploration options, and the properties (empty: all)."""
        self.subject = subject
        self.failed: FsmkitError | None = None
        self._unlimited = options
        self._properties = properties
        self._deadline = deadline

    @cached_property
    def documents(self) -> dict[str, Documents]:
        """The source documents of each machine's chart."""
        return self.subject.documents()

    @cached_property
    def known(self) -> Mapping[tuple[object, ...], Mutant]:
        """All mutants of the system, by their identity."""
        return {each.identity: each for each in self.subject.mutants(self.documents, 0)}

    # --- the original --------------------------------------------------------------------------

    @cached_property
    def original(self) -> Report:
        """The report of the original. Raises `FsmkitError` if it is not proved."""
        system = self.subject.system
        found = check(
            system, Findings(), options=replace(self._unlimited, shows_locals=True),
            properties=self._properties, deadline=self._deadline,
        )  # fmt: skip
        if found.interrupted or found.exploration.end is End.INTERRUPTED:
            raise KeyboardInterrupt
        if found.exploration.end not in (End.COMPLETE, End.DECIDED):
            raise fail(
                "unproved-original",
                f"the exploration of `{system.name}` did not end, so nothing is proved "
                "that a mutant could break",
                help="allow more with `--timeout` or `--memory`, or check a smaller system",
            )
        return found

    @property
    def is_proved(self) -> bool:
        """Whether the original can be explored; if not, ``failed`` is the reason."""
        if self.failed is None:
            try:
                _ = self.original
            except FsmkitError as error:
                self.failed = error
        return self.failed is None

    @property
    def seconds(self) -> float:
        """The duration of the exploration of the original."""
        return self.original.exploration.seconds

    @cached_property
    def _bad(self) -> frozenset[str]:
        return frozenset(r.name for r in self.original.results if r.verdict is Verdict.VIOLATED)

    @cached_property
    def _held(self) -> frozenset[str]:
        return frozenset(r.name for r in self.original.results if r.verdict is Verdict.HOLDS)

    @cached_property
    def _options(self) -> ExplorationOptions:
        return replace(self._unlimited, ends_at=self._held)

    # --- a mutant ------------------------------------------------------------------------------

    def evaluated(self, mutant: Mutant, system: System) -> Evaluated | _Holding:
        """Return its fate as far as the properties of this system decide it."""
        if self._is_unneeded(mutant):
            why = f"in this system {NEVER[NEEDED[mutant.operator]]}"
            return Evaluated(mutant, Fate.EQUIVALENT, why=why)
        local = self.local_difference(mutant, system)
        if local is None:
            return Evaluated(mutant, Fate.EQUIVALENT, why="in this system every step is the same")
        seconds = min(PATIENCE * self.seconds + LEAST, self._deadline.left)
        try:
            report = check(
                system, Findings(), options=self._options, properties=self._properties,
                deadline=Deadline(seconds),
            )  # fmt: skip
        except FsmkitError as error:
            why = next(iter(error.diagnostics)).message
            return Evaluated(mutant, Fate.UNDECIDED, why=why, failed=True)
        states, end = report.exploration.states, report.exploration.end
        violated = [r.name for r in report.results if r.verdict is Verdict.VIOLATED]
        by = tuple(name for name in violated if name not in self._bad)
        if by:
            return Evaluated(mutant, Fate.FOUND, by, states=states)
        if report.interrupted or end is End.INTERRUPTED:
            raise KeyboardInterrupt
        unknown = [
            r for r in report.results if r.verdict is Verdict.UNDECIDED and r.name in self._held
        ]
        if end is End.COMPLETE and not unknown:
            return _Holding(self, system, states, local)
        if self._deadline.left <= 0:
            raise TimeUp
        why = report.exploration.why or (unknown[0].reason if unknown else "") or end.value
        return Evaluated(mutant, Fate.UNDECIDED, why=why, states=states)

    def compared(self, system: System, *, is_known: bool = False) -> Difference:
        """Compare a mutant with the original, in step.

        ``is_known``: a differing step is known, so the comparison is done only if it can complete.
        """
        states = self.original.exploration.states
        if is_known and states > MOST_PAIRS:
            return Difference(Sameness.UNKNOWN, 0, why=f"more than {MOST_PAIRS:,} states")
        seconds = COMPARING if states <= MOST_PAIRS else LOOKING
        original, mutant = (
            self._options.closed(each, zones=False) for each in (self.subject.system, system)
        )
        found = compare(original, mutant, Deadline(min(seconds, self._deadline.left)), MOST_PAIRS)
        if found.sameness is Sameness.UNKNOWN:
            self._deadline.look()
        return found

    # --- steps of its machine ------------------------------------------------------------------

    @cached_property
    def _behaviours(self) -> Mapping[str, LocalBehaviour]:
        """The local behaviour of each machine, where it was computed."""
        original = self.original
        closed = original.closed
        if original.exploration.engine != "c" or original.exploration.end is not End.COMPLETE:
            return {}
        names = [m.name for m in closed.system.machines]
        chosen = [names.index(name) for name in self.documents if name in names]
        chosen = [machine for machine in chosen if is_observable(closed, machine)]
        found = local_states(closed, original.exploration, chosen)
        return {names[m]: LocalBehaviour(closed, m, states) for m, states in found.items()}

    def local_difference(self, mutant: Mutant, system: System) -> tuple[str, ...] | None:
        """Return a differing step of its machine, as `LocalBehaviour.difference`."""
        behaviour = None if mutant.documents is None else self._behaviours.get(mutant.machine)
        if behaviour is None:
            return ()
        changed = self._unlimited.closed(system, zones=self.original.closed.zones)
        return behaviour.difference(changed, mutant)

    def _is_unneeded(self, mutant: Mutant) -> bool:
        """Whether the original never reaches the changed part (see `NEEDED`)."""
        if mutant.operator not in NEEDED or mutant.owner is None:
            return False
        if self.original.exploration.end is not End.COMPLETE or self.original.closed.samples:
            return False
        return not any(
            _can_reach(chart, figures, mutant.owner, NEEDED[mutant.operator])
            for chart, figures in self._places(mutant.machine)
        )

    def _places(self, machine: str) -> Iterator[tuple[Chart, Figures]]:
        machines = self.original.closed.system.machines
        for instance, figures in zip(machines, self.original.exploration.machines, strict=True):
            if machine in (instance.name, instance.place and instance.place[0]):
                yield instance.chart, figures


def _can_reach(chart: Chart, figures: Figures, owner: Span, needed: str) -> bool:
    """Whether a machine reaches a location as a change there needs it; true without a location.

    Entries of transient states, such as choices, are not recorded.
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
