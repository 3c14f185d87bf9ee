"""The partition of values from outside: what it says, and that it changes no verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from fsmkit.chart.analysis import partition
from fsmkit.chart.analysis.partition import Place, Values, _At, _Flows
from fsmkit.chart.statements import KeywordStatement
from fsmkit.diagnostics import Source, Span
from fsmkit.language import BOOL, BinaryOp, Expr, Literal
from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.system.partition import partition_of
from fsmkit.verify.engines.python.oracle import Oracle
from fsmkit.verify.resources.deadline import Deadline
from fsmkit.verify.statespace.actions import TooManyChoices
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.exploration import End
from tests.chart.analysis.random_values import random_files
from tests.verify.random_systems import load_files

# --- against full enumeration ---------------------------------------------------------------------


def is_below(value: int, cut: partition.Cut) -> bool:
    """Whether a value is on the lower side of a cut."""
    assert not isinstance(cut.at, str)
    return value <= cut.at if cut.after else value < cut.at


def facts(closed: ClosedSystem, seconds: float) -> dict[str, object] | None:
    """Return the verdicts, and the reached states but for values that nothing tells apart."""
    oracle = Oracle(closed)
    try:
        found = oracle.run(deadline=Deadline(seconds), traps=closed.is_open)
    except TooManyChoices:
        return None
    if found.end is not End.COMPLETE:
        return None
    flows = partition_of(closed.system)._flows
    names = [[*c.data, *c.outputs, *c.inputs] for c in closed.charts]

    def coarse(machine: int, snapshot: Snapshot) -> object:
        values = []
        inputs = snapshot.inputs if not closed.is_open else tuple(0 for _ in snapshot.inputs)
        held = (*snapshot.data, *inputs)
        for declared, value in zip(names[machine], held, strict=True):
            ahead = flows.ahead(Place(machine, "variable", declared.name))
            parts = value if isinstance(value, tuple) else (value,)
            for part in parts:
                assert isinstance(part, int)
                below = [is_below(part, cut) for cut in sorted(ahead.cuts)]
                values.append(part if ahead.kept else tuple(below))
        waiting = [tuple(o.event for o in q) for q in (snapshot.queue, snapshot.deferred)]
        return snapshot.configuration, tuple(values), tuple(waiting), snapshot.running

    return {
        "reached": {
            tuple(coarse(m, s) for m, s in enumerate(oracle.snapshots(state)))
            for state in oracle.reached
        },
        "marks": sorted({mark.number for mark in found.marks}),
        "livelock": found.livelock is not None,
        "traps": bool(found.traps),
        "temporal": [(a.known, a.violated) for a in found.temporal],
    }


def every_value(lo: int, hi: int, ahead: object, enumerated: int) -> Values:
    """Return all values of a range."""
    del ahead, enumerated
    return Values(tuple(range(lo, hi + 1)))


def tried(closed: ClosedSystem) -> int:
    """Return how many values are tried."""
    inputs = sum(len(free.values) for free in closed.free_inputs)
    results = sum(len(values) for machine in closed.results for values in machine.values())
    return len(closed.possible) + inputs + results


@dataclass
class Tally:
    """How many systems were compared, and what came out."""

    compared: int = 0
    smaller: int = 0
    different: int = 0


def nothing(patch: pytest.MonkeyPatch) -> None:
    """Leave the analysis as it is."""


def compare(
    seeds: Iterable[int],
    *,
    alone: bool,
    few: int = 0,
    mutant: Callable[[pytest.MonkeyPatch], None] = nothing,
) -> Tally:
    """Explore random systems with one value for each interval, and with every value.

    ``few``: a type of at most so many values is enumerated where it must be.
    """
    tally = Tally()
    for seed in seeds:
        files = random_files(seed, alone=alone)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(partition, "ENUMERATED", few)
            mutant(patch)
            divided = close(load_files(files), untimed=True)
            if divided.samples:
                continue
            patch.undo()
            patch.setattr(partition, "_integers", every_value)
            every = close(load_files(files), untimed=True)
        if len(divided.charts) < len(every.charts):
            continue  # an input that nothing reads has no machine that sets it
        found, whole = facts(divided, 1), facts(every, 1)
        if found is None or whole is None:
            continue
        tally.compared += 1
        tally.smaller += tried(divided) < tried(every)
        tally.different += found != whole
    return tally


@pytest.mark.slow
@pytest.mark.parametrize("few", [0, 32])
@pytest.mark.parametrize("alone", [True, False], ids=["alone", "systems"])
def test_random_systems_have_the_verdicts_and_states_of_full_enumeration(
    alone: bool, few: int
) -> None:
    tally = compare(range(30), alone=alone, few=few)
    assert tally.different == 0
    assert tally.compared >= 8
    assert tally.smaller >= 0.9 * tally.compared


# --- mutants --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Require(KeywordStatement[Expr]):
    """A statement that the analysis does not know."""

    word = "require"


def test_what_an_unknown_statement_evaluates_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Expr] = []
    monkeypatch.setattr(_Flows, "_evaluate", lambda _, value, __: seen.append(value))
    value = Literal(True, BOOL, Span(Source("", ""), 0, 0))
    flows = _Flows.__new__(_Flows)
    statement: Any = Require(value, value.span)
    flows._statement(statement, _At(0, (), 0, (), {}))
    assert seen == [value]


def not_followed(patch: pytest.MonkeyPatch) -> None:
    """Only what happens at the place itself counts."""
    right = _Flows.ahead

    def ahead(self: _Flows, place: Place) -> partition._Ahead:
        alone = _Flows(observed=False)
        alone.cuts, alone.known, alone.kept = self.cuts, self.known, self.kept
        return right(alone, place)

    patch.setattr(_Flows, "ahead", ahead)


def not_cut_after(patch: pytest.MonkeyPatch) -> None:
    """A constant is not told from what is above it."""
    right = partition._cuts

    def cuts(op: BinaryOp, constant: float) -> Iterator[partition.Cut]:
        return (replace_after(cut) for cut in right(op, constant))

    def replace_after(cut: partition.Cut) -> partition.Cut:
        return partition.Cut(cut.at)

    patch.setattr(partition, "_cuts", cuts)


def not_mirrored(patch: pytest.MonkeyPatch) -> None:
    """``1 < x`` is read as ``x < 1``."""
    patch.setattr(partition, "MIRRORED", {op: op for op in partition.MIRRORED})


def never_kept(patch: pytest.MonkeyPatch) -> None:
    """What is computed with makes no difference."""
    patch.setattr(_Flows, "_use", lambda *_: None)


def conditions_unread(patch: pytest.MonkeyPatch) -> None:
    """Properties make no difference."""
    patch.setattr(_Flows, "condition", lambda *_: None)


def wires_unread(patch: pytest.MonkeyPatch) -> None:
    """Connections copy nothing."""
    patch.setattr("fsmkit.system.partition._copies", lambda _: ())


def bounds_unread(patch: pytest.MonkeyPatch) -> None:
    """Saturation changes nothing."""
    patch.setattr(partition, "integer_bounds", lambda _: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mutant", "alone"),
    [
        (not_followed, True),
        (not_cut_after, True),
        (not_mirrored, True),
        (never_kept, True),
        (bounds_unread, True),
        (conditions_unread, False),
        (wires_unread, False),
    ],
)
def test_an_analysis_that_is_wrong_is_noticed(
    mutant: Callable[[pytest.MonkeyPatch], None], alone: bool
) -> None:
    assert any(
        compare(range(at, at + 10), alone=alone, mutant=mutant).different
        for at in range(0, 200, 10)
    )
