"""The plant: axes, sorter, magnets, blocks and sensors, a step at a time.

`step` is a function of a state and the commands; the same seed gives the same run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from . import axes, blocks
from .axes import Axis, AxisState
from .blocks import COLLISIONS, Block, Event, Where
from .signals import (
    AXES,
    COUNTERS,
    EXTRACTION_BELT,
    EXTRACTOR,
    FEEDER,
    FEEDER_BELT,
    MEASUREMENTS,
    ROTATOR,
    SENSORS,
    SLOTS,
    STEP,
)

STROKE = 0.2
"""The travel time of the sorter, out or in, in s."""
FIELD_TIME = 0.04
"""Time constant of a magnet, in s."""
GRIPS, HOLDS = 0.6, 0.2
"""Share of the full field that takes a block, and that keeps it."""
SEES, FORGETS = 0.020, 0.024
"""How near a block comes before a sensor sees it, and how far it goes before it does not, in m."""
SENSOR_NOISE = 0.0003
"""The noise of the distance at which a sensor switches, in m."""
LAID = 0.0007
"""How exactly a block is laid down, in m."""
NOISE = 4096
"""Random numbers drawn at the start, and reused."""
WATCHED = {
    "B_F0": (FEEDER_BELT, 0.0),
    "B_P": (FEEDER_BELT, blocks.PITCH),
    "B_M": (FEEDER, blocks.CAVITY),
    "B_E0": (EXTRACTION_BELT, 0.0),
    "B_E1": (EXTRACTION_BELT, blocks.PITCH),
    "B_E2": (EXTRACTION_BELT, 2 * blocks.PITCH),
}
"""The target of each sensor: a belt, or the lane as `FEEDER`, and the position on it."""
MASS = 0.12
"""The mass of a block, in kg; it varies by a tenth."""


@dataclass(frozen=True)
class Plant:
    """The constants of a plant: parameters, and the random numbers of this cell."""

    axes: tuple[Axis, ...]
    noise: tuple[float, ...]
    masses: tuple[float, ...]
    """The masses of blocks, by number."""


@dataclass(frozen=True)
class Faults:
    """The current faults."""

    jammed: frozenset[str] = frozenset()
    stuck: tuple[tuple[str, int], ...] = ()
    """Sensors, and what they say."""


class PlantState(NamedTuple):
    """Where everything is."""

    number: int
    """Steps since the start."""
    axes: tuple[AxisState, ...]
    blocks: tuple[Block, ...]
    sorter: float
    """0 is in, 1 out."""
    fields: tuple[float, float]
    """The fields of the magnets of extractor and rotator, as a share of the full field."""
    sensors: tuple[bool, ...]
    hazards: frozenset[tuple[str, int]]
    """The current hazards, which were reported already."""
    counted: tuple[int, ...]
    """As `COUNTERS`."""
    faults: Faults


def make(seed: int) -> tuple[Plant, PlantState]:
    """Return the initial plant of a seed: an empty ring, without power."""
    chance = np.random.default_rng(seed)
    parameters = axes.make(chance)
    noise = tuple(float(x) for x in np.clip(chance.standard_normal(NOISE), -3, 3))
    masses = tuple(float(x) for x in MASS * chance.uniform(0.9, 1.1, NOISE))
    state = PlantState(
        0, axes.initial(parameters, chance), (), 0.0, (0.0, 0.0), (False,) * len(SENSORS),
        frozenset(), (0,) * len(COUNTERS), Faults(),
    )  # fmt: skip
    return Plant(parameters, noise, masses), state


def step(
    plant: Plant, state: PlantState, commands: Sequence[int]
) -> tuple[PlantState, tuple[Event, ...]]:
    """Advance by a step; return also what happened. ``commands``: as `signals.PLANT.inputs`."""
    was = state.axes
    moved = tuple(
        axes.step(axis, rest, pwm if enable else 0)
        for axis, rest, pwm, enable in zip(
            plant.axes, was, commands[0:12:2], commands[1:12:2], strict=True
        )
    )
    extractor, rotator, push, insert, clear = commands[12:17]
    sorter = min(1.0, max(0.0, state.sorter + (STEP if push else -STEP) / STROKE))
    fields = (_field(state.fields[0], extractor), _field(state.fields[1], rotator))
    if moved == was and sorter == state.sorter and fields == state.fields and not insert + clear:
        return state._replace(number=state.number + 1), ()
    before = state.blocks
    state = state._replace(number=state.number + 1, axes=moved, sorter=sorter, fields=fields)
    at = tuple(m.position / axis.unit for axis, m in zip(plant.axes, moved, strict=True))
    events = [Event("end_stop", detail=n) for n, m in zip(AXES, moved, strict=True) if m.hit]
    if insert:
        state = _inserted(plant, state, at, insert, events)
    if clear:
        state = _cleared(state, clear, events)
    if state.blocks:
        travel = tuple(now.position - old.position for now, old in zip(moved, was, strict=True))
        state = _travelled(plant, state, at, travel, events)
    speed = tuple(m.velocity / axis.unit for axis, m in zip(plant.axes, moved, strict=True))
    state = _watched(state, at, speed, events)
    state = _counted(state, events)
    if state.blocks is not before or any(b.where is Where.HAND for b in before):
        state = _sensed(plant, state, at)
    return state, tuple(events)


def _field(field: float, on: int) -> float:
    """Return the field of a magnet after a step."""
    full = float(bool(on))
    return full if abs(full - field) < 1e-3 else field + (full - field) * STEP / FIELD_TIME


def _noise(plant: Plant, state: PlantState, of: int) -> float:
    """Return a random number of standard deviation 1."""
    return plant.noise[(7 * state.number + 389 * of) % NOISE]


def _inserted(
    plant: Plant, state: PlantState, at: tuple[float, ...], number: int, events: list[Event]
) -> PlantState:
    """Lay a block on the entry of the feeder belt, as the operator does."""
    events.append(Event("inserted", number))
    if at[ROTATOR] < 400:
        events.append(Event("hand_under_arm", number))
    where = 0.002 * _noise(plant, state, number)
    mass = plant.masses[number % NOISE]
    laid = Block(number, Where.BELT, FEEDER_BELT, where, mass)
    return state._replace(blocks=(*state.blocks, laid))


def _cleared(state: PlantState, clear: int, events: list[Event]) -> PlantState:
    """Take away the blocks that no sensor sees, as the operator does before he resets the cell.

    ``clear``: 1, and 2 for a block that the magnet of the extractor holds, 4 for the rotator's.
    """
    robots = (EXTRACTOR, ROTATOR)
    hands = {robot for bit, robot in enumerate(robots, 1) if clear >> bit & 1}
    left = tuple(
        b
        for b in state.blocks
        if not blocks.is_out_of_sight(b) and not (b.where is Where.HAND and b.holder in hands)
    )
    if len(left) == len(state.blocks):
        return state
    events.extend(Event("removed", b.number) for b in state.blocks if b not in left)
    return state._replace(blocks=left)


def _travelled(
    plant: Plant,
    state: PlantState,
    at: tuple[float, ...],
    travel: tuple[float, ...],
    events: list[Event],
) -> PlantState:
    """Move the blocks with what holds them."""
    ring = state.blocks
    for belt in (FEEDER_BELT, EXTRACTION_BELT):
        if travel[belt]:
            ring = blocks.belt_moved(ring, belt, travel[belt])
    if travel[FEEDER] > 0:
        pushes = [blocks.pushed(b, at[FEEDER] * axes.LINEAR) for b in ring]
        ring = tuple(block for block, _ in pushes)
        events.extend(event for _, event in pushes if event)
    for hand, robot in enumerate((EXTRACTOR, ROTATOR)):
        if state.fields[hand] > GRIPS:
            ring = blocks.taken(ring, robot, at[robot])
        elif state.fields[hand] < HOLDS:
            error = LAID * _noise(plant, state, robot)
            ring, event = blocks.released(ring, robot, at[robot], error)
            if event:
                events.append(event)
    if state.sorter > 0.6:
        for block in ring:
            near = abs(block.at - blocks.PITCH) < 0.03
            if block.where is Where.BELT and block.holder == EXTRACTION_BELT and near:
                ring = tuple(b for b in ring if b is not block)
                events.append(Event("ejected", block.number))
    if ring is state.blocks:
        return state
    for block, event in blocks.fallen(ring):
        ring = tuple(b for b in ring if b is not block)
        events.append(event)
    ring = tuple(b for b in ring if b.where is not Where.GONE)
    loads = _loads(ring)
    if loads == _loads(state.blocks):
        return state._replace(blocks=ring)
    moved = zip(plant.axes, state.axes, loads, strict=True)
    return state._replace(blocks=ring, axes=tuple(axes.loaded(*each) for each in moved))


def _loads(ring: tuple[Block, ...]) -> tuple[float, ...]:
    """Return what blocks add to the inertia of the axes, in kg or kg m^2."""
    loads = [0.0] * len(AXES)
    for block in ring:
        if block.where is Where.BELT:
            loads[block.holder] += block.mass
        elif block.where is Where.HAND:
            loads[block.holder] += block.mass * blocks.ARM**2
    return tuple(loads)


def _watched(
    state: PlantState, at: tuple[float, ...], speed: tuple[float, ...], events: list[Event]
) -> PlantState:
    """Report each hazard when it starts, and not again while it lasts."""
    now: dict[tuple[str, int], Event] = {
        (kind, 0): Event(kind) for kind in blocks.hazards(at, speed, state.sorter)
    }
    if len(state.blocks) > 1:
        now |= {(e.kind, e.block): e for e in blocks.crowded(state.blocks)}
    if not now and not state.hazards:
        return state
    events.extend(event for key, event in now.items() if key not in state.hazards)
    return state._replace(hazards=frozenset(now))


def _counted(state: PlantState, events: list[Event]) -> PlantState:
    """Count what happened."""
    if not events:
        return state
    counter = Counter(dict(zip(COUNTERS, state.counted, strict=True)))
    for event in events:
        counter["collisions"] += event.kind in COLLISIONS
        counter["lost"] += event.kind in blocks.LOSSES
        if event.kind in {"inserted", "moulded", "ejected", "removed"}:
            counter[event.kind] += 1
    return state._replace(counted=tuple(counter[name] for name in COUNTERS))


def _sensed(plant: Plant, state: PlantState, at: tuple[float, ...]) -> PlantState:
    """Let the block sensors look; each has a hysteresis, so it does not chatter."""
    arms = {EXTRACTOR: at[EXTRACTOR], ROTATOR: at[ROTATOR]}
    seen = [place for b in state.blocks if (place := blocks.seen_at(b, arms))]
    values = []
    for index, sensor in enumerate(SENSORS):
        line, where = WATCHED[sensor]
        noise = SENSOR_NOISE * _noise(plant, state, index)
        reach = (FORGETS if state.sensors[index] else SEES) + noise
        found = any(on == line and abs(place - where) < reach for on, place in seen)
        if sensor == "B_P":  # the pocket is the end of the belt and the start of the lane
            found = found or any(on == FEEDER and abs(place) < reach for on, place in seen)
        values.append(found)
    return state._replace(sensors=tuple(values))


def outputs(plant: Plant, state: PlantState) -> list[int]:
    """Return measurements and truths, as `signals.PLANT.outputs`."""
    values: list[int] = []
    positions = []
    for axis, moved in zip(plant.axes, state.axes, strict=True):
        counts = moved.position / axis.unit
        positions.append(round(counts))
        values.append(axes.encoder(axis, moved))
        values.append(int(axes.limit(axis, counts)))
    values += map(int, state.sensors)
    values.append(int(state.sorter < 0.02))
    for sensor, says in state.faults.stuck:
        values[MEASUREMENTS.index(sensor)] = says
    values += positions
    values.append(round(state.sorter * 1000))
    slots = dict.fromkeys(SLOTS, 0)
    view = (0, 0)
    for block in state.blocks:
        slots[blocks.slot_of(block)] = block.number
        if block.where is Where.BELT and block.holder == EXTRACTION_BELT and abs(block.at) < SEES:
            view = (block.number, round(block.at / axes.LINEAR))
    return [*values, *slots.values(), *view, *state.counted]


def with_fault(state: PlantState, name: str, value: float) -> PlantState:
    """Return the state with a part broken, or repaired.

    ``jam.AXIS``: 1 jams it. ``sensor.NAME``: 0 or 1 is its fixed reading, -1 repairs it.
    ``take.SLOT``: the block there is removed. Raises KeyError for other names.
    """
    kind, _, what = name.partition(".")
    faults = state.faults
    if kind == "jam" and what in AXES:
        jammed = faults.jammed | {what} if value else faults.jammed - {what}
        moved = tuple(m._replace(jammed=n in jammed) for n, m in zip(AXES, state.axes, strict=True))
        return state._replace(faults=replace(faults, jammed=jammed), axes=moved)
    if kind == "sensor" and what in MEASUREMENTS:
        stuck = tuple((n, says) for n, says in faults.stuck if n != what)
        if value >= 0:
            stuck = (*stuck, (what, int(value)))
        return state._replace(faults=replace(faults, stuck=stuck))
    if kind == "take" and what in SLOTS:
        left = tuple(b for b in state.blocks if blocks.slot_of(b) != what)
        counted = list(state.counted)
        counted[COUNTERS.index("lost")] += len(state.blocks) - len(left)
        return state._replace(blocks=left, counted=tuple(counted))
    raise KeyError(name)
