"""The Production Cell: the network against the explorer in C, by the number of stable states and
by all verdicts. ``python -m tests.verify.export.uppaal_cell [NAME ...]`` prints a line for each.
"""

from __future__ import annotations

import sys
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from fsmkit.diagnostics import Findings
from fsmkit.verify.closed import close
from fsmkit.verify.engine import CEngine
from fsmkit.verify.export.uppaal.translate import translated
from fsmkit.verify.replay import load_any
from tests.verify.export.uppaal_meaning import Meaning

CELL = Path(__file__).parents[3] / "machines/production_cell"
NAMES = ("feeder", "molder", "pairs/rotator-feeder_belt")
MEMORY = 4 << 30


@dataclass(frozen=True)
class Agreement:
    """``ours``, ``theirs``: stable states of the explorer and of the network."""

    ours: int
    theirs: int
    judged: int
    differing: tuple[str, ...]
    """Properties of which the verdicts differ."""


def agreement(name: str, most: int = 10**6) -> Agreement:
    """Compare without time, watchdogs silent."""
    closed = close(load_any(CELL / f"{name}.yaml", Findings()), untimed=True, silent=True)
    with closing(CEngine(closed, Findings())) as engine:
        found = engine.explore(MEMORY, 0, None)
    assert found.end.value == "complete"
    network = translated(closed, flat=True, draw=False)
    meaning = Meaning(network)
    states = meaning.reached(most)
    stable = sum(not meaning.is_committed(s) for s in states)
    judged, differing = 0, []
    for number, (property_, query) in enumerate(
        zip(closed.system.properties, network.queries, strict=False)
    ):
        if not query.formula or "-->" in query.formula:
            continue
        kind = property_.kind.value
        seen = found.mark(0 if kind == "deadlock_free" else 1 + number) is not None
        judged += 1
        if meaning.verdict(query.formula, states) is not (seen is (kind == "reachable")):
            differing.append(property_.name)
    return Agreement(found.states, stable, judged, tuple(differing))


if __name__ == "__main__":
    for name in sys.argv[1:] or NAMES:
        begun = time.monotonic()
        told = agreement(name, 10**7)
        sys.stdout.write(f"{name}: {told}, {time.monotonic() - begun:.0f} s\n")
        sys.stdout.flush()
