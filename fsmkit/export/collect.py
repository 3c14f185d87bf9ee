"""Build the network of automata of a closed system from its local steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from fsmkit.chart.analysis.partition import Partition
from fsmkit.diagnostics import Findings, fail
from fsmkit.emit import plain
from fsmkit.export.explored import LocalExploration, local_steps_of
from fsmkit.export.exporter import ExportedModel, ExportOptions
from fsmkit.export.identifiers import Names
from fsmkit.export.local_states import in_order, names_and_texts
from fsmkit.export.network import Arrival, Automaton, Local, Move, Network, Place, Sent
from fsmkit.export.transition_system import cause, occurrence_of
from fsmkit.language.values import show
from fsmkit.runtime.interpreter.index import index_of
from fsmkit.runtime.interpreter.snapshot import Occurrence, Snapshot
from fsmkit.system.partition import field_of, partition_of
from fsmkit.system.shared import type_of_slot
from fsmkit.system.system import System
from fsmkit.verify.report.counterexample import occurrence_text
from fsmkit.verify.statespace.actions import FAULT, Action, Message, Outcome, Step
from fsmkit.verify.statespace.closed_system import ClosedSystem, close
from fsmkit.verify.statespace.global_steps import LocalState


def export_network(
    system: System, options: ExportOptions, write: Callable[[Network, Findings], str]
) -> ExportedModel:
    """Explore a system, and write its network."""
    network = network_of(system, options)
    figures = {"states": network.states, "transitions": network.transitions}
    return ExportedModel(write(network, options.findings), figures)


def network_of(system: System, options: ExportOptions) -> Network:
    """Explore a system, and collect the local steps.

    Raises `FsmkitError`: ``export-too-large`` beyond the limits, ``not-exported`` if a schedule
    orders the machines, or if a node may freeze.
    """
    closed = close(system, untimed=options.untimed, silent=options.silent)
    if closed.system.schedule is not None:
        raise fail(
            "not-exported",
            "a cyclic schedule is not exported",
            closed.system.schedule.span,
            help="export the system without `schedule`: that includes all scheduled behaviour",
        )
    for freezer in closed.system.freezers:
        raise fail(
            "not-exported",
            f"`freezes` is not exported: the node `{freezer.machine.name}` may freeze",
            freezer.machine.span,
            help="export the system without `freezes`, or as `aut` or `dot`, which contain it",
        )
    explored = local_steps_of(closed, options)
    partition = partition_of(closed.system)
    parts = [_Part(closed, m, explored, partition) for m in range(len(closed.charts))]
    for part in parts:
        part.collect(parts)
    initial = tuple(
        tuple(part.place(number) for part, number in zip(parts, start, strict=True))
        for start in explored.starts
    )
    automata = tuple(part.automaton() for part in parts)
    return Network(
        closed, automata, initial, explored.how_started, explored.states, explored.transitions
    )


class _Part:
    """A machine in conversion to an automaton. Local states here have no queue."""

    def __init__(
        self, closed: ClosedSystem, machine: int, explored: LocalExploration, partition: Partition
    ) -> None:
        """Collect the local states: those of global states, and those between messages."""
        self._closed = closed
        self._partition = partition
        self._machine = machine
        self._explored = explored
        self._chart = closed.charts[machine]
        self._instance = closed.system.machines[machine]
        self._arrivals: dict[Message, int] = {}
        members = explored.local_states[machine]
        found = dict.fromkeys(sorted(explored.reached[machine]))
        ahead = list(found)
        while ahead:
            for after, _ in members[ahead.pop()].delivered.values():
                if after not in found:
                    found[after] = None
                    ahead.append(after)
        self._members = [members[number] for number in found]
        self._inside = self._keeps_queue()
        bare = {self._bare(local.snapshot) for local in self._members}
        for number in sorted(explored.reached[machine]):
            elapsed = members[number].elapsed
            if elapsed >= 0:
                bare.add(self._bare(members[elapsed].snapshot))
        self._ordered = in_order(self._chart, list(bare))
        self._numbers = {snapshot: number for number, snapshot in enumerate(self._ordered)}
        self._moves: dict[tuple[object, ...], Move] = {}
        self._receives: dict[tuple[int, int], tuple[int, bool]] = {}
        self._elapsed: dict[int, int] = {}
        self._contents: dict[tuple[int, ...], None] = {(): None}

    def _keeps_queue(self) -> bool:
        """Whether the queue must be part of the local state, because not only its head counts."""
        defers = any(index_of(self._chart).defers)
        return self._instance.is_monitor or bool(self._chart.invocations) or defers

    def _bare(self, snapshot: Snapshot) -> Snapshot:
        return snapshot if self._inside else replace(snapshot, queue=())

    def _number(self, snapshot: Snapshot) -> int:
        return self._numbers[self._bare(snapshot)]

    def arrival(self, message: Message) -> int:
        """Return the number of a message to this machine."""
        return self._arrivals.setdefault(message, len(self._arrivals))

    def _waiting(self, queue: tuple[Occurrence, ...]) -> tuple[int, ...]:
        if self._inside:
            return ()
        return tuple(self.arrival(Message(self._machine, occurrence)) for occurrence in queue)

    def place(self, number: int) -> Place:
        """Return a local state of the exploration, with its queue beside it."""
        snapshot = self._explored.local_states[self._machine][number].snapshot
        return Place(self._number(snapshot), self._waiting(snapshot.queue))

    # --- steps -----------------------------------------------------------------------------------

    def collect(self, parts: list[_Part]) -> None:
        """Collect the steps; then all machines know their possible messages."""
        for local in self._members:
            snapshot = local.snapshot
            source = self._number(snapshot)
            self._contents[self._waiting(snapshot.queue)] = None
            for outcome in (*(local.own or ()), *(local.open or ())):
                self._add(source, snapshot, outcome, parts)
            for message, (number, full) in local.delivered.items():
                after = self._explored.local_states[self._machine][number].snapshot
                if message.event is None or self._inside:
                    self._receives[source, self.arrival(message)] = self._number(after), full
            if local.elapsed >= 0:
                after = self._explored.local_states[self._machine][local.elapsed].snapshot
                self._elapsed[source] = self._number(after)

    def _add(self, source: int, before: Snapshot, outcome: Outcome, parts: list[_Part]) -> None:
        step = outcome.step
        takes = step.action is Action.TAKE and not self._inside
        rest = before.queue[1:] if takes else before.queue
        posted = () if self._inside else outcome.after.queue[len(rest) :]
        sent = [Sent(self._machine, number) for number in self._waiting(posted)]
        sent += [Sent(m.target, parts[m.target].arrival(m)) for m in outcome.messages]
        from_outside = step.action is Action.OCCUR and not self._is_spontaneous(step.argument)
        (taken,) = self._waiting(before.queue[:1]) if takes else (None,)
        move = Move(
            source,
            self._number(outcome.after),
            step,
            outcome.mover,
            cause(self._closed, before, step),
            self._shown(before, step),
            taken,
            needs_empty=not takes and not from_outside and step.action is not Action.EVENTLESS,
            from_outside=from_outside,
            fair=step.action is Action.OCCUR and self._closed.possible[step.argument].fair,
            sent=tuple(sent),
            faults=FAULT in outcome.notes,
        )
        key = (source, step.action, taken, step.argument, step.choices)
        known = self._moves.get(key)
        if known is None or len(known.sent) < len(move.sent):
            self._moves[key] = move

    def _shown(self, before: Snapshot, step: Step) -> str:
        """Return the label of a step, for all payloads that are equivalent to its own."""
        occurrence = occurrence_of(self._closed, before, step)
        if occurrence is None:
            return cause(self._closed, before, step)
        event, tick = self._chart.events[occurrence.event], self._chart.capacities.tick
        parts = []
        for part, (field, value) in enumerate(zip(event.fields, occurrence.payload, strict=True)):
            place = field_of(self._machine, event.index, part)
            least, greatest = self._partition.alike(field.type, place, value) or (value, value)
            ends = dict.fromkeys(show(end, field.type, tick) for end in (least, greatest))
            parts.append(f"{plain(field.name)} = {plain('..'.join(ends))}")
        return f"{plain(event.name)}({', '.join(parts)})" if parts else plain(event.name)

    def _is_spontaneous(self, possible: int) -> bool:
        return self._closed.possible[possible].spontaneous

    # --- the automaton ---------------------------------------------------------------------------

    def automaton(self) -> Automaton:
        """Return the automaton of the collected steps."""
        return Automaton(
            self._instance.name,
            self._instance.environment,
            self._instance.is_monitor,
            self._chart.capacities.queue if self._has_queue() else 0,
            tuple(self._locals()),
            tuple(sorted(self._moves.values(), key=lambda m: (m.source, m.action.value))),
            tuple(self._named_arrivals()),
            self._receives,
            self._elapsed,
            tuple(sorted(self._contents)),
        )

    def _has_queue(self) -> bool:
        return not self._inside and any(m.event is not None for m in self._arrivals)

    def _locals(self) -> Iterator[Local]:
        empty: dict[int, LocalState] = {}
        for number in self._explored.reached[self._machine]:
            local = self._explored.local_states[self._machine][number]
            if self._inside or not local.snapshot.queue:
                self._explored.own_steps(self._machine, number)
                self._explored.open_steps(self._machine, number)
                empty[self._number(local.snapshot)] = local
        named = names_and_texts(self._chart, self._ordered)
        for number, (snapshot, (name, text)) in enumerate(zip(self._ordered, named, strict=True)):
            view = self._explored.local_steps.view(self._machine, snapshot)
            known = empty.get(number)
            yield Local(
                name,
                text,
                snapshot,
                waiting=view.waiting,
                awaited=view.awaited > 0,
                busy=known is not None and known.busy,
                fair=known is not None and known.fair,
                at_rest=view.at_rest,
            )

    def _named_arrivals(self) -> Iterator[Arrival]:
        names = Names()
        for message in self._arrivals:
            if message.event is not None:
                text = occurrence_text(self._chart, message.event)
            else:
                text = self._value_text(message)
            yield Arrival(names.take(text), text, message.event is not None)

    def _value_text(self, message: Message) -> str:
        inputs = self._chart.inputs
        tick = self._chart.capacities.tick
        if message.input < len(inputs):
            declared = inputs[message.input]
            return f"{declared.name} = {show(message.value, declared.type, tick)}"
        slot = self._instance.shared[message.input - len(inputs)]
        return f"{slot} = {show(message.value, type_of_slot(self._chart, slot), tick)}"
