"""The actions of entering and exiting one state, without the change of its number."""

from __future__ import annotations

from fsmkit.chart.chart import State
from fsmkit.document.document import Kind
from fsmkit.plan.operations import (
    Action,
    Arm,
    Disarm,
    DropInvoke,
    EndInvoked,
    Finish,
    Forget,
    IfFinal,
    RaiseDone,
    Run,
    WantInvoke,
)
from fsmkit.plan.regions import Regions

Actions = tuple[Action, ...]


def entry_actions(plan: Regions) -> tuple[Actions, ...]:
    """Return the entry actions of each state (Appendix D, enterStates)."""
    chart = plan.chart
    return tuple(
        (
            *map(Forget, plan.forgotten[state.index]),
            *(Arm(t, chart.transitions[t].delay) for t in _timed(plan, state)),
            *([WantInvoke(state.index)] if state.invokes else []),
            *(Run(block) for block in state.on_entry if block),
            *(_final(plan, state) if state.kind is Kind.FINAL else ()),
        )
        for state in chart.states
    )


def exit_actions(plan: Regions) -> tuple[Actions, ...]:
    """Return the exit actions of each state (Appendix D, exitStates)."""
    slots: dict[int, list[EndInvoked]] = {}
    for invocation in plan.chart.invocations:
        slots.setdefault(invocation.state, []).append(EndInvoked(invocation.index))
    return tuple(
        (
            *map(Disarm, _timed(plan, state)),
            *(Run(block) for block in state.on_exit if block),
            *([DropInvoke(state.index)] if state.invokes else []),
            *slots.get(state.index, ()),
        )
        for state in plan.chart.states
    )


def _timed(plan: Regions, state: State) -> list[int]:
    """Return the transitions of a state that have a timer of their own."""
    return [t for t in state.transitions if plan.chart.transitions[t].has_timer]


def _final(plan: Regions, state: State) -> Actions:
    """Return the additional actions of entering a final state (SCXML 3.7)."""
    parent = plan.parents[state.index]
    if not parent:
        return (Finish(),)
    event, found = _done(plan, parent), list[Action]()
    if event is not None:
        found.append(RaiseDone(event, state.done_data))
    above = plan.parents[parent]
    if plan.chart.states[above].kind is Kind.PARALLEL:
        event = _done(plan, above)
        if event is not None:
            found.append(IfFinal(above, plan.finals(above), RaiseDone(event, ())))
    return tuple(found)


def _done(plan: Regions, state: int) -> int | None:
    return plan.chart.event_index.get("done.state." + plan.chart.states[state].id)
