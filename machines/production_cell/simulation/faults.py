"""Faults, and when they occur: a list in YAML, or one by name.

Each is a line such as ``{when: feeder.state == pushing, after: 20ms, fault: jam, for: 5}``. A
number is a time in s; ``20ms`` and ``2s`` name their unit.

| field | meaning | |---|---| | ``at`` | not before this time | | ``when`` | as soon as a machine
enters a state, counted from ``at`` on | | ``nth`` | not the first time that it does, but this one |
| ``after`` | the delay after that |

| fault | fields | |---|---| | ``jam`` | ``axis``, ``for`` | | ``lost_block`` | ``slot``: it is
taken from there as soon as one is there | | ``stuck_sensor`` | ``sensor``, ``value``, ``for`` | |
``dead_link`` | ``for`` | | ``loss`` | ``share`` of the frames between boards, ``for`` | | ``estop``
| ``for`` | | ``kill`` | ``board``, ``for``: then it is restarted |
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from .signals import AXES, MEASUREMENTS, MODULES, SLOTS

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
BY_NAME: Mapping[str, Mapping[str, Any]] = {
    "jam": {"when": "feeder.state == pushing", "after": "20ms"},
    "stuck_sensor": {"when": "molder.state == opened", "after": "20ms"},
}
"""When the faults that are given by name occur: while the machine that they meet is at work."""
TIMING = frozenset({"at", "when", "nth", "after", "for"})
AT = 60.0
"""When a fault occurs of which it is not said, in s."""
LONGEST = 1_000_000
STATE = re.compile(r"\s*(\w+)\.state\s*==\s*(\w+)\s*")
TIME = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(ms|s)\s*")


class FaultError(Exception):
    """A schedule of faults cannot be read, or makes no sense."""


@dataclass(frozen=True)
class Trigger:
    """The conditions under which a fault starts; times in ms. All of them must be met."""

    at: int = 0
    machine: str = ""
    state: str = ""
    """As soon as the machine enters it; "" for at once."""
    nth: int = 1
    after: int = 0
    slot: str = ""
    """Not before there is a block."""


@dataclass(frozen=True, order=True)
class Action:
    """Something to be done: set a parameter of the plant or of the boards, and so on."""

    step: int
    """In ms from the begin of the fault."""
    target: str
    """``plant``, ``boards``, ``estop``, or ``kill`` and ``restart`` with the board as ``name``."""
    name: str = ""
    value: float = 0.0


@dataclass(frozen=True)
class Fault:
    """A fault of a schedule."""

    text: str
    trigger: Trigger
    actions: tuple[Action, ...]


def read(text: str) -> tuple[Fault, ...]:
    """Return the faults in a file, or one by name; ``""``: no faults. Raises `FaultError`."""
    if not text:
        return ()
    if text in DEFAULTS:
        return schedule([{"fault": text, **BY_NAME.get(text, {})}])
    path = Path(text)
    if path.suffix not in {".yaml", ".yml"}:
        known = ", ".join(DEFAULTS)
        raise FaultError(
            f"there is no fault `{text}`; there are {known}, and files of them (.yaml)"
        )
    try:
        lines = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise FaultError(f"{path}: {error}") from error
    if not isinstance(lines, list):
        raise FaultError(f"{path}: a list of faults is expected")
    return schedule(lines)


def check_times(schedule: Sequence[Fault], steps: int) -> None:
    """Check that each fault can occur in a run of so many ms. Raises `FaultError`."""
    for fault in schedule:
        earliest = fault.trigger.at + fault.trigger.after
        if earliest >= steps:
            raise FaultError(
                f"`{fault.text}` occurs after {earliest / 1000:g} s, but the run ends after "
                f"{steps / 1000:g} s: simulate longer (--seconds), or give it an earlier `at` in a "
                "file of faults"
            )


def schedule(lines: Sequence[object]) -> tuple[Fault, ...]:
    """Return the faults of a list. Raises `FaultError`."""
    return tuple(map(_fault, lines))


def _fault(line: object) -> Fault:
    """Return a fault: its trigger, its action at the start, and that at the end."""
    kind = line.get("fault") if isinstance(line, Mapping) else None
    if not isinstance(line, Mapping) or not isinstance(kind, str) or kind not in DEFAULTS:
        raise FaultError(f"`{line}` is no fault: one of {', '.join(DEFAULTS)} is expected")
    fault = {"at": 0 if "when" in line else AT, **DEFAULTS[kind], **line}
    surplus = {str(field) for field in fault} - TIMING - {"fault", *DEFAULTS[kind]}
    if kind == "lost_block":
        surplus |= {"for"} & set(line)
    if surplus:
        raise FaultError(f"`{kind}` has no field `{min(surplus)}`")
    try:
        trigger, lasts = _trigger(fault), _milliseconds(fault.get("for", 0))
        pairs = _set_and_reset(fault)
    except (TypeError, ValueError) as error:
        raise FaultError(f"`{dict(line)}`: {error}") from error
    actions = []
    for target, name, value, after in pairs:
        actions.append(Action(0, target, name, value))
        if lasts and after is not None:
            back = "restart" if target == "kill" else target
            actions.append(Action(lasts, back, name, after))
    what = next((f" {fault[field]}" for field in DEFAULTS[kind] if field != "for"), "")
    return Fault(kind + what, trigger, tuple(sorted(actions)))


def _trigger(fault: Mapping[str, Any]) -> Trigger:
    """Return the trigger of a fault. Raises `FaultError`, `ValueError`, `TypeError`."""
    machine, state = "", ""
    if "when" in fault:
        found = STATE.fullmatch(str(fault["when"]))
        if found is None:
            raise FaultError(
                f"`when: {fault['when']}` is not of the form `feeder.state == pushing`"
            )
        machine, state = found.groups()
        if machine not in MODULES:
            known = ", ".join(MODULES)
            raise FaultError(f"there is no machine `{machine}`; there are {known}")
    nth = fault.get("nth", 1)
    if (
        not isinstance(nth, int)
        or isinstance(nth, bool)
        or nth < 1
        or ("nth" in fault and not state)
    ):
        raise FaultError(f"`nth: {nth}` is expected to be 1 or more, beside `when`")
    slot = str(fault["slot"]) if "slot" in fault else ""
    at, after = _milliseconds(fault["at"]), _milliseconds(fault.get("after", 0))
    return Trigger(at, machine, state, nth, after, slot)


def _milliseconds(time: object) -> int:
    """Return a time in ms. Raises `ValueError` or `TypeError` for other values."""
    named = TIME.fullmatch(time) if isinstance(time, str) else None
    if named is not None:
        return round(float(named.group(1)) * (1 if named.group(2) == "ms" else 1000))
    if isinstance(time, bool) or not isinstance(time, int | float | str):
        raise TypeError(f"`{time}` is no time")
    seconds = float(time)
    if not 0 <= seconds <= LONGEST:
        raise ValueError(f"`{time}` is no time from 0 to {LONGEST} s")
    return round(1000 * seconds)


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
