"""Feeder and molder in a 1 kHz loop, against simulated axes.

Usage: loop.py SECONDS. Prints what the machines do, one line each: time in milliseconds, machine,
operation or event or the states it came to rest in. ``make demo`` runs it; by hand::

    fsmkit compile cell.yaml --target python --out generated
    PYTHONPATH=generated python controller/loop.py 60

loop.c is the same program, section by section, and prints the same lines.
"""

# ruff: noqa: D102  (the methods are the operations and events of the charts)

from __future__ import annotations

import sys

from axis import Axis
from feeder import Feeder, Place
from molder import Molder

# Encoder counts, as in feeder.yaml and molder.yaml.
HOME, OFFSET, PUSHED, OPEN = 0, 100, 2800, 1500

# Milliseconds.
POWER_ON, BELT_TIME, EXTRACT_TIME, RELAY_TIME = 100, 1000, 1500, 1000
PAUSE_AT, RESUME_AT, STOP_AT, ESTOP_AT = 20000, 22000, 30000, 40000


# --- the feeder: what it calls, and what it sends -------------------------------------------------


class CellFeeder(Feeder):
    """The generated machine; its operations are methods."""

    __slots__ = ("cell",)

    def __init__(self, cell: Cell) -> None:
        super().__init__()
        self.cell = cell

    def motor_enable(self) -> None:
        self.cell.say("feeder", "motor_enable")
        self.cell.pusher.enabled = True

    def motor_disable(self) -> None:
        self.cell.say("feeder", "motor_disable")
        self.cell.pusher.stop()
        self.cell.pusher.enabled = False

    def hold(self) -> None:
        self.cell.say("feeder", "hold")
        self.cell.pusher.stop()

    def seek(self, speed: int) -> None:
        self.cell.say("feeder", "seek")
        self.cell.pusher.seek(speed)

    def goto(self, position: int, speed: int) -> None:
        self.cell.say("feeder", f"goto {position} {speed}")
        self.cell.pusher.goto(position, speed)

    def send_pushed(self) -> None:
        self.cell.say("feeder", "!pushed")
        self.cell.must(self.cell.molder.post_pushed())

    def send_feeder_clear(self) -> None:
        self.cell.say("feeder", "!feeder_clear")
        self.cell.must(self.cell.molder.post_feeder_clear())

    def send_pocket_free(self) -> None:
        self.cell.say("feeder", "!pocket_free")
        if self.cell.belt_due == 0:
            self.cell.belt_due = self.cell.now + BELT_TIME

    def send_is_homed(self) -> None:
        self.cell.say("feeder", "!is_homed")
        self.cell.must(self.cell.molder.post_home_permit())

    def send_is_ready(self) -> None:
        self.cell.say("feeder", "!is_ready")
        self.cell.feeder_ready = True
        self.cell.start_when_ready()

    def send_has_fault(self, code: int) -> None:
        """Log the fault of the feeder, and stop the cell."""
        self.cell.say("feeder", f"!has_fault {code}")
        self.cell.trip()


# --- the molder: what it calls, and what it sends -------------------------------------------------


class CellMolder(Molder):
    """The generated machine; its operations are methods."""

    __slots__ = ("cell",)

    def __init__(self, cell: Cell) -> None:
        super().__init__()
        self.cell = cell

    def motor_enable(self) -> None:
        self.cell.say("molder", "motor_enable")
        self.cell.door.enabled = True

    def motor_disable(self) -> None:
        self.cell.say("molder", "motor_disable")
        self.cell.door.stop()
        self.cell.door.enabled = False

    def hold(self) -> None:
        self.cell.say("molder", "hold")
        self.cell.door.stop()

    def seek(self, speed: int) -> None:
        self.cell.say("molder", "seek")
        self.cell.door.seek(speed)

    def goto(self, position: int, speed: int) -> None:
        self.cell.say("molder", f"goto {position} {speed}")
        self.cell.door.goto(position, speed)

    def heat(self, on: bool) -> None:
        self.cell.say("molder", "heat on" if on else "heat off")

    def send_mold_ready(self) -> None:
        self.cell.say("molder", "!mold_ready")
        self.cell.must(self.cell.feeder.post_mold_ready())

    def send_mold_done(self) -> None:
        self.cell.say("molder", "!mold_done")
        self.cell.must(self.cell.feeder.post_mold_done())

    def send_extract_ready(self) -> None:
        self.cell.say("molder", "!extract_ready")
        if self.cell.extract_due == 0:
            self.cell.extract_due = self.cell.now + EXTRACT_TIME

    def send_is_homed(self) -> None:
        self.cell.say("molder", "!is_homed")

    def send_is_ready(self) -> None:
        self.cell.say("molder", "!is_ready")
        self.cell.molder_ready = True
        self.cell.start_when_ready()

    def send_has_fault(self, code: int) -> None:
        """Log the fault of the feeder, and stop the cell."""
        self.cell.say("molder", f"!has_fault {code}")
        self.cell.trip()


class Cell:
    """The environment of the two machines: axes, blocks, belt, extractor, panel."""

    def __init__(self) -> None:
        self.now = 0
        self.feeder = CellFeeder(self)
        self.molder = CellMolder(self)
        self.pusher, self.door = Axis(300), Axis(700)
        self.pocket = self.cavity = False  # a block lies there
        self.belt_due = self.extract_due = 0  # 0: nothing on its way
        self.release_due = 0  # of the safety relay
        self.feeder_ready = self.molder_ready = False
        self.blocks = 0  # moulded and taken out

    def say(self, machine: str, what: str) -> None:
        """Print a line."""
        print(f"{self.now} {machine} {what}")

    def must(self, posted: bool) -> None:
        """Raise an error for a full queue; `fsmkit check cell.yaml` proves that none occurs."""
        if not posted:
            self.say("cell", "QUEUE FULL")

    # --- the panel -----------------------------------------------------------------------------

    def trip(self) -> None:
        """Trip the safety relay."""
        self.say("panel", "emergency stop")
        self.must(self.feeder.post_estop())
        self.must(self.molder.post_estop())
        self.belt_due = self.extract_due = 0
        self.release_due = self.now + RELAY_TIME

    def home(self) -> None:
        """Let the feeder home; when it has, the molder may."""
        self.feeder_ready = self.molder_ready = False
        self.must(self.feeder.post_home_permit())

    def stop(self) -> None:
        """Stop both; they start again when both have come to a safe place."""
        self.say("panel", "stop")
        self.feeder_ready = self.molder_ready = False
        self.must(self.feeder.post_stop())
        self.must(self.molder.post_stop())

    def start_when_ready(self) -> None:
        """Start both once both are ready."""
        if not self.feeder_ready or not self.molder_ready:
            return
        self.say("panel", "start")
        self.must(self.feeder.post_start())
        self.must(self.molder.post_start())
        if self.pocket:
            self.must(self.feeder.post_block_ready())

    def panel(self) -> None:
        """Press the buttons, each at its time, and release the relay."""
        if self.now == POWER_ON:
            self.must(self.feeder.post_power_ok())
            self.must(self.molder.post_power_ok())
            self.home()
        elif self.now == PAUSE_AT:
            self.must(self.feeder.post_pause())
            self.must(self.molder.post_pause())
        elif self.now == RESUME_AT:
            self.must(self.feeder.post_resume())
            self.must(self.molder.post_resume())
        elif self.now == STOP_AT:
            self.stop()
        elif self.now == ESTOP_AT:
            self.trip()
        if self.release_due != 0 and self.now == self.release_due:
            self.release_due = 0
            self.must(self.feeder.post_estop_clear())
            self.must(self.molder.post_estop_clear())
            self.must(self.feeder.post_reset())
            self.must(self.molder.post_reset())
            self.home()

    # --- the rest of the cell ------------------------------------------------------------------

    def neighbours(self) -> None:
        """Let the belt bring a block, and the extractor take one."""
        if self.belt_due != 0 and self.now == self.belt_due:
            self.belt_due = 0
            self.pocket = True
            self.must(self.feeder.post_block_ready())
        if self.extract_due != 0 and self.now == self.extract_due:
            self.extract_due = 0
            self.cavity = False
            self.blocks += 1
            self.must(self.molder.post_extract_clear())

    def axes(self) -> None:
        """Move both axes by a millisecond."""
        match self.pusher.step():
            case "arrived":
                if self.pusher.is_at(PUSHED) and self.pocket:
                    self.cavity = True
                    self.pocket = False
                self.must(self.feeder.post_arrived())
            case "limit":
                self.must(self.feeder.post_limit())
        match self.door.step():
            case "arrived":
                self.must(self.molder.post_arrived())
            case "limit":
                self.must(self.molder.post_limit())

    def inputs(self) -> None:
        """Give both machines their inputs."""
        self.feeder.at = place(self.pusher, PUSHED)
        self.feeder.pocket_occupied = self.pocket
        self.feeder.cavity_occupied = self.cavity
        self.molder.at = place(self.door, OPEN)
        self.molder.cavity_occupied = self.cavity

    def print_states(self, name: str, machine: Feeder | Molder, was: set[str]) -> None:
        """Print the states that became active since the last tick."""
        now = {state for state in machine.STATES[1:] if machine.is_in(state)}
        for state in machine.STATES[1:]:
            if state in now - was:
                self.say(name, state)
        was.clear()
        was |= now

    def run(self, end: int) -> None:
        """Run until a time, in milliseconds."""
        feeder_was: set[str] = set()
        molder_was: set[str] = set()
        self.feeder.start(0)
        self.molder.start(0)
        for self.now in range(1, end + 1):
            self.panel()
            self.axes()
            self.neighbours()
            self.inputs()
            self.feeder.run(self.now)
            self.molder.run(self.now)
            self.print_states("feeder", self.feeder, feeder_was)
            self.print_states("molder", self.molder, molder_was)
        self.say("cell", f"{self.blocks} blocks moulded")


def place(axis: Axis, far_end: int) -> Place:
    """Return the readings of the position sensors of an axis."""
    if axis.moving:
        return Place.between
    if axis.is_at(HOME):
        return Place.home
    if axis.is_at(OFFSET):
        return Place.offset
    return Place.far if axis.is_at(far_end) else Place.between


if __name__ == "__main__":
    Cell().run(int(sys.argv[1]) * 1000 if len(sys.argv) > 1 else 60000)
