"""The plant alone: axes against their law, blocks on their way, and what must not happen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from machines.production_cell.simulation import axes, blocks, plant
from machines.production_cell.simulation.axes import AxisState
from machines.production_cell.simulation.blocks import Block, Event, Where
from machines.production_cell.simulation.plant import Plant, PlantState
from machines.production_cell.simulation.signals import (
    AXES,
    COUNTERS,
    EXTRACTION_BELT,
    EXTRACTOR,
    FEEDER,
    FEEDER_BELT,
    MOLDER,
    PLANT,
    ROTATOR,
    SLOTS,
)

SEED = 3


def moved(axis: int, pwm: int, steps: int) -> tuple[axes.Axis, AxisState]:
    """An axis after so many steps at a PWM, from rest at zero."""
    made = axes.make(np.random.default_rng(SEED))[axis]
    state = axes.loaded(made, AxisState(0.0, 0.0, 0.0, 0.0), 0.0)
    for _ in range(steps):
        state = axes.step(made, state, pwm)
    return made, state


@pytest.mark.parametrize("axis", [FEEDER_BELT, EXTRACTION_BELT])
def test_a_belt_comes_to_its_top_speed_with_its_time_constant(axis: int) -> None:
    made, late = moved(axis, 4096, 1000)
    top = late.velocity / made.unit
    assert 2700 < top < 3300
    _, early = moved(axis, 4096, 40)
    assert early.velocity == pytest.approx(late.velocity * (1 - math.exp(-1)), rel=0.06)


def test_friction_holds_against_a_small_torque_and_brings_to_rest() -> None:
    made, still = moved(FEEDER, 100, 100)
    assert (still.position, still.velocity) == (0.0, 0.0)
    state = AxisState(0.1, 0.2, still.decay, 0.0)
    for _ in range(1000):
        state = axes.step(made, state, 0)
    assert state.velocity == 0.0
    assert 0.1 < state.position < 0.12


def test_a_load_makes_slower() -> None:
    made, light = moved(ROTATOR, 0, 0)
    assert axes.loaded(made, light, 0.01).decay > light.decay


def test_an_end_stop_ends_the_way_and_is_told_of() -> None:
    made, state = moved(MOLDER, 4096, 600)
    assert state.position == made.highest
    made, state = moved(MOLDER, -4096, 600)
    assert state.position / made.unit == pytest.approx(-40)
    _, first, *_ = (moved(MOLDER, 4096, n)[1] for n in (599, 600))
    assert first.velocity == 0.0


def test_marks_of_a_belt_and_the_switch_of_an_arm() -> None:
    made = axes.make(np.random.default_rng(SEED))
    for counts, closed in ((0, True), (5, True), (6, False), (994, False), (2998, True)):
        assert axes.limit(made[FEEDER_BELT], counts) is closed
    assert [axes.limit(made[EXTRACTOR], counts) for counts in (-3, 0, 1)] == [True, True, False]


# --- blocks ---------------------------------------------------------------------------------------


def ring(*there: Block, seed: int = SEED, **at: float) -> tuple[Plant, PlantState]:
    """A plant with blocks, and axes at positions in counts; others are at home."""
    made, state = plant.make(seed)
    home = {"extractor": 1000.0, "rotator": 1000.0} | at
    placed = tuple(
        s._replace(position=home.get(name, 0.0) * a.unit, origin=0.0)
        for name, a, s in zip(AXES, made.axes, state.axes, strict=True)
    )
    holds = tuple(
        float(any(b.where is Where.HAND and b.holder == robot for b in there))
        for robot in (EXTRACTOR, ROTATOR)
    )
    return made, state._replace(blocks=there, axes=placed, fields=(holds[0], holds[1]))


def block(where: Where, holder: int, at: float, number: int = 1) -> Block:
    return Block(number, where, holder, at, 0.12)


def run(
    made: Plant, state: PlantState, steps: int, **commands: int
) -> tuple[PlantState, list[Event]]:
    """Run with constant commands; what is written with ``__`` for a dot."""
    told = {name.replace("__", "."): value for name, value in commands.items()}
    values = [told.pop(name, 0) for name in PLANT.inputs]
    assert not told
    events: list[Event] = []
    for _ in range(steps):
        state, new = plant.step(made, state, values)
        events += new
    return state, events


def outputs(made: Plant, state: PlantState) -> dict[str, int]:
    return dict(zip(PLANT.outputs, plant.outputs(made, state), strict=True))


def kinds(events: list[Event]) -> list[str]:
    return [event.kind for event in events]


def test_the_belt_brings_a_block_to_the_pocket_and_the_feeder_into_the_mould() -> None:
    made, state = ring(block(Where.BELT, FEEDER_BELT, 0.0))
    while state.blocks[0].at < 0.098:
        state, events = run(made, state, 1, feeder_belt__enable=1, feeder_belt__pwm=1500)
        assert not events
    state, _ = run(made, state, 20)
    told = outputs(made, state)
    assert (told["B_F0"], told["B_P"], told["slot.p"]) == (0, 1, 1)
    state, events = run(made, state, 1500, feeder__enable=1, feeder__pwm=3000)
    assert "moulded" in kinds(events)
    told = outputs(made, state)
    assert (told["B_P"], told["B_M"], told["slot.m"], told["count.moulded"]) == (0, 1, 1, 1)


def test_the_magnet_takes_a_block_and_lays_it_down() -> None:
    made, state = ring(block(Where.LANE, FEEDER, blocks.CAVITY), extractor=2600.0, molder=1500.0)
    state, events = run(made, state, 200, extractor__magnet=1)
    assert (outputs(made, state)["slot.x"], events) == (1, [])
    _, over_belt = ring(extractor=100.0)
    state = state._replace(axes=over_belt.axes)
    state, events = run(made, state, 200)
    assert events == []
    told = outputs(made, state)
    assert (told["slot.e0"], told["B_E0"], told["view.block"]) == (1, 1, 1)


@pytest.mark.parametrize("angle", [300.0, 1000.0, 2000.0])
def test_a_block_let_go_elsewhere_is_dropped_and_lost(angle: float) -> None:
    made, state = ring(block(Where.HAND, ROTATOR, 0.0), rotator=angle)
    state, events = run(made, state, 100)
    assert kinds(events) == ["dropped"]
    told = outputs(made, state)
    assert (told["count.lost"], told["count.collisions"]) == (1, 1)
    assert not any(told[f"slot.{slot}"] for slot in SLOTS)


def test_a_block_laid_on_another() -> None:
    made, state = ring(
        block(Where.HAND, ROTATOR, 0.0), block(Where.BELT, FEEDER_BELT, 0.0, 2), rotator=100.0
    )
    _, events = run(made, state, 100)
    assert kinds(events) == ["drop_on_occupied"]


def test_a_block_falls_off_the_end() -> None:
    made, state = ring(block(Where.BELT, EXTRACTION_BELT, 0.2))
    state, events = run(made, state, 500, extraction_belt__enable=1, extraction_belt__pwm=4096)
    assert kinds(events) == ["off_the_end"]
    assert state.blocks == ()


def test_two_blocks_in_one_place_are_told_of_once() -> None:
    made, state = ring(block(Where.LANE, FEEDER, blocks.CAVITY), block(Where.LANE, FEEDER, 0.0, 2))
    _, events = run(made, state, 2000, feeder__enable=1, feeder__pwm=3000)
    assert kinds(events).count("two_blocks") == 1


def test_the_sorter_throws_out_what_lies_before_it() -> None:
    made, state = ring(block(Where.BELT, EXTRACTION_BELT, 0.1))
    state, events = run(made, state, 100, sorter__out=1)
    assert (events, outputs(made, state)["sorter.retracted"]) == ([], 0)
    state, events = run(made, state, 100, sorter__out=1)
    assert kinds(events) == ["ejected"]
    state, _ = run(made, state, 250)
    assert outputs(made, state)["sorter.retracted"] == 1


@pytest.mark.parametrize(
    ("at", "speed", "sorter", "found"),
    [
        ({FEEDER: 2800, MOLDER: 1500}, {}, 0, "feeder_against_door"),
        ({EXTRACTOR: 2600, MOLDER: 700}, {}, 0, "door_against_arm"),
        ({EXTRACTOR: 2600, MOLDER: 1500, FEEDER: 2800}, {}, 0, "arm_against_feeder"),
        ({ROTATOR: 100}, {FEEDER_BELT: 500}, 0, "belt_under_arm"),
        ({EXTRACTOR: 100}, {EXTRACTION_BELT: 500}, 0, "belt_under_arm"),
        ({ROTATOR: 3100}, {EXTRACTION_BELT: 500}, 0, "belt_under_arm"),
        ({}, {EXTRACTION_BELT: 500}, 0.5, "sorter_in_the_way"),
    ],
)
def test_what_is_in_the_way_of_what(
    at: dict[int, float], speed: dict[int, float], sorter: float, found: str
) -> None:
    home = {EXTRACTOR: 1000.0, ROTATOR: 1000.0}
    positions = tuple((home | at).get(axis, 0.0) for axis in range(len(AXES)))
    speeds = tuple(speed.get(axis, 0.0) for axis in range(len(AXES)))
    assert found in blocks.hazards(positions, speeds, sorter)
    assert found in blocks.COLLISIONS
    still = tuple(home.get(axis, 0.0) for axis in range(len(AXES)))
    assert blocks.hazards(still, (0.0,) * len(AXES), 0.0) == ()


def test_what_no_sensor_sees_is_taken_away_before_the_start() -> None:
    made, state = ring(block(Where.LANE, FEEDER, 0.1), block(Where.LANE, FEEDER, blocks.CAVITY, 2))
    state, events = run(made, state, 1, operator__clear=1)
    assert events == [Event("removed", 1)]
    assert [b.number for b in state.blocks] == [2]
    assert state.counted[COUNTERS.index("lost")] == 0


@pytest.mark.parametrize(("clear", "left"), [(1, [1, 2]), (3, [2]), (5, [1]), (7, [])])
def test_blocks_are_taken_off_the_magnets_that_are_named(clear: int, left: list[int]) -> None:
    made, state = ring(block(Where.HAND, EXTRACTOR, 0.0), block(Where.HAND, ROTATOR, 0.0, 2))
    on = {"extractor__magnet": 1, "rotator__magnet": 1}
    state, events = run(made, state, 1, operator__clear=clear, **on)
    assert sorted(b.number for b in state.blocks) == left
    assert {event.kind for event in events} <= {"removed"}


# --- faults ---------------------------------------------------------------------------------------


def test_a_jammed_axis_stands_still_until_it_is_mended() -> None:
    made, state = ring()
    state = plant.with_fault(state, "jam.feeder", 1)
    state, _ = run(made, state, 100, feeder__enable=1, feeder__pwm=4096)
    assert outputs(made, state)["feeder.encoder"] == 0
    state, _ = run(
        made, plant.with_fault(state, "jam.feeder", 0), 100, feeder__enable=1, feeder__pwm=4096
    )
    assert outputs(made, state)["feeder.encoder"] > 50


def test_a_stuck_sensor_lies_until_it_is_mended() -> None:
    made, state = ring()
    state = plant.with_fault(state, "sensor.B_M", 1)
    assert outputs(made, state)["B_M"] == 1
    assert outputs(made, plant.with_fault(state, "sensor.B_M", -1))["B_M"] == 0


def test_a_block_taken_away_is_lost() -> None:
    _, state = ring(block(Where.BELT, EXTRACTION_BELT, 0.1))
    state = plant.with_fault(state, "take.e1", 1)
    assert (state.blocks, state.counted[COUNTERS.index("lost")]) == ((), 1)
    with pytest.raises(KeyError):
        plant.with_fault(state, "take.e9", 1)


def test_the_same_seed_gives_the_same_run_and_another_does_not() -> None:
    def ends(seed: int) -> list[int]:
        made, state = plant.make(seed)
        commands = {f"{axis}__enable": 1 for axis in AXES} | {f"{axis}__pwm": 900 for axis in AXES}
        state, _ = run(made, state, 1, operator__insert=1)
        state, _ = run(made, state, 300, **commands)
        return plant.outputs(made, state)

    assert ends(1) == ends(1)
    assert ends(1) != ends(2)
