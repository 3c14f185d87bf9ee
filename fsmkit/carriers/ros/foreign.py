"""Foreign nodes of ROS 2: the topics of connections, with type, fields and QoS.

A topic has the name of the port of the foreign machine, within the namespace of the node, unless
``bind`` names another for a connection.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from fsmkit.carriers.ros.keys import BINDING, LIFECYCLE
from fsmkit.carriers.ros.messages import (
    DURATION,
    DURATION_TYPE,
    STANDARD,
    RosType,
    camel,
    event_type,
    holds,
    level_type,
    lower,
    package_name,
    smallest,
    unique,
)
from fsmkit.carriers.ros.network import domain_of
from fsmkit.carriers.ros.services import (
    SET_BOOL,
    STANDARD_SERVICES,
    TRIGGER,
    RosService,
    generated_service,
    standard_service,
)
from fsmkit.carriers.ros.topics import QOS, RosNode, RosPart, RosTopic, RosWire, is_topic
from fsmkit.diagnostics import Findings, Span, Text
from fsmkit.diagnostics.suggestions import suggest
from fsmkit.emit import Identifier, plain
from fsmkit.language import Field, Type
from fsmkit.system.deployment.addresses import read_insecure
from fsmkit.system.deployment.crossing import Wires
from fsmkit.system.deployment.event_map import LEVELS, LevelType, MessageType
from fsmkit.system.machine import EventLink, InputLink, Machine, port_fields
from fsmkit.system.system import System
from fsmkit.yaml.nodes import Node, entries_of, require_record, require_text

Found = TypeVar("Found")
WAYS = ("dds", "rclpy")
"""Topics are by DDS either way; rclpy offers services and a life, too."""
INTERFACE = re.compile(r"(?!std_msgs/)[a-z]\w*/msg/[A-Z]\w*", re.ASCII)
"""A type of messages of another package, as ROS names it."""


@dataclass(frozen=True, slots=True)
class _Bound:
    """The entry of a connection in ``bind``."""

    name: Text
    topic: Text | None
    type: RosType | None
    fields: Mapping[str, Text]
    qos: str | None
    service: str | None = None


def ros_node(
    peer: int,
    span: Span,
    options: Mapping[str, Text],
    tables: Mapping[str, Node],
    system: System,
    wires: Wires,
    findings: Findings,
) -> RosNode:
    """Return the topics of a foreign node, which is named at ``span``; mind the findings."""
    return _RosNode(peer, span, options, system, wires, findings).node(tables)


class _RosNode:
    def __init__(
        self,
        peer: int,
        span: Span,
        options: Mapping[str, Text],
        system: System,
        wires: Wires,
        findings: Findings,
    ) -> None:
        self.peer = peer
        self.span = span
        self.system = system
        self.wires = wires
        self.map = wires.map
        self.findings = findings
        self.bound: dict[str, _Bound] = {}
        self.types: dict[tuple[int, str], tuple[RosType, tuple[Identifier, ...]]] = {}
        self.names: set[str] = set()
        self.domain = domain_of(options.get("domain"), findings)
        self.is_insecure = read_insecure(options.get("insecure"), findings)
        self.services: list[RosService] = []
        self.lifecycle: dict[str, int] = {}
        way = options.get("way")
        self._one_of(way, {name: name for name in WAYS}, "way")
        self.by_rclpy = way is not None and way.value == "rclpy"
        given = options.get("namespace")
        self.namespace = f"/{lower(self.map.nodes[peer])}"
        if given is not None and is_topic(given, "namespace", findings):
            self.namespace = "/" + plain(given.value).strip("/")

    def node(self, tables: Mapping[str, Node]) -> RosNode:
        self._read(tables.get("bind"))
        self._read_lifecycle(tables.get("lifecycle"))
        found = [*self._events(), *self._levels()]
        self._report_clashes(found)
        start = []
        for level in self.map.levels_of(self.peer):
            machine = next(m for m in self.system.machines if m.name == level.source.machine)
            output = next(o for o in machine.chart.outputs if o.name == level.source.name)
            start.append(output.init.value)
        return RosNode(
            self.domain,
            self.namespace,
            tuple(found),
            tuple(start),
            self.is_insecure,
            tuple(self.services),
            self.lifecycle,
        )

    # --- keys of the file -----------------------------------------------------------------------

    def _read(self, node: Node | None) -> None:
        names = [message.name for message in self.map.messages if self._is_own(message)]
        names += [level.name for level in self.map.levels if self._is_own(level)]
        for key, value in entries_of(node, "`bind`", self.findings):
            name = " -> ".join(part.strip() for part in key.value.split("->"))
            parts = require_record(value, BINDING, f"`{key}`", self.findings) or {}
            if name not in names:
                self.findings.add(
                    "unknown-name",
                    f"`{key}` is no connection with this node",
                    key,
                    help=suggest(name, names, "name a connection as the system file has it"),
                )
                continue
            texts = {
                part: require_text(parts.get(part), f"`{part}`", self.findings)
                for part in ("topic", "type", "qos")
            }
            fields = {
                field.value: text
                for field, each in entries_of(parts.get("fields"), "`fields`", self.findings)
                if (text := require_text(each, f"`{field}`", self.findings)) is not None
            }
            topic = texts["topic"]
            if topic is not None and not is_topic(topic, "topic", self.findings):
                topic = None
            service = None
            type_ = None
            if texts["type"] is not None and texts["type"].value in STANDARD_SERVICES:
                service = texts["type"].value
            else:
                type_ = self._type(texts["type"])
            qos = self._one_of(texts["qos"], {name: name for name in QOS}, "profile of QoS")
            self.bound[name] = _Bound(key, topic, type_, fields, qos, service)

    def _type(self, text: Text | None) -> RosType | None:
        """Return a type of messages with one number, or none."""
        if text is None or text.value in STANDARD or not INTERFACE.fullmatch(text.value):
            return self._one_of(text, STANDARD, "type of messages")
        self.findings.add(
            "unfit-message",
            f"`{text}` cannot be bound: it may have nested types or arrays",
            text,
            help="remove `type` and publish the message that `fsmkit compile` writes into "
            "`msg/`, or one of std_msgs, from a node that takes the other apart",
        )
        return None

    def _read_lifecycle(self, node: Node | None) -> None:
        parts = require_record(node, LIFECYCLE, "`lifecycle`", self.findings) or {}
        known = {
            message.name: message for message in self.map.messages if message.sender == self.peer
        }
        for transition, value in parts.items():
            text = require_text(value, f"`{transition}`", self.findings)
            if text is None:
                continue
            name = " -> ".join(part.strip() for part in text.value.split("->"))
            message = known.get(name)
            if not self.by_rclpy:
                self.findings.add(
                    "unfit-message",
                    "the life of a node needs `way: rclpy`",
                    text,
                    help="write `way: rclpy`, and run the node in Python beside ROS",
                )
                return
            if message is None:
                self.findings.add(
                    "unknown-name",
                    f"`{text}` is no connection that comes from this node",
                    text,
                    help=suggest(name, list(known), "name a connection as the system file has it"),
                )
            elif message.fields:
                self.findings.add(
                    "unfit-message",
                    f"`{name}` carries values, and a transition of a node's life has none",
                    text,
                    help="connect an event without fields",
                )
            else:
                self.lifecycle[transition] = message.number

    def _one_of(self, text: Text | None, known: Mapping[str, Found], what: str) -> Found | None:
        if text is None:
            return None
        if text.value not in known:
            self.findings.add(
                "unexpected-value",
                f"the {what} `{text}` is unknown",
                text,
                help=suggest(text.value, list(known), f"use one of {', '.join(known)}"),
            )
        return known.get(text.value)

    # --- connections ---------------------------------------------------------------------------

    def _is_own(self, wire: MessageType | LevelType) -> bool:
        return self.peer in (wire.sender, wire.receiver)

    def _events(self) -> Iterator[RosWire]:
        for message, link in zip(self.map.messages, self.wires.events, strict=True):
            if not self._is_own(message):
                continue
            is_sent = message.sender == self.peer  # by the foreign node
            number = link.source if is_sent else link.target
            end = message.source if is_sent else message.target
            machine = self.system.machines[number]
            if message.number in self.lifecycle.values() or self._is_answered(link, message):
                continue
            if (own_bound := self.bound.get(message.name)) is not None and own_bound.service:
                self.findings.add(
                    "unfit-message",
                    f"`{message.target}` returns no value, but `{own_bound.service}` is a service",
                    own_bound.name,
                    help="declare the event with `-> type`, or name a type of messages",
                )
                continue
            declared = port_fields(machine.chart, link.port)
            if not is_sent:
                declared = machine.chart.events[link.event].fields
            if not self._can_cross(message.name, [field.type for field in declared]):
                continue
            made, names = self._type_of(number, end.name, declared)
            places = link.arguments if is_sent else range(len(declared))
            own = [Field(part.name, part.type) for part in message.fields]
            bound = self.bound.get(message.name)
            if bound is not None and bound.type is not None:
                made, parts = bound.type, self._bound_parts(bound, own)
            else:
                parts = tuple(
                    RosPart(names[place], part.type)
                    for place, part in zip(places, own, strict=True)
                )
                self._report_fields(bound)
            topic = self._topic(bound, end.machine, end.name)
            yield RosWire(
                RosTopic(topic, made, (bound and bound.qos) or "default", is_event=True),
                message.sender,
                message.receiver,
                message.number,
                0,
                parts,
                machine.chart.capacities.tick,
            )

    def _levels(self) -> Iterator[RosWire]:
        for place, (level, link) in enumerate(zip(self.map.levels, self.wires.levels, strict=True)):
            if not self._is_own(level) or not self._can_cross(level.name, [level.type]):
                continue
            end = level.source if level.sender == self.peer else level.target
            bound = self.bound.get(level.name)
            made = level_type(level.type)
            own = [Field(end.name, level.type)]
            if bound is not None and bound.type is not None:
                made, parts = bound.type, self._bound_parts(bound, own)
            else:
                field = None if made == DURATION_TYPE else made.fields[0].name
                parts = (RosPart(field, level.type),)
                self._report_fields(bound)
            before = sum(other.sender == level.sender for other in self.map.levels[:place])
            topic = self._topic(bound, end.machine, end.name)
            yield RosWire(
                RosTopic(topic, made, (bound and bound.qos) or "state", is_event=False),
                level.sender,
                level.receiver,
                LEVELS,
                before,
                parts,
                self._tick(link),
            )

    def _tick(self, link: InputLink) -> int:
        return self.system.machines[link.source].chart.capacities.tick

    def _topic(self, bound: _Bound | None, machine: str, name: str) -> str:
        if bound is None or bound.topic is None:
            return f"{self.namespace}/{lower(machine)}/{lower(name)}"
        given = plain(bound.topic.value)
        return given if given.startswith("/") else f"{self.namespace}/{given}"

    def _type_of(
        self, machine: int, name: str, fields: tuple[Field, ...]
    ) -> tuple[RosType, tuple[Identifier, ...]]:
        key = machine, plain(name)
        if key not in self.types:
            wanted = camel(self.system.machines[machine].name, name)
            own = unique(wanted, self.names)
            listed = [(field.name, field.type) for field in fields]
            self.types[key] = event_type(package_name(self.map.system), own, listed)
        return self.types[key]

    def _bound_parts(self, bound: _Bound, own: list[Field]) -> tuple[RosPart, ...]:
        """Return the fields of the values in a named message; report values without a field."""
        assert bound.type is not None  # noqa: S101  (who calls has seen it)
        fields = {plain(field.name): field for field in bound.type.fields}
        is_alone = len(own) == 1 and not bound.fields
        found = []
        for part in own:
            field = None
            given = bound.fields.get(part.name)
            wanted = plain(part.name if given is None else given.value)
            if is_alone and bound.type == DURATION_TYPE:
                primitive = DURATION
            elif is_alone and len(fields) == 1:
                (field,) = fields.values()
                primitive = field.type
            elif wanted in fields:
                field = fields[wanted]
                primitive = field.type
            else:
                self.findings.add(
                    "unfit-message",
                    f"`{bound.type}` has no field for `{part.name}`",
                    bound.name if given is None else given,
                    help=f"write `fields: {{{part.name}: {next(iter(fields), 'data')}}}` with a "
                    "field of the message, or name another type",
                )
                continue
            if not holds(primitive, part.type):
                self.findings.add(
                    "unfit-message",
                    f"`{part.name}` is `{part.type}`, which `{bound.type}` does not hold",
                    bound.name if given is None else given,
                    help=f"use `{level_type(part.type)}`",
                )
            found.append(RosPart(None if field is None else field.name, part.type))
        names = {plain(part.name) for part in own}
        for name, text in bound.fields.items():
            if plain(name) not in names:
                self.findings.add(
                    "unknown-name",
                    f"`{bound.name}` has no value `{name}`",
                    text,
                    help=suggest(name, sorted(names), "leave it out"),
                )
        return tuple(found)

    # --- findings ------------------------------------------------------------------------------

    def _report_fields(self, bound: _Bound | None) -> None:
        if bound is not None and bound.fields:
            self.findings.add(
                "unfit-message",
                f"`fields` of `{bound.name}` names fields of no type",
                next(iter(bound.fields.values())),
                help="name the `type`, or remove `fields`",
            )

    def _can_cross(self, name: str, types: list[Type]) -> bool:
        for type_ in types:
            try:
                smallest(type_)
            except StopIteration:
                self.findings.add(
                    "unfit-message",
                    f"`{name}` carries `{type_}`, which no field of a message holds",
                    self.span,
                    help="declare numbers, enumerations or durations",
                )
                return False
        return True

    def _is_answered(self, link: EventLink, message: MessageType) -> bool:
        """Whether an event is a request instead of a message; then it offers a service."""
        target = self.system.machines[link.target]
        reply = target.chart.events[link.event].reply
        if reply is None:
            return False
        if message.receiver == self.peer:
            self._reject(
                target,
                f"`{message.target}` answers, and nothing here would wait for a service of ROS",
            )
        elif not self.by_rclpy:
            self._reject(
                target, f"`{message.target}` is answered: answered events need `way: rclpy`"
            )
        elif self._can_cross(message.name, [*(each.type for each in message.fields), reply]):
            self._offer(target, message, reply)
        return True

    def _reject(self, machine: Machine, text: str) -> None:
        self.findings.add(
            "unfit-message",
            text,
            self.span,
            secondary=[] if machine.span is None else [(machine.span, "the machine")],
            help="send an event, and return the result as another event",
        )

    def _offer(self, machine: Machine, message: MessageType, reply: Type) -> None:
        bound = self.bound.get(message.name)
        end, number, fields = message.target, message.number, message.fields
        name = self._topic(bound, end.machine, end.name)
        if bound is not None and bound.service is not None:
            found = standard_service(name, bound.service, number, fields, reply)
        elif bound is not None and bound.type is not None:
            found = None
        else:
            own = unique(camel(end.machine, end.name), self.names)
            of = package_name(self.map.system), own
            tick = machine.chart.capacities.tick
            found = generated_service(name, of, number, fields, reply, tick)
        if found is None:
            assert bound is not None  # noqa: S101  (it has a type)
            self.findings.add(
                "unfit-message",
                f"`{bound.service or bound.type}` is no service with the fields of "
                f"`{message.target}`",
                bound.name,
                help=f"use {TRIGGER} for no field, {SET_BOOL} for one that is true or false, or "
                "remove the type",
            )
        elif any(each.name == name for each in self.services):
            self.findings.add(
                "unfit-message",
                f"two events would be the service `{name}`",
                self.span if bound is None else bound.name,
                help="bind one of them to another name with `topic`",
            )
        else:
            self.services.append(found)

    def _report_clashes(self, wires: list[RosWire]) -> None:
        """Report a topic with two types, two profiles, or messages in both directions."""
        seen: dict[str, RosWire] = {}
        for wire in wires:
            first = seen.setdefault(wire.topic.name, wire)
            is_same = first.topic == wire.topic
            if is_same and (first.sender == self.peer) == (wire.sender == self.peer):
                continue
            what = "messages of both sides" if is_same else "two types or profiles"
            names = [each for each in self.bound.values() if each.topic is not None]
            at = next((e.topic for e in reversed(names) if self._is_at(e, wire)), None)
            self.findings.add(
                "unfit-message",
                f"the topic `{wire.topic.name}` would have {what}: `{self._name(first)}` and "
                f"`{self._name(wire)}`",
                at or self.span,
                help="bind one of them to another topic",
            )

    def _is_at(self, bound: _Bound, wire: RosWire) -> bool:
        return self._topic(bound, "", "") == wire.topic.name

    def _name(self, wire: RosWire) -> str:
        if wire.number != LEVELS:
            return self.map.messages[wire.number - 1].name
        return self.map.levels_of(wire.sender)[wire.place].name
