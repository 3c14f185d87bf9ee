"""Evaluate the mutants of systems one after the other."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import FsmkitError
from fsmkit.system.system import System
from fsmkit.verify.explore import ExplorationOptions
from fsmkit.verify.mutants.evaluation import Evaluator, evaluate
from fsmkit.verify.mutants.fates import Evaluated, Fate
from fsmkit.verify.mutants.operators import Documents
from fsmkit.verify.mutants.subject import Mutant, Subject
from fsmkit.verify.report.verdict import Report
from fsmkit.verify.resources.deadline import Deadline, TimeUp


@dataclass(frozen=True)
class Campaign:
    """The fates of all mutants.

    ``possible``: the number of changes, those without effect included. ``same`` of those tried are
    equal to the original or to another mutant, and ``broken`` cannot be elaborated; neither are
    among the ``evaluated``. ``left``: changes that were not tried.
    """

    subject: Subject
    original: Report
    documents: Mapping[str, Documents]
    evaluated: tuple[Evaluated, ...]
    possible: int
    same: int
    broken: int
    left: int
    wanted: int = 0
    """How many mutants were to be evaluated."""
    ended: str = ""
    """Why there are not as many mutants as were wanted; empty if there are."""
    failed: tuple[FsmkitError, ...] = ()
    """Why other systems were not looked at, or results not kept."""

    def of(self, machine: str) -> tuple[Evaluated, ...]:
        """Return the mutants of a machine."""
        return tuple(each for each in self.evaluated if each.mutant.machine == machine)

    @property
    def survivors(self) -> tuple[Evaluated, ...]:
        """The mutants that no property detects."""
        return tuple(each for each in self.evaluated if each.fate is Fate.SURVIVING)


def score(evaluated: tuple[Evaluated, ...]) -> float | None:
    """Return the share of detected mutants among the detectable ones; None without any."""
    found = sum(each.fate is Fate.FOUND for each in evaluated)
    surviving = sum(each.fate is Fate.SURVIVING for each in evaluated)
    return found / (found + surviving) if found + surviving else None


Progress = Callable[[int, int, str], None]
"""Called with how many mutants are evaluated, how many are wanted, and the one that comes next."""


def nothing_known(_: Mutant) -> Evaluated | None:
    """Recall nothing."""
    return None


def evaluate_mutants(
    subject: Subject,
    options: ExplorationOptions,
    *,
    others: Sequence[Subject] = (),
    count: int = 0,
    seed: int = 0,
    part: slice = slice(None),
    properties: frozenset[str] = frozenset(),
    deadline: Deadline | None = None,
    progress: Progress | None = None,
    recall: Callable[[Mutant], Evaluated | None] = nothing_known,
    store: Callable[[Evaluated], None] | None = None,
) -> Campaign:
    """Change a system in one location each, and return whether a property detects the change.

    Args:
        subject: The system, or chart, whose mutants are evaluated.
        options: How to explore it and each mutant.
        others: Systems with the same charts. A mutant that no property of the first detects is
            evaluated there, too, as far as possible.
        count: How many mutants to evaluate (0: all).
        seed: The seed of the order in which they are tried.
        part: The changes to try, as a slice of that order.
        properties: The properties that shall detect them (empty: all).
        deadline: When to end, with the results until then.
        progress: Called before each mutant.
        recall: Returns the fate of a mutant in an earlier campaign, or None.
        store: Called with each mutant after its evaluation, except for recalled ones.

    Raises:
        FsmkitError: ``unproved-original`` if the exploration of the original does not end, so that
            nothing is known to hold.

    """
    deadline = deadline or Deadline(options.timeout)
    with tempfile.TemporaryDirectory(prefix="fsmkit-", ignore_cleanup_errors=True) as folder:
        options = replace(options, objects=Path(folder), timeout=0, shows=False)
        first, *more = (Evaluator(one, options, properties, deadline) for one in (subject, *others))
        original = first.original
        ahead = subject.mutants(first.documents, seed)[part]
        tally = _Tally(first, tuple(more), count or len(ahead))
        try:
            for mutant in ahead:
                if len(tally.evaluated) == tally.wanted:
                    break
                deadline.look()
                if progress is not None:
                    what = f"{mutant.machine}: {mutant.operator}"
                    progress(len(tally.evaluated), tally.wanted, what)
                tally.take(mutant, recall, store)
        except KeyboardInterrupt:
            tally.ended = "it was interrupted"
        except TimeUp:
            tally.ended = "the time was over"
        except _NotKeptError as error:
            tally.ended = "the results cannot be stored"
            tally.failed.append(error.reason)
    tally.failed += [evaluator.failed for evaluator in more if evaluator.failed is not None]
    unevaluated = [
        f"`{evaluator.subject.path}` was not evaluated" for evaluator in more if evaluator.failed
    ]
    return Campaign(
        subject,
        original,
        first.documents,
        tuple(tally.evaluated),
        possible=len(ahead),
        same=tally.same,
        broken=tally.broken,
        left=len(ahead) - tally.tried,
        wanted=tally.wanted,
        ended=tally.ended or "; ".join(unevaluated),
        failed=tuple(tally.failed),
    )


class _NotKeptError(Exception):
    """A result cannot be stored, so the evaluation ends."""

    def __init__(self, reason: FsmkitError) -> None:
        super().__init__()
        self.reason = reason


@dataclass
class _Tally:
    """The results so far."""

    first: Evaluator
    others: tuple[Evaluator, ...]
    wanted: int
    evaluated: list[Evaluated] = field(default_factory=list)
    tried: int = 0
    same: int = 0
    broken: int = 0
    ended: str = ""
    failed: list[FsmkitError] = field(default_factory=list)
    _known: dict[str, set[Chart]] = field(default_factory=dict)

    def take(
        self,
        mutant: Mutant,
        recall: Callable[[Mutant], Evaluated | None],
        store: Callable[[Evaluated], None] | None,
    ) -> None:
        """Evaluate a mutant, unless it is equal to an earlier one; then it counts as tried."""
        try:
            system = self.first.subject.changed(mutant)
        except FsmkitError:
            self.broken += 1
            self.tried += 1
            return
        if mutant.documents is not None and not self._is_new(mutant, system):
            self.same += 1
            self.tried += 1
            return
        known = recall(mutant)
        places = chain([(self.first, mutant, system)], self._elsewhere(mutant))
        evaluated = known or evaluate(places)
        self.evaluated.append(evaluated)
        self.tried += 1
        if known is None and store is not None:
            try:
                store(evaluated)
            except FsmkitError as error:
                raise _NotKeptError(error) from error

    def _elsewhere(self, mutant: Mutant) -> Iterator[tuple[Evaluator, Mutant, System]]:
        """Yield the other systems that contain it, the cheapest first, when they are needed."""
        having = [(evaluator, evaluator.known[mutant.identity]) for evaluator in self.others
                  if mutant.identity in evaluator.known and evaluator.is_proved]  # fmt: skip
        for evaluator, own in sorted(having, key=lambda pair: pair[0].seconds):
            try:
                system = evaluator.subject.changed(own)
            except FsmkitError:
                continue
            if system != evaluator.subject.system:
                yield evaluator, own, system

    def _is_new(self, mutant: Mutant, system: System) -> bool:
        """Whether the chart of a mutant differs from the original, and from all before it."""
        known = self._known.setdefault(mutant.machine, set())
        changed = False
        machines = self.first.subject.system.machines
        for before, after in zip(machines, system.machines, strict=False):
            if before.chart != after.chart and after.chart not in known:
                known.add(after.chart)
                changed = True
        return changed
