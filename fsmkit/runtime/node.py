"""A node of a deployment in Python: its machines in the interpreter, and its link.

A cycle equals that of the generated C (``<node>_cycle``). The levels of other nodes become inputs,
received events are posted, the machines run until they are quiet, and events for other nodes are
sent.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from fsmkit.chart.chart import Chart
from fsmkit.language import Value
from fsmkit.language.values import from_python, to_python
from fsmkit.plugins import plugin
from fsmkit.runtime.host_methods import BoundHost, find
from fsmkit.runtime.interpreter.macrostep import initial
from fsmkit.runtime.interpreter.run import has_room
from fsmkit.runtime.interpreter.snapshot import Called, Emitted, Occurrence
from fsmkit.runtime.links.faults import Faults
from fsmkit.runtime.links.link import LinkKind, OperationTranslator, TranslatorKind
from fsmkit.runtime.links.opening import open_link
from fsmkit.runtime.system_session import Happening, SystemSession
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import Message
from fsmkit.system.machine import InputLink, operation_port, port_name
from fsmkit.system.schedule import time_unit
from fsmkit.system.shared import written_value


class Node(AbstractContextManager["Node"]):
    """The machines of a node, and its link to the other nodes.

    Args:
        deployment: The result of `fsmkit.read`.
        name: The node.
        session: A different number for each start of the program, 1 to 2^32 - 1; usually the time.
        operations: For each machine, an object with a method for each operation of its chart, or a
            mapping of functions. An operation connected to an event needs none.
        kind: The transport between the fsmkit nodes; None: that of the deployment.
        options: Options of the kind.
        foreign: Additional options of the translators, by third-party node.
        faults: Seeded faults of arriving frames.
        seed: Picks the delays that a chart gives as intervals.

    Raises:
        FsmkitError: ``missing-operation``; ``different-ticks``; ``link-not-opened``.
        ValueError: The node does not exist or is a third-party node, or ``operations`` names a
            machine that the node does not have.

    """

    def __init__(
        self,
        deployment: Deployment,
        name: str,
        *,
        session: int,
        operations: Mapping[str, object] | None = None,
        kind: str | None = None,
        options: Mapping[str, Any] | None = None,
        foreign: Mapping[str, Mapping[str, Any]] | None = None,
        faults: Faults | None = None,
        seed: int = 0,
    ) -> None:
        self.deployment = deployment
        self.place = deployment.map.node(name)
        if self.place not in deployment.own_nodes:
            raise ValueError(f"the node `{name}` is a third-party node: its machines only model it")
        self.system = deployment.part(self.place)
        names = [machine.name for machine in self.system.machines]
        if unknown := sorted(set(operations or {}).difference(names)):
            raise ValueError(f"`{name}` has no machine `{unknown[0]}`, only {', '.join(names)}")
        time_unit(self.system)  # raises unless all machines have the same tick
        self.machines = SystemSession(self.system, self._answers(operations or {}, seed), seed=seed)
        """The machines; their clock is the time of the last cycle, in ticks."""
        self.lost = 0
        """Events for machines that do not run."""
        carrier = kind or deployment.carrier
        own_options = plugin(LinkKind, carrier).link_options(deployment)
        carried: dict[str, dict[str, Any]] = {}
        for each in sorted(set(filter(None, deployment.map.foreign))):
            carried |= plugin(TranslatorKind, each).foreign_options(deployment, name)
        given = foreign or {}
        self.link = open_link(
            deployment.map,
            name,
            session=session,
            kind=carrier,
            faults=faults,
            options={**own_options, **(options or {})},
            foreign={peer: {**own, **given.get(peer, {})} for peer, own in carried.items()},
        )
        """The link, with its counters, and the silence of each peer."""
        levels = zip(deployment.wires.levels, deployment.map.levels, strict=True)
        self._levels = tuple(
            (wire, level) for wire, level in levels if level.receiver == self.place
        )
        """Inputs that other nodes drive."""
        for wire, _ in self._levels:  # the initial value of an input is that of the output
            sender = deployment.system.machines[wire.source]
            data = initial(sender.chart).data
            self._drive(wire, written_value(sender, sender.chart, data, wire.output))
        self._is_started = False
        self._left: Message | None = None
        self._answered: list[Happening] = []
        for translator in self.link.translators:
            if isinstance(translator, OperationTranslator):
                translator.answer = self._answer

    def cycle(self, now: int) -> list[Happening]:
        """Run one cycle at time `now` (ticks since the start); return the steps of the machines.

        The first cycle starts the machines. An event for a full queue waits in the link until the
        machines have run. Raises `ValueError` if the time decreases.
        """
        if now < self.machines.now:
            raise ValueError(f"time does not go back: {now} after {self.machines.now}")
        done: list[Happening] = []
        if not self._is_started:
            self._is_started = True
            done += self._send_events(self.machines.start())
        self.link.begin_cycle()
        done += self._answered
        self._answered = []
        for wire, level in self._levels:
            if (value := self.link.level(level.name)) is not None:
                self._drive(wire, from_python(value, level.type))
        goes_on = True
        while goes_on:
            goes_on = self._post_all()
            done += self._send_events(self.machines.run(now))
            goes_on = goes_on and self._left is not None
        self.link.end_cycle(self._own_levels())
        return done

    def close(self) -> None:
        """Close the link."""
        self.link.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- receiving ----------------------------------------------------------------------------

    def _post_all(self) -> bool:
        """Post the received events, and keep those that do not fit; return whether any did."""
        has_posted = False
        while True:
            message = self._left or self.link.receive()
            self._left = None
            if message is None:
                return has_posted
            snapshot = self.machines.snapshot(message.machine)
            chart = self._chart(message.machine)
            if not snapshot.running:
                self.lost += 1
            elif not has_room(chart, snapshot):
                self._left = message
                return has_posted
            else:
                event = chart.event_index[message.event]
                self.machines.enqueue(message.machine, Occurrence(event, message.values))
            has_posted = True

    def _answer(self, number: int, values: tuple[Value, ...]) -> tuple[bool, Value | None]:
        """Let a machine answer an event, by the number of its message: handled, and the reply."""
        message = self.deployment.map.messages[number - 1]
        event = self._chart(message.target.machine).event_index[message.target.name]
        happened, is_handled, reply = self.machines.dispatch(
            message.target.machine, Occurrence(event, values)
        )
        self._answered += self._send_events(happened)
        return is_handled, reply

    def _drive(self, wire: InputLink, value: Value) -> None:
        machine = self.deployment.system.machines[wire.target].name
        self.machines.drive(machine, wire.input, value)

    # --- sending -----------------------------------------------------------------------------

    def _send_events(self, happened: list[Happening]) -> list[Happening]:
        """Send the events that left the machines for other nodes."""
        for happening in happened:
            chart = self._chart(happening.machine)
            for effect in happening.macrostep.effects:
                match effect:
                    case Emitted(Occurrence(event, payload)):
                        self._send(happening.machine, event, payload)
                    case Called(operation, arguments):
                        self._send(happening.machine, operation_port(chart, operation), arguments)
                    case _:
                        pass
        return happened

    def _send(self, machine: str, port: int, values: tuple[Value, ...]) -> None:
        wires = self.deployment.wires
        for wire, message in zip(wires.events, wires.map.messages, strict=True):
            if wire.port == port and message.source.machine == machine:
                self.link.send(Message(message, tuple(values[n] for n in wire.arguments)))

    def _own_levels(self) -> dict[str, object]:
        found = {}
        wires = self.deployment.wires
        for wire, level in zip(wires.levels, wires.map.levels, strict=True):
            if level.sender == self.place:
                machine = self.deployment.system.machines[wire.source]
                data = self.machines.snapshot(machine.name).data
                value = written_value(machine, machine.chart, data, wire.output)
                found[level.name] = to_python(value, level.type)
        return found

    # --- inside --------------------------------------------------------------------------------

    def _chart(self, machine: str) -> Chart:
        return next(each.chart for each in self.system.machines if each.name == machine)

    def _answers(self, operations: Mapping[str, object], seed: int) -> dict[str, dict[str, Any]]:
        """Return the functions of all operations; those that are connected need not be given."""
        whole = self.deployment.system
        answers = {}
        numbers = self.deployment.machines_of(self.place)
        for number, machine in zip(numbers, self.system.machines, strict=True):
            given = operations.get(machine.name, {})
            connected = {
                port_name(machine.chart, link.port)
                for link in whole.event_links
                if link.source == number
            }
            functions = {
                operation.name: find(given, operation.name)
                or (_nothing if operation.name in connected else None)
                for operation in machine.chart.operations
            }
            host = BoundHost(machine.chart, functions, seed)
            answers[machine.name] = {
                operation.name: partial(host.call, operation.name)
                for operation in machine.chart.operations
            }
        return answers


def _nothing(*_: object) -> None:
    """Do nothing: the connection carries the call."""
