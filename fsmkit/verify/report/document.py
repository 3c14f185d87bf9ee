"""A report as data, for ``fsmkit check --json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite

from fsmkit.diagnostics.as_json import as_json as finding_as_json
from fsmkit.verify.report.counterexample import as_json
from fsmkit.verify.report.figures import count_in_json
from fsmkit.verify.report.verdict import Report, Result
from fsmkit.verify.statespace.closed_system import UNLIMITED
from fsmkit.verify.statespace.exploration import End, Exploration
from fsmkit.verify.statespace.storage import (
    LossyTable,
    Storage,
    expected_omissions,
    omission_probability,
)
from fsmkit.verify.statespace.symbolic_search import Search


def document(found: Report) -> Mapping[str, object]:
    """Return verdicts with their traces, figures, findings and bounds, for JSON."""
    explored = found.exploration
    return {
        "verdict": found.verdict.value,
        "states": count_in_json(explored.states),
        **({"zones": explored.zones} if found.closed.zones else {}),
        "transitions": count_in_json(explored.transitions),
        "depth": None if explored.diagram is not None else explored.depth,
        "seconds": round(explored.seconds, 3),
        "engine": explored.engine,
        "cores": explored.cores,
        "spent": {stage: round(seconds, 3) for stage, seconds in found.spent.items()},
        "time": time_of(found),
        "max_pending": None if found.closed.max_pending == UNLIMITED else found.closed.max_pending,
        "exact": explored.table is None,
        "search": _searched(found),
        **({} if explored.traffic is None else {"ranks": asdict(explored.traffic)}),
        "storage": _stored(explored, explored.table),
        "complete": explored.end is End.COMPLETE and explored.table is None,
        "properties": [_evaluated(one) for one in found.results],
        "findings": [finding_as_json(finding) for finding in found.findings],
        "bounds": {
            machine.name: {
                "queue": figures.queue,
                "timers": figures.timers,
                "microsteps": figures.microsteps,
            }
            for machine, figures in zip(
                found.closed.system.machines, explored.machines, strict=True
            )
        },
        "parameters": dict(found.closed.system.parameters),
        "assumptions": list(found.assumptions),
    }


def _searched(found: Report) -> Mapping[str, object]:
    """Return the search procedure and the storage of states."""
    explored, diagram = found.exploration, found.exploration.diagram
    if diagram is None:
        return {"engine": Search.EXPLICIT.value}
    machines = found.closed.system.machines
    return {
        "engine": Search.SYMBOLIC.value,
        "nodes": diagram.nodes,
        "peak": diagram.peak,
        "bytes": diagram.bytes,
        "order": [machines[number].name for number in diagram.order],
        "order_from": diagram.found_by,
        "events": diagram.events,
        "explicit_states": explored.explicit_states,
    }


def _stored(explored: Exploration, table: LossyTable | None) -> Mapping[str, object]:
    """Return the storage, and bounds on the states it may have missed (null: without bound)."""
    if table is None:
        return {"kind": Storage.EXACT.value}
    match = table.match_probability
    omitted = expected_omissions(match, explored.states)
    return {
        "kind": table.storage.value,
        "bytes": table.bytes,
        "match_probability": match,
        "expected_omissions": omitted if isfinite(omitted) else None,
        "omission_probability": omission_probability(match, explored.depth),
    }


def time_of(found: Report) -> str:
    """Return the model of time: ``zones``, ``discrete``, ``untimed``; ``none`` without delays."""
    closed = found.closed
    if closed.untimed:
        return "untimed"
    return "zones" if closed.zones else "discrete" if closed.unit else "none"


def _evaluated(one: Result) -> Mapping[str, object]:
    record: dict[str, object] = {
        "name": one.name,
        "kind": one.kind.key if one.kind is not None else one.name.rpartition(".")[2],
        "verdict": one.verdict.value,
    }
    if one.reason:
        record["reason"] = one.reason
    if one.trace is not None:
        record["trace"] = as_json(one.trace)
        record["replayed"] = list(one.trace.replayed)
        record |= {"shortest": False} if one.trace.is_longer else {}
    return record
