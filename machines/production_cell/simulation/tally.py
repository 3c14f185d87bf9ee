"""The totals of a run: blocks, throughput, mishaps, and the states of the machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import fsmkit
from fsmkit.language import EnumType

from .axes import PITCH
from .observed import GOOD, NEAR, Column, ejected, passed, starts
from .orchestrator import Outcome
from .recording import Recording
from .signals import COUNTERS, MODULES, SLOTS


@dataclass(frozen=True)
class Tally:
    """Figures of a run; times in s, throughput in blocks a minute while the cell produces."""

    simulated: float
    producing: float
    inserted: int
    moulded: int
    returned: int
    """Laid on the feeder belt by the rotator."""
    rejected: int
    bad_passed: int
    """Blocks that passed the sorter, though they were not judged good."""
    good_rejected: int
    removed: int
    """Taken away by the operator before he resets, as no sensor sees them."""
    lost: int
    doubled: int
    """Steps in which one block was in two slots, or more blocks in the ring than there are."""
    left: int
    collisions: int
    throughput: float
    estimates: int
    """How often a block stood before the sorter."""
    wrong_estimates: int
    ends_in: str
    """State of the supervisor."""
    overruns: int
    link_losses: int
    refused: int
    step_rate: float
    ping_rate: float
    timeline: tuple[tuple[float, str], ...] = field(repr=False)
    """Faults, and what supervisor and failing modules did about them."""

    @property
    def processed(self) -> int:
        """Blocks that went all the way: back to the feeder belt, or rejected."""
        return self.returned + self.rejected

    @property
    def is_accounted_for(self) -> bool:
        """Whether every block is where it should be."""
        gone = self.rejected + self.removed + self.lost
        return self.inserted - gone == self.left and not self.doubled

    def as_json(self) -> dict[str, Any]:
        """Return the figures by name."""
        return asdict(self) | {"processed": self.processed}


def tally(recording: Recording, outcome: Outcome) -> Tally:
    """Return the figures of a run."""
    slots = np.stack([recording[f"slot.{slot}"] for slot in SLOTS], axis=1)
    states = recording.about["states"]
    supervisor = recording["supervisor.state"]
    producing = int((supervisor == states["supervisor"].index("producing")).sum()) / 1000
    last = {name: int(recording[f"count.{name}"][-1]) for name in COUNTERS}
    in_hand, on_belt = recording["slot.r"], recording["slot.f0"]
    laid = (in_hand[:-1] != 0) & (in_hand[1:] == 0) & (on_belt[1:] == in_hand[:-1])
    estimates, wrong = _estimates(recording)
    reports = [*outcome.reports.values(), *(r for lives in outcome.lives.values() for r in lives)]
    return Tally(
        simulated=len(recording) / 1000,
        producing=producing,
        inserted=last["inserted"],
        moulded=last["moulded"],
        returned=int(laid.sum()),
        rejected=last["ejected"],
        bad_passed=sum(verdict != GOOD for _, verdict in passed(recording)),
        good_rejected=sum(verdict == GOOD for _, verdict in ejected(recording)),
        removed=last["removed"],
        lost=last["lost"],
        doubled=_doubled(recording, slots),
        left=int((slots[-1] != 0).sum()),
        collisions=last["collisions"],
        throughput=60 * last["moulded"] / producing if producing else 0.0,
        estimates=estimates,
        wrong_estimates=wrong,
        ends_in=states["supervisor"][int(supervisor[-1])],
        overruns=_sum(reports, "overruns"),
        link_losses=_sum(reports, "losses"),
        refused=_sum(reports, "refused"),
        step_rate=outcome.step_rate,
        ping_rate=outcome.ping_rate,
        timeline=timeline(recording, outcome),
    )


def _sum(reports: list[Mapping[str, Any]], name: str) -> int:
    return sum(int(report.get(name, 0)) for report in reports)


def _doubled(recording: Recording, slots: Column) -> int:
    """Return in how many steps a block was twice there."""
    rows = recording.changes([f"slot.{slot}" for slot in SLOTS])
    lengths = np.diff(np.append(rows, len(recording)))
    found = 0
    for row, length in zip(rows.tolist(), lengths.tolist(), strict=True):
        there = [block for block in slots[row].tolist() if block]
        found += length if len(set(there)) < len(there) else 0
    return found


def _estimates(recording: Recording) -> tuple[int, int]:
    """Return how often a block came to stand before the sorter, and was taken for another."""
    from_slot = (recording["extraction_belt.position"] + PITCH // 2) % PITCH - PITCH // 2
    there = (np.abs(from_slot) < NEAR) & (recording["slot.e1"] != 0)
    rows = starts(there.astype(np.int32))
    rows = rows[there[rows]]
    wrong = recording["estimator.id"][rows] != recording["slot.e1"][rows]
    return len(rows), int(wrong.sum())


def timeline(recording: Recording, outcome: Outcome) -> tuple[tuple[float, str], ...]:
    """Return what happened about faults, in the order of time."""
    states = recording.about["states"]
    told = []
    for line in outcome.told:
        time, _, what = line.partition(" s ")
        told.append((float(time), f"fault: {what}"))
    for module in MODULES:
        names, column = states[module], recording[f"{module}.state"]
        for row in starts(column).tolist():
            name = names[int(column[row])]
            if module == "supervisor" or name == "error":
                failed = name in {"error", "faulted"}
                code = _fault(recording, module, row) if failed else ""
                told.append(((row + 1) / 1000, f"{module}: {name}{code}"))
    return tuple(sorted(told, key=lambda entry: entry[0]))


@cache
def _fault_names() -> tuple[str, ...]:
    """Return the members of the type Fault, as the charts have it."""
    chart = fsmkit.read_chart(Path(__file__).resolve().parents[1] / "supervisor.yaml")
    types = (variable.type for variable in chart.outputs if variable.name == "fault_code")
    return next(type_.members for type_ in types if isinstance(type_, EnumType))


def _fault(recording: Recording, module: str, row: int) -> str:
    """Return the fault of a module, in parentheses."""
    signal = f"{module}.fault"
    if signal not in recording:
        return ""
    return f" ({_fault_names()[int(recording[signal][row])]})"
