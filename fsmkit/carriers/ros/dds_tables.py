"""The tables of a node for Cyclone DDS: its topics with foreign nodes, and those of its frames.

They are those of ``fsm_link_dds.h`` and ``fsm_link_ros.h``. Structs and descriptors of messages are
those that ``idlc`` generates from `compose_ros`.
"""

from __future__ import annotations

from collections.abc import Iterator

from fsmkit.carriers.ros.definitions import idl_file
from fsmkit.carriers.ros.messages import COUNTERS, INTEGERS, STRING, RosType, lower
from fsmkit.carriers.ros.network import frames_of, ros_nodes
from fsmkit.carriers.ros.topics import RosNode, RosPart, RosTopic, RosWire
from fsmkit.codegen.c.header import NOTICE
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.payload import RANGES, places, size_of
from fsmkit.emit import Emitter, Namer, printing
from fsmkit.emit.c import comment
from fsmkit.language import BoolType, DurationType, FloatType, Type
from fsmkit.runtime.links.codec import code_of, layout
from fsmkit.system.deployment.event_map import LEVELS

QOS = {
    "default": "FSM_ROS_DEFAULT",
    "state": "FSM_ROS_STATE",
    "sensor": "FSM_ROS_SENSOR",
}
PRIMITIVES = {"bool": "bool", "float32": "float", "float64": "double"} | {
    name: f"{name}_t" for name in INTEGERS
}
"""The primitive types of ``idlc``."""


@printing
def compose_dds(node: Node) -> dict[str, str]:
    """Return header and source of the tables; empty if the node does not use ROS."""
    nodes = {
        peer: own
        for peer, ros in ros_nodes(node.deployment).items()
        if (own := wires_with(node, ros))
    }
    net = frames_of(node.deployment)
    if not nodes and net is None:
        return {}
    file = f"{node.prefix}_dds"
    guard = f"{file.upper()}_H"
    head, out = Emitter(), Emitter()
    head.line(f"/* {file}.h: topics of the node {comment(node.name)}. {NOTICE} */")
    head.lines([f"#ifndef {guard}", f"#define {guard}", ""])
    head.lines(['#include "fsm_link_ros.h"'] if net is not None else [])
    head.lines(['#include "fsm_link_dds.h"'] if nodes else [])
    head.lines(["", "#ifdef __cplusplus", 'extern "C" {', "#endif", ""])
    out.line(f"/* {file}.c: see {file}.h. {NOTICE} */")
    out.line(f'#include "{file}.h"')
    out.line()
    if nodes:
        types = {wire.topic.type: None for own in nodes.values() for wire in own} | {STRING: None}
        for type_ in types:
            out.line(f'#include "{idl_file(type_).removesuffix(".idl")}.h"')
        out.lines(["", "#include <string.h>", ""])
    if net is not None:
        head.line(f"extern const fsm_link_ros_net {node.prefix}_ros; /* frames of all nodes */")
        with out.block(f"static const char *const {file}_frames[] = {{", "};"):
            out.lines(f'"rt{name}",' if name else "NULL," for name in net.frames)
        out.line(f"const fsm_link_ros_net {node.prefix}_ros = {{{net.domain}u, {file}_frames}};")
        out.line()
    for peer, wires in nodes.items():
        name = f"{file}_{node.words[peer].lower()}"
        _names(head, node, peer, name)
        Tables(out, node, peer, wires, name).print()
    head.lines(["", "#ifdef __cplusplus", "}", "#endif", "", "#endif"])
    return {f"{file}.h": head.finish(), f"{file}.c": out.finish()}


def wires_with(node: Node, ros: RosNode) -> tuple[RosWire, ...]:
    """Return the connections of a node with a foreign one."""
    return tuple(wire for wire in ros.wires if node.place in (wire.sender, wire.receiver))


def _names(head: Emitter, node: Node, peer: int, name: str) -> None:
    """Declare the table of a foreign node, and the indices of the shown machines."""
    head.line(f"extern const fsm_link_dds_node {name}; /* {comment(node.map.nodes[peer])} */")
    namer = Namer()
    with head.block("enum { /* for fsm_link_dds_show */", "};"):
        for place, machine in enumerate(node.system.machines):
            word = namer.name(machine.name.upper())
            head.line(f"{name.upper()}_{word} = {place}, /* {comment(machine.name)} */")


class Tables:
    """The tables of one foreign node for Cyclone DDS."""

    KIND = "fsm_link_dds"
    RESULT = "dds_return_t"
    WRITER = "dds_entity_t writer"
    WRITE = "dds_write(writer, &m)"

    def __init__(
        self, out: Emitter, node: Node, peer: int, wires: tuple[RosWire, ...], name: str
    ) -> None:
        self.out = out
        self.node = node
        self.peer = peer
        self.ros = ros_nodes(node.deployment)[peer]
        self.wires = wires
        self.name = name
        self.topics: dict[str, RosTopic] = {wire.topic.name: wire.topic for wire in wires}
        self.sent = {wire.topic.name for wire in wires if wire.sender == node.place}

    def print(self) -> None:
        """Print all tables."""
        out, name = self.out, self.name
        machines = self.node.system.machines
        self.require("TOPICS", len(self.topics))
        self.require("MACHINES", len(machines))
        self.print_wires()
        with out.block(f"static const char *const {name}_machines[] = {{", "};"):
            for machine in machines:
                out.line(f'"rt{self.ros.namespace}/{lower(machine.name)}/state",')
        self._text()
        levels, start_values = self.print_start()
        counts = f"{len(self.topics)}u, {len(self.wires)}u, {len(machines)}u"
        with out.block(f"const fsm_link_dds_node {name} = {{", "};"):
            out.lines(
                [
                    f"{self.peer}u, {self.ros.domain}u, {str(self.ros.is_insecure).lower()},",
                    f"{levels}u, {start_values}, {counts},",
                    f"{name}_topics, {name}_wires, {name}_machines,",
                    f"&{_struct(STRING)}_desc, {name}_text",
                ]
            )
        out.line()

    def require(self, what: str, least: int) -> None:
        """Print that a constant of the library is great enough."""
        macro = f"{self.KIND.upper()}_{what}"
        self.out.lines([f"#if {macro} < {least}", f'#error "define {macro} as {least} or more"'])
        self.out.lines(["#endif", ""])

    def print_wires(self) -> None:
        """Print the topics, and the connections with the functions of their values."""
        out, name = self.out, self.name
        rows = [self._wire(place, wire) for place, wire in enumerate(self.wires)]
        with out.block(f"static const {self.KIND}_topic {name}_topics[] = {{", "};"):
            out.lines(map(self.topic_row, self.topics.values()))
        with out.block(f"static const {self.KIND}_wire {name}_wires[] = {{", "};"):
            out.lines(rows)

    def print_start(self) -> tuple[int, str]:
        """Print the initial levels of the foreign node; return their bytes and name."""
        start = layout(tuple(level.type for level in self.node.map.levels_of(self.peer)))
        levels = start.encode(self.ros.start)
        if not levels:
            return 0, "NULL"
        content = ", ".join(f"{byte}u" for byte in levels)
        self.out.line(f"static const uint8_t {self.name}_start[] = {{{content}}};")
        return len(levels), f"{self.name}_start"

    def topic_row(self, topic: RosTopic) -> str:
        """Return the row of a topic."""
        flags = topic.is_event, topic.name in self.sent, topic.type.is_counted
        said = ", ".join(str(flag).lower() for flag in flags)
        return f'{{"rt{topic.name}", &{_struct(topic.type)}_desc, {QOS[topic.qos]}, {said}}},'

    def _wire(self, place: int, wire: RosWire) -> str:
        """Print the function of a connection, and return its row."""
        is_sent = wire.sender == self.node.place
        if wire.number == LEVELS:
            types = [level.type for level in self.node.map.levels_of(wire.sender)]
            at = places(types)[wire.place]
            size = size_of([types[wire.place]])
            values = [(at, types[wire.place], wire.parts[0])]
        else:
            types = [field.type for field in self.node.map.messages[wire.number - 1].fields]
            at = size = 0
            values = list(zip(places(types), types, wire.parts, strict=True))
        function = f"{self.name}_{'publish' if is_sent else 'unpack'}_{place}"
        (self._publish if is_sent else self._unpack)(function, wire, values)
        topic = list(self.topics).index(wire.topic.name)
        row = f"{topic}u, {wire.number}u, {at}u, {size}u"
        return f"{{{row}, NULL, {function}}}," if is_sent else f"{{{row}, {function}, NULL}},"

    def _text(self) -> None:
        kind = _struct(STRING)
        head = f"static dds_return_t {self.name}_text(dds_entity_t writer, char *text)"
        with self.out.block(f"{head}\n{{", "}"):
            self.out.line(f"{kind} m;")
            self.out.line("m.data = text;")
            self.out.line("return dds_write(writer, &m);")
        self.out.line()

    def struct(self, type_: RosType) -> str:
        """Return the name of the struct of a type."""
        return _struct(type_)

    # --- values --------------------------------------------------------------------------------

    def _publish(
        self, function: str, wire: RosWire, values: list[tuple[int, Type, RosPart]]
    ) -> None:
        out = self.out
        head = f"static {self.RESULT} {function}({self.WRITER}, const uint8_t *p,"
        rest = " " * (head.index("(") + 1) + "const fsm_ros_numbers *numbers)"
        with out.block(f"{head}\n{rest}\n{{", "}"):
            out.line(f"{self.struct(wire.topic.type)} m;")
            out.line("memset(&m, 0, sizeof m);")
            if wire.topic.type.is_counted:
                out.lines(f"m.{each} = numbers->{each};" for each in COUNTERS)
            else:
                out.line("(void)numbers;")
            if not values:
                out.line("(void)p;")
            for at, type_, part in values:
                out.lines(_put(at, type_, part, wire))
            out.line(f"return {self.WRITE};")
        out.line()

    def _unpack(
        self, function: str, wire: RosWire, values: list[tuple[int, Type, RosPart]]
    ) -> None:
        out = self.out
        head = f"static bool {function}(const void *sample, uint8_t *p,"
        rest = " " * (head.index("(") + 1) + "fsm_ros_numbers *numbers)"
        with out.block(f"{head}\n{rest}\n{{", "}"):
            is_counted = wire.topic.type.is_counted
            if is_counted or values:
                out.line(f"const {self.struct(wire.topic.type)} *m = sample;")
            else:
                out.line("(void)sample;")
            taken = [(at, type_, _read(part, wire)) for at, type_, part in values]
            conditions = [
                condition
                for (_, type_, read), (_, _, part) in zip(taken, values, strict=True)
                for condition in _limits(type_, read, _primitive(part, wire))
            ]
            if is_counted:
                out.lines(f"numbers->{each} = m->{each};" for each in COUNTERS)
            else:
                out.line("(void)numbers;")
            if conditions:
                with out.block(f"if (!({' && '.join(conditions)})) {{", "}"):
                    out.line("return false;")
            if not values:
                out.line("(void)p;")
            for at, type_, read in taken:
                if isinstance(type_, FloatType):
                    kind = "float" if type_.bits == 32 else "double"
                    out.line(f"fsm_link_put_{kind}(p + {at}, ({kind}){read});")
                else:
                    value = f"({read} ? 1u : 0u)" if isinstance(type_, BoolType) else read
                    size = size_of([type_])
                    out.line(f"fsm_link_put_bytes(p + {at}, (uint64_t){value}, {size}u);")
            out.line("return true;")
        out.line()


def _struct(type_: RosType) -> str:
    """Return the name that ``idlc`` gives to the struct of a type."""
    return f"{type_.package}_msg_dds__{type_.name}_"


def _primitive(part: RosPart, wire: RosWire) -> str:
    found = (field.type for field in wire.topic.type.fields if field.name == part.field)
    return next(found, "")


def _member(part: RosPart) -> str:
    return "" if part.field is None else f"{part.field}."


def _read(part: RosPart, wire: RosWire) -> str:
    """Return the expression of a value in a message."""
    if isinstance(part.type, DurationType):
        member = _member(part)
        return f"fsm_ros_ticks(m->{member}sec, m->{member}nanosec, INT64_C({wire.tick}))"
    return f"m->{part.field}"


def _limits(type_: Type, read: str, primitive: str) -> Iterator[str]:
    """Yield the conditions under which a value of a message fits into the payload."""
    if isinstance(type_, FloatType):
        if type_.bits == 32 and primitive == "float64":
            yield f"fsm_ros_is_float({read})"
        return
    if isinstance(type_, BoolType):
        return
    least, most = INTEGERS.get(primitive, INTEGERS["int64"])  # of durations: their ticks
    lo, hi = RANGES[code_of(type_)]
    if least < lo:
        yield f"{read} >= {lo}"
    if most > hi:
        yield f"{read} <= {f'UINT64_C({hi})' if least >= 0 else f'INT64_C({hi})'}"


def _put(at: int, type_: Type, part: RosPart, wire: RosWire) -> Iterator[str]:
    """Yield the statements that write a value of a payload into a message."""
    primitive = _primitive(part, wire)
    if isinstance(type_, DurationType):
        us = f"(int64_t)fsm_link_get_bytes(p + {at}, {size_of([type_])}u) * INT64_C({wire.tick})"
        yield f"fsm_ros_split({us}, &m.{_member(part)}sec, &m.{_member(part)}nanosec);"
    elif isinstance(type_, FloatType):
        kind = "float" if type_.bits == 32 else "double"
        yield f"m.{part.field} = ({PRIMITIVES[primitive]})fsm_link_get_{kind}(p + {at});"
    elif isinstance(type_, BoolType):
        yield f"m.{part.field} = p[{at}] != 0u;"
    else:
        which = "signed" if RANGES[code_of(type_)][0] < 0 else "bytes"
        read = f"fsm_link_get_{which}(p + {at}, {size_of([type_])}u)"
        yield f"m.{part.field} = ({PRIMITIVES[primitive]}){read};"
