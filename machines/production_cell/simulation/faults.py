"""Faults, and when they occur: a list in YAML, or one by name.

Each is a line such as ``{at: 60, fault: jam, axis: feeder, for: 5}``; times are in s.

| fault | fields |
|---|---|
| ``jam`` | ``axis``, ``for`` |
| ``lost_block`` | ``slot``: it is taken from there as soon as one is there |
| ``stuck_sensor`` | ``sensor``, ``value``, ``for`` |
| ``dead_link`` | ``for`` |
| ``loss`` | ``share`` of the frames between boards, ``for`` |
| ``estop`` | ``for`` |
| ``kill`` | ``board``, ``for``: then it is begun anew |
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from .signals import AXES, MEASUREMENTS, SLOTS

DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    "jam": {"axis": "feeder", "for": 5},
    "lost_block": {"slot": "e1"},
    "stuck_sensor": {"sensor": "B_M", "value": 1, "for": 20},
    "dead_link": {"for": 5},
    "loss": {"share": 0.1, "for": 0},
    "estop": {"for": 2},
    "kill": {"board": "b", "for": 3},
}
"""The faults, with what they do unless something else is said. ``for`` 0: until the end."""
AT = 60.0
"""When a fault occurs of which it is not said, in s."""


class FaultError(Exception):
    """A schedule of faults cannot be read, or makes no sense."""


@dataclass(frozen=True, order=True)
class Action:
    """Something to be done at a step: set a parameter of the plant or of the boards, and so on.

    ``slot``: not before there is a block.
    """

    step: int
    target: str
    """``plant``, ``boards``, ``estop``, or ``kill`` and ``restart`` with the board as ``name``."""
    name: str = ""
    value: float = 0.0
    slot: str = ""


def read(text: str) -> tuple[Action, ...]:
    """Return the actions of a file, or of a fault by name; ``""`` is none.

    Raises `FaultError`.
    """
    if not text:
        return ()
    if text in DEFAULTS:
        return schedule([{"fault": text}])
    path = Path(text)
    if path.suffix not in {".yaml", ".yml"}:
        known = ", ".join(DEFAULTS)
        raise FaultError(
            f"there is no fault `{text}`; there are {known}, and files of them (.yaml)"
        )
    try:
        lines = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise FaultError(f"{path}: {error}") from error
    if not isinstance(lines, list):
        raise FaultError(f"{path}: a list of faults is expected")
    return schedule(lines)


def schedule(lines: Sequence[object]) -> tuple[Action, ...]:
    """Return the actions of faults, in the order of time. Raises `FaultError`."""
    return tuple(sorted(action for line in lines for action in _actions(line)))


def _actions(line: object) -> list[Action]:
    """Return what a fault does, at its beginning and at its end."""
    if not isinstance(line, Mapping) or line.get("fault") not in DEFAULTS:
        raise FaultError(f"`{line}` is no fault: one of {', '.join(DEFAULTS)} is expected")
    fault = {"at": AT, **DEFAULTS[line["fault"]], **line}
    surplus = set(fault) - {"at", "fault", "for", *DEFAULTS[line["fault"]]}
    if surplus:
        raise FaultError(f"`{line['fault']}` has no field `{min(surplus)}`")
    try:
        begin, lasts = round(1000 * float(fault["at"])), round(1000 * float(fault.get("for", 0)))
        pairs = _set_and_reset(fault)
    except (TypeError, ValueError) as error:
        raise FaultError(f"`{dict(line)}`: {error}") from error
    actions = []
    for target, name, value, after in pairs:
        slot = str(fault["slot"]) if target == "plant" and "slot" in fault else ""
        actions.append(Action(begin, target, name, value, slot))
        if lasts and after is not None:
            back = "restart" if target == "kill" else target
            actions.append(Action(begin + lasts, back, name, after))
    return actions


def _set_and_reset(fault: Mapping[str, Any]) -> list[tuple[str, str, float, float | None]]:
    """Return what is set, to what, and to what at the end."""

    def one_of(field: str, known: Sequence[str]) -> str:
        if fault[field] not in known:
            raise FaultError(f"there is no {field} `{fault[field]}`; there are {', '.join(known)}")
        return str(fault[field])

    match fault["fault"]:
        case "jam":
            return [("plant", f"jam.{one_of('axis', AXES)}", 1, 0)]
        case "lost_block":
            return [("plant", f"take.{one_of('slot', SLOTS)}", 1, None)]
        case "stuck_sensor":
            sensor = one_of("sensor", MEASUREMENTS)
            return [("plant", f"sensor.{sensor}", int(fault["value"]), -1)]
        case "dead_link":
            return [("boards", "link.dead", 1, 0)]
        case "loss":
            return [("boards", "link.loss", float(fault["share"]), 0)]
        case "estop":
            return [("estop", "", 1, 0)]
        case _:
            return [("kill", str(fault["board"]), 0, 0)]
