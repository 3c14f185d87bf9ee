"""The names of all signals between boards, plant and world. All values are 32-bit integers.

Boards and plant report their signals at connect; signals are connected by their names, so a board
reads only those that it needs.
"""

from __future__ import annotations

from typing import NamedTuple

PROTOCOL = 1
"""The version of the protocol."""
PWM_FULL = 4096
"""The PWM value of full torque."""
STEP = 1e-3
"""The time of a step, in s."""

AXES = ("feeder_belt", "feeder", "molder", "extractor", "extraction_belt", "rotator")
FEEDER_BELT, FEEDER, MOLDER, EXTRACTOR, EXTRACTION_BELT, ROTATOR = range(6)

SENSORS = ("B_F0", "B_P", "B_M", "B_E0", "B_E1", "B_E2")
"""Block sensors: 1 where a block is."""
SLOTS = ("f0", "p", "m", "x", "e0", "e1", "e2", "r")
"""Where a block can be, in the order of the ring; `x` and `r` are the hands of the robots."""
BUTTONS = ("start", "stop", "pause", "resume", "reset")
COUNTERS = ("inserted", "moulded", "ejected", "removed", "lost", "collisions")
"""The counts of the plant since its start."""

MODULES = (
    "supervisor", "feeder_belt", "feeder", "molder", "extractor", "extraction_belt", "sorter",
    "camera", "rotator",
)  # fmt: skip
"""The machines on the boards. ``X.state`` is the number of the state that X is in."""


class Ports(NamedTuple):
    """The inputs and outputs of a process, by names in their order."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


COMMANDS = (
    *(f"{axis}.{what}" for axis in AXES for what in ("pwm", "enable")),
    "extractor.magnet",
    "rotator.magnet",
    "sorter.out",
)
"""From the boards to the plant."""
MEASUREMENTS = (
    *(f"{axis}.{what}" for axis in AXES for what in ("encoder", "limit")),
    *SENSORS,
    "sorter.retracted",
)
"""From the plant to the boards."""
TRUTHS = (
    *(f"{axis}.position" for axis in AXES),
    "sorter.position",
    *(f"slot.{slot}" for slot in SLOTS),
    "view.block",
    "view.position",
    *(f"count.{counter}" for counter in COUNTERS),
)
"""Signals for the world and the record only: true positions in counts (of the sorter in
thousandths), the block in each slot, the block before the camera and where, in 0.1 mm."""
PLANT = Ports((*COMMANDS, "operator.insert", "operator.clear"), (*MEASUREMENTS, *TRUTHS))
WORLD_OUTPUTS = (
    "power", "estop", *(f"button.{button}" for button in BUTTONS),
    "camera.frame", "camera.id", "camera.verdict", "estimator.id", "estimator.sighted",
    "estimator.reject",
    "operator.insert", "operator.clear",
)  # fmt: skip
"""From operator and camera to boards and plant."""
