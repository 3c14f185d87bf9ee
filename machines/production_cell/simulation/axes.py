"""The six motorised axes: a motor's torque moves an inertia against friction, between end stops.

A position is in m (belts, feeder) or rad (door, robots), and likewise forces are in N or N m,
inertia in kg or kg m^2. Plain numbers: six axes are too few for NumPy to be faster (it took more
than twice the time), and an axis at rest costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .signals import PWM_FULL, STEP

LINEAR, ANGULAR = 1e-4, math.radians(0.1)
"""An encoder count: 0.1 mm, or 0.1 degree."""
COUNT = (LINEAR, LINEAR, ANGULAR, ANGULAR, LINEAR, ANGULAR)
INERTIA = (0.8, 0.5, 0.01, 0.02, 0.8, 0.02)
STOPS = (math.inf, 2830.0, 1560.0, 2680.0, math.inf, 3180.0)
"""The end stops, in counts; belts have none."""
LOWER_STOP = -40.0
TOP_SPEED = 3000.0
"""Speed of every axis at full PWM, in counts per second."""
TIME_CONSTANT = 0.04
"""Time constant of every axis without a load, in s."""
PITCH = 1000
"""From slot to slot of a belt, in counts."""
MARK = 5
"""Half the width of the mark at each pitch of a belt, in counts."""
START = ((-300, -100), (100, 500), (300, 900), (700, 1200), (-300, -100), (700, 1200))
"""The range of initial positions in counts: no axis blocks another."""


class Axis(NamedTuple):
    """The constant parameters of an axis."""

    unit: float
    """An encoder count, in m or rad."""
    inertia: float
    viscous: float
    """N s/m or N m s/rad."""
    coulomb: float
    """N or N m."""
    stiction: float
    """The force or torque needed to start moving, in N or N m."""
    torque: float
    """For each unit of PWM, in N or N m."""
    lowest: float
    highest: float
    """The end stops, in m or rad; infinite for belts."""
    is_belt: bool


class AxisState(NamedTuple):
    """Where an axis is and how fast."""

    position: float
    velocity: float
    decay: float
    """The remaining share of a speed deviation after a step; depends on the load."""
    origin: float
    """Where the encoder began to count."""
    jammed: bool = False
    hit: bool = False
    """Driven into an end stop in this step."""


def make(chance: np.random.Generator) -> tuple[Axis, ...]:
    """Return axes whose friction differs a little from one cell to the next."""
    found = []
    for count, inertia, stop in zip(COUNT, INERTIA, STOPS, strict=True):
        viscous = inertia / TIME_CONSTANT
        top = TOP_SPEED * count
        coulomb = 0.08 * viscous * top * chance.uniform(0.8, 1.2)
        found.append(
            Axis(
                unit=count,
                inertia=inertia,
                viscous=viscous * chance.uniform(0.95, 1.05),
                coulomb=coulomb,
                stiction=1.25 * coulomb,
                torque=(viscous * top + coulomb) / PWM_FULL,
                lowest=-math.inf if math.isinf(stop) else LOWER_STOP * count,
                highest=stop * count,
                is_belt=math.isinf(stop),
            )
        )
    return tuple(found)


def initial(axes: Sequence[Axis], chance: np.random.Generator) -> tuple[AxisState, ...]:
    """Return axes at given positions, from which the encoders count."""
    states = []
    for axis, (low, high) in zip(axes, START, strict=True):
        position = chance.uniform(low, high) * axis.unit
        states.append(loaded(axis, AxisState(position, 0.0, 0.0, position), 0.0))
    return tuple(states)


def loaded(axis: Axis, state: AxisState, load: float) -> AxisState:
    """Return the axis with a load, in kg or kg m^2, added to its inertia."""
    return state._replace(decay=math.exp(-STEP * axis.viscous / (axis.inertia + load)))


def step(axis: Axis, state: AxisState, pwm: int) -> AxisState:
    """Move an axis by a step. ``pwm``: -4096 to 4096, and 0 where the motor is not enabled.

    Between two reversals the law is linear and is solved exactly, so no smaller step is needed.
    """
    position, velocity, decay, origin, jammed, hit = state
    drive = axis.torque * max(-PWM_FULL, min(PWM_FULL, pwm))
    if velocity == 0.0:
        if jammed or abs(drive) <= axis.stiction:
            return state._replace(hit=False) if hit else state
        friction = math.copysign(axis.coulomb, drive)
    else:
        friction = math.copysign(axis.coulomb, velocity)
    final = (drive - friction) / axis.viscous
    faster = final + (velocity - final) * decay
    if faster * velocity < 0 or jammed:
        faster = 0.0  # friction brings to rest, and never beyond
    position += 0.0 if jammed else 0.5 * STEP * (velocity + faster)
    if axis.lowest <= position <= axis.highest:
        return AxisState(position, faster, decay, origin, jammed)
    inside = min(max(position, axis.lowest), axis.highest)
    return AxisState(inside, 0.0, decay, origin, jammed, hit=True)


def encoder(axis: Axis, state: AxisState) -> int:
    """Return the counts of the encoder since the start."""
    return math.floor((state.position - state.origin) / axis.unit + 0.5)


def limit(axis: Axis, counts: float) -> bool:
    """Whether the limit switch is closed: at zero and behind it; of a belt, at each pitch."""
    if axis.is_belt:
        return abs((counts + PITCH / 2) % PITCH - PITCH / 2) <= MARK
    return counts <= 0
