"""Exclude items from coverage that `check` proves unreachable."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fsmkit.chart.chart import Chart
from fsmkit.diagnostics import Findings, fail
from fsmkit.plan.fingerprint import fingerprint
from fsmkit.testing.coverage.record import ChartCoverage, Item
from fsmkit.verify.explore import ExplorationOptions, check_file
from fsmkit.verify.report.figures import count_text, quantity
from fsmkit.verify.report.verdict import ENDS, Report
from fsmkit.verify.statespace.exploration import End


@dataclass(frozen=True, slots=True)
class ReachableItems:
    """The reachable items of a chart, by a complete exploration."""

    proof: str
    """Description of the chart or system."""
    chart: Chart
    states: frozenset[int]
    transitions: frozenset[int]


def reachable_items(
    path: Path, findings: Findings, *, timeout: float = 0
) -> tuple[ReachableItems, ...]:
    """Explore a chart or a system, and return the reachable items of each chart.

    Args:
        path: The file.
        findings: Collects the findings while reading.
        timeout: Seconds, 0 for none.

    Raises:
        FsmkitError: ``wrong-option`` if the exploration is incomplete, and errors of the file.

    """
    options = ExplorationOptions(timeout=timeout)
    system, report = check_file(path, findings, options=options)
    why = _incompleteness(report)
    if why:
        raise fail(
            "wrong-option", f"`{path}` proves nothing to be out of reach: {why}",
            help="see `fsmkit check`, or leave --only-reachable out",
        )  # fmt: skip
    proof = f"`fsmkit check {path}` explored all {count_text(report.exploration.states)} states"
    found: dict[str, ReachableItems] = {}
    for machine, figures in zip(system.machines, report.exploration.machines, strict=True):
        key = fingerprint(machine.chart)
        before = found.get(key, ReachableItems(proof, machine.chart, frozenset(), frozenset()))
        found[key] = replace(
            before,
            states=before.states | figures.states,
            transitions=before.transitions | figures.transitions,
        )
    return tuple(found.values())


def _incompleteness(report: Report) -> str:
    """Return why something may be reached that was not seen, empty where nothing may."""
    found, closed = report.exploration, report.closed
    if found.end is not End.COMPLETE:
        return f"{ENDS[found.end]} after {count_text(found.states)} states"
    if found.table is not None:
        return f"{found.table.storage.value} storage may miss states"
    if closed.samples:
        return f"only samples of {', '.join(closed.samples)} were tried"
    return ""


def only_reachable(
    charts: Sequence[ChartCoverage], proofs: Iterable[ReachableItems]
) -> tuple[tuple[ChartCoverage, ...], tuple[str, ...]]:
    """Return coverage without unreachable items, and a line for each chart that names them.

    Omitted are unreachable states and transitions, and the guards of transitions from such states.
    An item that was reached nevertheless stays: its host did something that the exploration
    excludes.
    """
    known = {fingerprint(proof.chart): proof for proof in proofs}
    left, told = [], []
    for chart in charts:
        proof = known.get(chart.fingerprint)
        if proof is None:
            left.append(chart)
            continue
        states = _within(chart.states, proof.states)
        transitions = _within(chart.transitions, proof.transitions)
        own = proof.chart.transitions
        decisions = tuple(
            decision
            for decision in chart.decisions
            if decision.true
            or decision.false
            or own[decision.transition].source in proof.states | {0}
        )
        left.append(replace(chart, states=states, transitions=transitions, decisions=decisions))
        gone = len(chart.states) - len(states), len(chart.transitions) - len(transitions)
        guards = len(chart.decisions) - len(decisions)
        if any((*gone, guards)):
            told.append(
                f"{chart.name}: out of reach are {quantity(gone[0], 'state')}, "
                f"{quantity(gone[1], 'transition')} and {quantity(guards, 'guard')}: {proof.proof}"
            )
    return tuple(left), tuple(told)


def _within(items: Sequence[Item], reached_: frozenset[int]) -> tuple[Item, ...]:
    return tuple(item for item in items if item.count or item.number in reached_)
