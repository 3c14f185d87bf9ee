"""The environment of boards and plant: power, emergency stop, operator and camera, step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from . import camera, panel
from .camera import CameraState, Detector, Estimate, Judgement
from .panel import Operator, OperatorState
from .signals import SLOTS

Estimator = Callable[[CameraState, int], Estimate]
"""Returns the block before the sorter, from what the camera saw and the encoder of the belt."""
SEEN = (
    "lamp", "supervisor.state", "view.block", "view.position", "extraction_belt.encoder",
    *(f"slot.{slot}" for slot in SLOTS),
)  # fmt: skip
"""The signals that the world looks at."""


@dataclass(frozen=True)
class World:
    """The constants of the world. ``states``: the names of the supervisor's states."""

    operator: Operator
    judgement: Judgement
    states: tuple[str, ...]
    detect: Detector = camera.itself
    estimate: Estimator | None = None
    """Another program's; None: that of this one."""


@dataclass(frozen=True)
class WorldState:
    """The state of the world."""

    operator: OperatorState = field(default_factory=OperatorState)
    camera: CameraState = field(default_factory=CameraState)
    estop: int = 0


def step(
    world: World, state: WorldState, now: int, seen: list[int]
) -> tuple[WorldState, list[int]]:
    """Advance by a millisecond; return also the signals, as `WORLD_OUTPUTS`.

    ``seen``: the values of `SEEN`.
    """
    lamp, supervisor, block, position, encoder, *slots = seen
    looked = state.camera
    if now % camera.FRAME == 0:
        view = (block, position)
        looked = camera.picture(world.judgement, looked, now, view, encoder, world.detect)
    present: Mapping[str, int] = {
        "lamp": lamp,
        "estop": state.estop,
        "blocks": len(slots) - slots.count(0),
    }
    name = world.states[supervisor] if world.states else ""
    operator, insert = panel.step(world.operator, state.operator, now, present, name)
    estimate = (
        camera.at_sorter(looked.sightings, encoder, world.judgement.drift)
        if world.estimate is None
        else world.estimate(looked, encoder)
    )
    if operator is not state.operator or looked is not state.camera:
        state = replace(state, operator=operator, camera=looked)
    return state, [
        int(now >= world.operator.power_at),
        state.estop,
        *panel.buttons(operator),
        looked.frames,
        looked.block,
        looked.verdict,
        estimate.block,
        int(estimate.is_sighted),
        int(estimate.is_reject),
        insert,
        int(operator.clears),
    ]
