"""The step of time of a system: what its machines count in, and what divides all their delays."""

from __future__ import annotations

from math import gcd

from fsmkit.analysis.alphabet import delays_of
from fsmkit.diagnostics import fail
from fsmkit.system.system import System


def unit_of(system: System) -> int:
    """Return the greatest common divisor of all delays, in ticks; 0 where there is none."""
    ticks = {machine.chart.capacities.tick for machine in system.machines}
    if len(ticks) > 1:
        raise fail(
            "different-ticks",
            "the machines of this system count time in different ticks",
            system.machines[-1].span,
            help="give all charts the same `capacity: {tick: ...}`",
        )
    delays = [d for machine in system.machines for d in delays_of(machine.chart)]
    return gcd(*(1 if delay is None else delay for delay in delays)) if delays else 0
