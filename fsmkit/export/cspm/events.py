"""Model the steps of a network as events: the conditions and effects of each on all parts.

An event is a step of the system. The machine that moves, each queue that the step reads, fills or
needs empty, and each machine that receives a value take part in it at once. Moves with the same
effect on others are one event; their targets are local to the machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from fsmkit.export.network import Automaton, Move, Network, Sent, is_idle
from fsmkit.verify.statespace.actions import Action, Mover
from fsmkit.verify.statespace.closed_system import MAX_PENDING_BEFORE_INPUT

assert MAX_PENDING_BEFORE_INPUT == 1  # noqa: S101  (`Event.waiting` names the only queue in which one event waits)

NOBODY = -1
"""`Event.waiting`: no queue holds anything."""


class Turn(Enum):
    """The machines that must be idle before a machine may move (see `closed_system`)."""

    SEES = "a monitor sees what happened"
    ANSWERS = "the environment answers: no monitor waits"
    CALM = "neither a monitor nor the environment waits"


class Demand(Enum):
    """The number of events that a queue must hold."""

    ANY = "any number"
    EMPTY = "none"
    ONE = "one"
    SOME = "one or more"


@dataclass(frozen=True, slots=True)
class Event:
    """A step, in the view of the parts of the network.

    ``taken`` and ``own``: the head of the machine's own queue, or its number of events.
    ``waiting``: for an external event, the machine in whose queue the only event waits.
    ``is_internal``: the machine moves without a cause (Mover.INTERNAL). ``stops``: it is its last.
    """

    machine: int
    label: str
    turn: Turn
    taken: int | None
    own: Demand
    waiting: int | None
    sent: tuple[Sent, ...]
    stops: bool
    is_internal: bool


@dataclass(frozen=True, slots=True)
class OnQueue:
    """The effect of an event on the queue of a machine."""

    demand: Demand
    taken: int | None
    posted: tuple[int, ...]
    closes: bool


@dataclass(frozen=True, slots=True)
class OnMachine:
    """The effect of an event on another machine: received values, a condition on its queue."""

    demand: Demand
    received: tuple[int, ...]


def events_of(network: Network, move: Move, machine: int) -> Iterator[Event]:
    """Yield the possible events of a move: several if a condition has several cases."""
    automaton = network.automata[machine]
    own = Demand.EMPTY if move.needs_empty else Demand.ANY
    for turn, held in _turns(automaton, move):
        for waiting in _waiting(network, move, machine):
            yield Event(
                machine,
                move.label,
                turn,
                move.taken,
                held or own,
                waiting,
                move.sent,
                automaton.stops(move),
                move.mover is Mover.INTERNAL,
            )


def _turns(automaton: Automaton, move: Move) -> Iterator[tuple[Turn, Demand | None]]:
    """Yield the turns of a move, with the required state of the queue beside the machine."""
    takes = move.action is Action.TAKE
    waits = takes or automaton.locals[move.source].waiting > 0
    if automaton.is_monitor:
        yield Turn.SEES if waits else Turn.CALM, None
    elif automaton.is_environment and waits:
        yield Turn.ANSWERS, None
    else:
        if automaton.is_environment and automaton.queue and move.action is Action.EVENTLESS:
            yield Turn.ANSWERS, Demand.SOME
        yield Turn.CALM, None


def _waiting(network: Network, move: Move, machine: int) -> Iterator[int | None]:
    """Yield the queue in which an event may wait while an external event occurs."""
    if not move.from_outside:
        yield None
        return
    mine = network.automata[machine].locals[move.source].waiting
    if mine <= MAX_PENDING_BEFORE_INPUT:
        for holder in (NOBODY, *holders(network)):
            if (holder == machine) == (mine > 0) or network.automata[machine].queue:
                yield holder


def holders(network: Network) -> list[int]:
    """Return the machines in whose queue an event can wait while others move."""
    return [
        n
        for n, automaton in enumerate(network.automata)
        if not automaton.is_environment
        and not automaton.is_monitor
        and (automaton.queue or any(local.waiting for local in automaton.locals))
    ]


def on_queue(network: Network, event: Event, machine: int) -> OnQueue | None:
    """Return the effect of an event on the queue beside a machine; None without one."""
    mine = event.machine == machine
    found = OnQueue(
        _demand(network, event, machine),
        event.taken if mine else None,
        tuple(
            s.message
            for s in event.sent
            if s.target == machine and network.automata[machine].queues(s.message)
        ),
        mine and event.stops,
    )
    return None if found == OnQueue(Demand.ANY, None, (), False) else found


def on_machine(network: Network, event: Event, machine: int) -> OnMachine | None:
    """Return the effect of an event on a machine that does not move; None without one."""
    automaton = network.automata[machine]
    inside = not automaton.queue and any(local.waiting for local in automaton.locals)
    demand = _demand(network, event, machine) if inside else Demand.ANY
    received = received_values(network, event.sent, machine)
    return None if demand is Demand.ANY and not received else OnMachine(demand, received)


def _demand(network: Network, event: Event, machine: int) -> Demand:
    automaton = network.automata[machine]
    if event.machine == machine and event.own is not Demand.ANY:
        return event.own
    if event.waiting is not None:
        return Demand.ONE if event.waiting == machine else Demand.EMPTY
    if automaton.is_monitor:
        return Demand.ANY if event.turn is Turn.SEES else Demand.EMPTY
    if automaton.is_environment and event.turn is Turn.CALM:
        return Demand.EMPTY
    return Demand.ANY


def received_values(network: Network, sent: tuple[Sent, ...], machine: int) -> tuple[int, ...]:
    """Return the messages that change the local state of a machine at once."""
    automaton = network.automata[machine]
    return tuple(
        s.message
        for s in sent
        if s.target == machine and not automaton.queues(s.message)
        if not is_idle({n: after for n, (after, _) in automaton.received(s.message).items()})
    )


def after_values(automaton: Automaton, local: int, received: tuple[int, ...]) -> int | None:
    """Return the local state after some values; None if the explorer has not seen it."""
    for message in received:
        known = automaton.receives.get((local, message))
        if known is None:
            return None
        local = known[0]
    return local
