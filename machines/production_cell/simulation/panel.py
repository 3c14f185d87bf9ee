"""The operator: lays blocks into the ring while the lamp is on, and presses buttons.

What he does follows rules (start when the cell stands by, reset some time after a fault or when he
has closed the emergency chain), or a script of times and buttons. If a person presses the buttons
(`OperatorState.hands_off`), he only lays blocks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from .signals import BUTTONS

PRESS = 100
"""How long a button is held, in ms."""


@dataclass(frozen=True)
class Operator:
    """How the operator works. Times in ms."""

    blocks: int = 3
    """As many he keeps in the ring."""
    power_at: int = 100
    reaction: int = 700
    """From the lamp to the block."""
    pause: int = 500
    """From block to block at least."""
    start_after: int = 500
    reset_after: int = 3000
    resume_after: int = 2000
    release_after: int = 1000
    """From closing the emergency chain to the reset."""
    script: tuple[tuple[int, str], ...] = ()
    """Times and buttons, in order."""


@dataclass(frozen=True)
class OperatorState:
    """The current task of the operator."""

    number: int = 0
    """The number of the block that was laid down last."""
    clears: bool = False
    """He takes away the blocks that no sensor sees."""
    lamp_since: int = -1
    """-1: it is dark."""
    inserted_at: int = -10_000
    state: str = ""
    """The state of the supervisor, and its start."""
    since: int = 0
    pressed: tuple[tuple[str, int], ...] = ()
    """Buttons that are held, and since when."""
    chain_open: bool = False
    reset_at: int = -1
    """When he resets after an emergency stop; -1: not."""
    scripted: int = 0
    """So many lines of the script are done."""
    hands_off: bool = False
    """The rules press no button."""
    asked: str = ""
    """A button that he is asked to press now."""
    extra: int = 0
    """Blocks that he is asked to lay besides those that he keeps in the ring."""


def step(
    rule: Operator, state: OperatorState, now: int, seen: Mapping[str, int], supervisor: str
) -> tuple[OperatorState, int]:
    """Advance by a millisecond; return also the block that is laid down, or 0.

    ``seen``: ``lamp``, ``estop``, and ``blocks``: how many are in the ring. ``supervisor``: its
    state.
    """
    if bool(seen["estop"]) != state.chain_open:
        reset_at = -1 if seen["estop"] else now + rule.release_after
        state = replace(state, chain_open=bool(seen["estop"]), reset_at=reset_at)
    if supervisor != state.state:
        state = replace(state, state=supervisor, since=now)
    if state.pressed and now - state.pressed[0][1] >= PRESS:
        state = replace(state, pressed=state.pressed[1:])
    button = "" if state.hands_off else "reset" if now == state.reset_at else _due(rule, state, now)
    while state.scripted < len(rule.script) and rule.script[state.scripted][0] <= now:
        button = rule.script[state.scripted][1]
        state = replace(state, scripted=state.scripted + 1)
    if state.asked:
        button, state = state.asked, replace(state, asked="")
    state = replace(state, clears=button == "reset") if state.clears or button else state
    if button and all(button != held for held, _ in state.pressed):
        state = replace(state, pressed=(*state.pressed, (button, now)), since=now)
    if not seen["lamp"]:
        return (state if state.lamp_since < 0 else replace(state, lamp_since=-1)), 0
    if state.lamp_since < 0:
        state = replace(state, lamp_since=now)
    rested = now - state.inserted_at >= rule.pause
    wanted = max(rule.blocks, seen["blocks"] + 1 if state.extra else 0)
    if rested and now - state.lamp_since >= rule.reaction and seen["blocks"] < wanted:
        number, extra = state.number + 1, max(0, state.extra - 1)
        return replace(state, number=number, inserted_at=now, extra=extra), number
    return state, 0


def _due(rule: Operator, state: OperatorState, now: int) -> str:
    """Return the button that the rules demand now; empty if none."""
    waited = now - state.since
    match state.state:
        case "standing_by" if waited >= rule.start_after:
            return "start"
        case "faulted" | "fallen" if waited >= rule.reset_after and not state.chain_open:
            return "reset"
        case "interrupted" if waited >= rule.resume_after:
            return "resume"
        case _:
            return ""


def buttons(state: OperatorState) -> tuple[int, ...]:
    """Return the levels of the buttons, as `BUTTONS`."""
    held = {button for button, _ in state.pressed}
    return tuple(int(button in held) for button in BUTTONS)
