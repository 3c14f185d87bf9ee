"""Convert the local states of the core to snapshots of the interpreter."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from fsmkit.runtime.interpreter.snapshot import Snapshot
from fsmkit.runtime.snapshot_bytes import unpack
from fsmkit.verify.engines.c.shapes import shapes_of
from fsmkit.verify.engines.c.used_elements import cut_arrays
from fsmkit.verify.statespace.closed_system import ClosedSystem, with_greatest_delays
from fsmkit.verify.statespace.exploration import Exploration


def local_states(
    closed: ClosedSystem, found: Exploration, machines: Collection[int]
) -> Mapping[int, tuple[Snapshot, ...]]:
    """Return the local states of some machines that an exploration kept (`Figures.saved`).

    Timers are in the order of the core; in zones their durations are their deadlines. There may be
    more than the reachable ones, as local steps count even where another machine has to move first.
    """
    states: dict[int, tuple[Snapshot, ...]] = {}
    cut = cut_arrays(closed)
    for shape in shapes_of(cut.closed.charts):
        chart = with_greatest_delays(shape.chart)
        for machine in shape.machines:
            saved = found.machines[machine].saved
            if machine not in machines or not saved:
                continue
            inputs = len(closed.charts[machine].inputs)  # after them are the constants of a shape
            own = (unpack(chart, each, 0) for each in saved)
            own = (replace(state, inputs=state.inputs[:inputs]) for state in own)
            states[machine] = tuple(cut.restored(machine, state) for state in own)
    return states
