"""Machines by their messages alone, as a client knows them: for entries without a known moment."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from msgspec import UNSET
from msgspec.structs import replace

from fsmkit.runtime.live.messages import AnyMessage, Lost, Pass, Post, Row, Set, State, Step

KEPT = ("timers", "queue", "deferred", "status", "fault")
"""What a step has as a state has it."""


@dataclass(frozen=True, slots=True)
class Folded:
    """All machines, in order; and the losses (by machine, ``""``: of any) since their state."""

    states: tuple[State, ...]
    lost: tuple[Lost, ...] = ()


def fold(before: Folded, messages: Iterable[AnyMessage]) -> Folded:
    """Return the machines after messages."""
    states = {state.m: state for state in before.states}
    lost = {each.m: each for each in before.lost}
    for message in messages:
        match message:
            case Step() if message.m in states:
                states[message.m] = _after(states[message.m], message)
            case State() if message.m in states:
                states[message.m] = message
                lost.pop(message.m, None)
                if len(states) == 1:
                    lost.clear()
            case Set() if message.m in states:
                state = states[message.m]
                inputs = {**state.inputs, **message.inputs}
                states[message.m] = replace(state, n=message.n, at=message.at, inputs=inputs)
            case Post(how="queued") if message.m in states:
                states[message.m] = _queued(states[message.m], message, message.event)
            case Pass(how="queued", target=(machine, event)) if machine in states:
                states[machine] = _queued(states[machine], message, [event, *message.values])
            case Lost():
                lost[message.m] = message
                states = {m: _unknown(message, state) for m, state in states.items()}
            case _:
                pass
    return Folded(tuple(states.values()), tuple(lost.values()))


def _after(state: State, step: Step) -> State:
    changed: dict[str, Any] = {
        key: value for key in KEPT if (value := getattr(step, key)) is not UNSET
    }
    if step.set is not UNSET:
        for values in ("data", "outputs"):
            old = getattr(state, values)
            changed[values] = {**old, **{k: v for k, v in step.set.items() if k in old}}
    if "queue" not in changed and state.queue and step.cause[0] == "event":
        has_waited = state.queue[0][0] == step.cause[1]
        changed["queue"] = state.queue[1:] if has_waited else state.queue
    return replace(state, n=step.n, at=step.at, on=_active(state.on, step.do), **changed)


def _active(on: Sequence[str], do: Sequence[Row]) -> list[str]:
    """Return the active states after a step; those that were entered come last."""
    active = dict.fromkeys(on)
    for row in do:
        if row[0] == "-":
            active.pop(row[1], None)
        elif row[0] == "+":
            active[row[1]] = None
    return list(active)


def _queued(state: State, message: Post | Pass, row: Row) -> State:
    return replace(state, n=message.n, at=message.at, queue=[*state.queue, row])


def _unknown(lost: Lost, state: State) -> State:
    return replace(state, known=False) if lost.m in ("", state.m) else state
