"""The states of the machines of ring.yaml's plant, derived from a recording.

The explored plant has slots, places and motions; the simulated one has counts. Each function
returns a column: a value for each step. An axis is at a place within `NEAR` counts. A belt moves if
it is at no slot and went further than `MOVES` in `LAG` steps; meanwhile its blocks count for the
slots that they came from, because a motion is one step in the explored plant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from fsmkit.language import Literal
from fsmkit.system.machine import Machine
from fsmkit.system.properties.condition import Atom
from fsmkit.system.system import System

from .axes import PITCH
from .recording import Recording
from .signals import SLOTS

Column = npt.NDArray[np.int32]
Truth = npt.NDArray[np.bool_]

NEAR = 40
MOVES, LAG = 5, 20
AXIS_OF = {
    "feeder_belt_motor": "feeder_belt",
    "feeder_axis": "feeder",
    "door": "molder",
    "extractor_arm": "extractor",
    "extraction_belt_motor": "extraction_belt",
    "rotator_arm": "rotator",
}
"""The axes that the explored plant's machines represent."""
HOME, OFFSET, FAR = 1, 2, 3
"""Members of the type Place."""
HOME_AT = {"extractor": 1000, "rotator": 1000}
FAR_AT = {"feeder": 2800, "molder": 1500, "extractor": 2600, "rotator": 3100}
OFFSET_AT = 100
BELT_OF = {"f0": "feeder_belt", "p": "feeder_belt"} | dict.fromkeys(
    ("e0", "e1", "e2"), "extraction_belt"
)
EVENTS_OF = {
    "jammed": {"two_blocks", "drop_on_occupied", "feeder_beside_block"},
    "lost": {"off_the_end", "taken_away"},
    "dropped": {"dropped"},
}
"""The plant's reports, and the corresponding flags of the explored plant."""
GOOD, BAD = 1, 2


class Observed:
    """Columns by the names of machines and their members; None where nothing was recorded."""

    def __init__(
        self, system: System, recording: Recording, events: Sequence[Mapping[str, object]]
    ) -> None:
        self._system = system
        self._recording = recording
        self._events = events
        self._known: dict[tuple[int, int | None, str], Column | None] = {}

    def column(self, machine: int, state: int | None, variable: str) -> Column | None:
        """Return whether a state is active, or the value of a variable."""
        key = (machine, state, variable)
        if key not in self._known:
            found = self._system.machines[machine]
            self._known[key] = (
                self._variable(found, variable) if state is None else self._state(found, state)
            )
        return self._known[key]

    def recorded(self, atom: Atom) -> Column:
        """Return the column of an atom. Raises `LookupError`, with the name of an unknown one."""
        column = self.column(atom.machine, atom.state, atom.variable)
        if column is None:
            machine = self._system.machines[atom.machine]
            states = machine.chart.states
            what = atom.variable if atom.state is None else f"In({states[atom.state].id})"
            raise LookupError(f"`{machine.name}.{what}`")
        return column

    def _state(self, machine: Machine, state: int) -> Column | None:
        if machine.name in AXIS_OF:
            is_moving = machine.chart.states[state].id == "moving"
            return self.moving(AXIS_OF[machine.name]).astype(np.int32) if is_moving else None
        signal, states = f"{machine.name}.state", self._recording.about["states"]
        if signal not in self._recording:
            return None
        chart = machine.chart
        within = {s.id for s in chart.states if state in (s.index, *chart.ancestors(s.index))}
        leaves = [number for number, name in enumerate(states[machine.name]) if name in within]
        return np.isin(self._recording[signal], leaves).astype(np.int32)

    def _variable(self, machine: Machine, variable: str) -> Column | None:
        axis = AXIS_OF.get(machine.name)
        if axis is not None:
            position, home = self._recording[f"{axis}.position"], HOME_AT.get(axis, 0)
            rules: dict[str, Callable[[], Column | Truth]] = {
                "beyond": lambda: np.greater(position, max(home, OFFSET_AT) + NEAR),
                "before": lambda: np.less(position, home - NEAR),
                "at": lambda: self._place(axis),
                "enabled": lambda: self._recording[f"{axis}.enable"],
            }
            return rules[variable]().astype(np.int32) if variable in rules else None
        if (machine.name, variable) == ("pusher", "retracted"):
            retracted: Column = self._recording["sorter.retracted"]
            return retracted
        if variable == "fault_code" and f"{machine.name}.fault" in self._recording:
            code: Column = self._recording[f"{machine.name}.fault"]
            return code
        if (machine.name, variable) == ("sorter", "late"):
            return self._gave_up(machine)
        if (machine.name, variable) == ("feeder_belt", "requested"):
            return self._requested()
        if machine.name != "blocks":
            return None
        if variable in SLOTS:
            return np.not_equal(self.slot(variable), 0).astype(np.int32)
        if variable in EVENTS_OF:
            return self._happened(EVENTS_OF[variable])
        if variable == "total":
            total: Column = self._recording["count.inserted"].copy()
            for gone in ("ejected", "removed", "lost"):
                total -= self._recording[f"count.{gone}"]
            return total
        if variable == "wasted":
            return self._rejected_though_good()
        return self._bad_at_the_end() if variable == "bad_e2" else None

    def moving(self, axis: str) -> Truth:
        """Return when a belt moves."""
        position = self._recording[f"{axis}.position"]
        found = np.zeros(len(position), bool)
        found[LAG:] = np.abs(position[LAG:] - position[:-LAG]) > MOVES
        from_slot = np.abs((position + PITCH // 2) % PITCH - PITCH // 2)
        moving: Truth = found & (from_slot > NEAR)
        return moving

    def _states(self, machine: str, *names: str) -> Truth:
        """Return when a machine is in one of some states, by the names of leaves."""
        leaves = self._recording.about["states"][machine]
        numbers = [leaves.index(name) for name in names]
        found: Truth = np.isin(self._recording[f"{machine}.state"], numbers)
        return found

    def _gave_up(self, sorter: Machine) -> Column:
        """Return when the sorter has waited for a verdict up to its time limit, in ms."""
        limit = next(
            expression.value
            for name, expression in sorter.chart.constants
            if name == "T_VERDICT"
            and isinstance(expression, Literal)
            and isinstance(expression.value, int)
        )
        waits = self._states("sorter", "waiting_for_verdict")
        rows = np.arange(len(waits))
        before = np.maximum.accumulate(np.where(waits, 0, rows))
        return (rows - before >= limit).astype(np.int32)

    def _requested(self) -> Column:
        """Return at which times the rotator waits for a slot, including pauses of the wait."""
        waits = self._states("rotator", "waiting_for_place")
        rows = np.arange(len(waits))
        is_known = ~self._states("rotator", "paused")
        known = np.maximum.accumulate(np.where(is_known, rows, 0))
        return waits[known].astype(np.int32)

    def _place(self, axis: str) -> Column:
        position = self._recording[f"{axis}.position"]
        place = np.zeros(len(position), np.int32)
        places = ((OFFSET, OFFSET_AT), (FAR, FAR_AT[axis]), (HOME, HOME_AT.get(axis, 0)))
        for number, at in places:
            place[np.abs(position - at) <= NEAR] = number
        return place

    def slot(self, name: str) -> Column:
        """Return the block in a slot, or 0; while its belt moves, that which was there before."""
        blocks = self._recording[f"slot.{name}"]
        if name not in BELT_OF:
            return blocks
        rows = np.arange(len(blocks))
        still = np.where(self.moving(BELT_OF[name]), 0, rows)
        last: Column = blocks[np.maximum.accumulate(still)]
        return last

    def _happened(self, kinds: set[str]) -> Column:
        found = np.zeros(len(self._recording), np.int32)
        for event in self._events:
            if event["kind"] in kinds:
                found[max(0, round(1000 * float(str(event["time"]))) - 1) :] = 1
        return found

    def _bad_at_the_end(self) -> Column:
        """Return when a block is at the end of the belt whose last verdict was bad."""
        at_end = self.slot("e2")
        bad = np.zeros(len(at_end), np.int32)
        verdicts: dict[int, int] = {}
        rows = np.union1d(self._recording.changes(["camera.id", "camera.verdict"]), starts(at_end))
        for row in rows.tolist():
            block, verdict = (int(self._recording[f"camera.{w}"][row]) for w in ("id", "verdict"))
            if block:
                verdicts[block] = verdict
            there = int(at_end[row])
            if there and verdicts.get(there) == BAD:
                bad[row:][: _run(at_end, row)] = 1
        return bad

    def _rejected_though_good(self) -> Column:
        """Return from when on a block was pushed out whose last verdict was good."""
        found = np.zeros(len(self._recording), np.int32)
        for row, verdict in ejected(self._recording):
            if verdict == GOOD:
                found[row:] = 1
                break
        return found


def ejected(recording: Recording) -> list[tuple[int, int]]:
    """Return the rows at which the sorter pushed out a block, and its last verdict, 0 if none."""
    before, count = recording["slot.e1"], recording["count.ejected"]
    return [
        (row, _last_verdict(recording, int(before[row - 1]), row))
        for row in starts(count).tolist()
        if row
    ]


def passed(recording: Recording) -> list[tuple[int, int]]:
    """Return the rows at which a block passed the sorter, and its last verdict, 0 if none."""
    at_end = recording["slot.e2"]
    return [
        (row, _last_verdict(recording, int(at_end[row]), row))
        for row in starts(at_end).tolist()
        if at_end[row]
    ]


def _last_verdict(recording: Recording, block: int, row: int) -> int:
    """Return what the camera said last of a block before a row; 0: nothing."""
    seen = np.flatnonzero(recording["camera.id"][:row] == block)
    return int(recording["camera.verdict"][seen[-1]]) if len(seen) else 0


def starts(column: Column) -> npt.NDArray[np.intp]:
    """Return the rows at which a column has a new value."""
    if not len(column):
        return np.zeros(0, np.intp)
    return np.concatenate(([0], np.flatnonzero(column[1:] != column[:-1]) + 1)).astype(np.intp)


def _run(column: Column, row: int) -> int:
    """Return for how many rows a column keeps its value."""
    other = np.flatnonzero(column[row:] != column[row])
    return int(other[0]) if len(other) else len(column) - row
