"""The Production Cell: the network for UPPAAL against the explorer in C.

Both must find as many stable states, and the same verdicts.
``python -m tests.export.uppaal_cell [NAME ...]`` prints a line for each chart and pair.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial

from fsmkit.diagnostics import Findings
from fsmkit.export.uppaal.translate import translate
from fsmkit.system.properties.kinds import deadlock_free, reachable
from fsmkit.system.system import System
from fsmkit.verify.engines.c.engine import CEngine
from fsmkit.verify.statespace.closed_system import close
from tests.export.agreement import CELL, CHARTS, PAIRS, disturbances, disturbed, loaded
from tests.export.uppaal_meaning import Meaning

MEMORY = 4 << 30


@dataclass(frozen=True)
class Agreement:
    """``ours``, ``theirs``: stable states of the explorer and of the network."""

    ours: int
    theirs: int
    evaluated: int
    differing: tuple[str, ...]
    """Properties of which the verdicts differ."""


def agreement(
    system: System, *, untimed: bool = True, paced: bool = True, most: int = 10**7
) -> Agreement:
    """Compare; untimed, watchdogs are silent. The network resets no data, so none are reset."""
    closed = close(system, untimed=untimed, silent=untimed, keeps_dead=True)
    with closing(CEngine(closed, Findings())) as engine:
        found = engine.explore(MEMORY, 0, None)
    assert found.end.value == "complete"
    network = translate(closed, flat=True, paced=paced, draw=False)
    meaning = Meaning(network, 0 if untimed else closed.unit)
    states = meaning.reached(most)
    stable = len({meaning.without_time(s) for s in states if not meaning.is_committed(s)})
    evaluated, differing = 0, []
    for number, (property_, query) in enumerate(
        zip(closed.system.properties, network.queries, strict=False)
    ):
        if not query.formula or "-->" in query.formula:
            continue
        kind = property_.kind
        seen = found.mark(0 if kind is deadlock_free.KIND else 1 + number) is not None
        evaluated += 1
        expected = seen is (kind is reachable.KIND)
        if meaning.verdict(query.formula, states) is not expected:
            differing.append(property_.name)
    return Agreement(found.states, stable, evaluated, tuple(differing))


def cases() -> Iterator[tuple[str, Callable[[], System]]]:
    """Yield the charts, and the pairs: undisturbed, and with each disturbance by itself."""
    for name in CHARTS:
        yield name, partial(loaded, CELL / f"{name}.yaml")
    for path in PAIRS:
        system = loaded(path)
        for what in ("", *disturbances(system)):
            yield f"{path.stem}, {what}".rstrip(", "), partial(disturbed, system, what)


if __name__ == "__main__":
    for name, load in cases():
        if sys.argv[1:] and not any(asked in name for asked in sys.argv[1:]):
            continue
        begun = time.monotonic()
        told = agreement(load())
        sys.stdout.write(f"{name}: {told}, {time.monotonic() - begun:.0f} s\n")
        sys.stdout.flush()
